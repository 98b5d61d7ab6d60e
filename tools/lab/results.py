# SPDX-License-Identifier: MIT
"""How the laboratory writes its results: JSON with one row per line, so that a file is short and its changes are readable."""

import json
import textwrap

LONGEST = 240  # most characters of a value that goes on one line


def text(value, indent=0):
    """The value as JSON: on one line where that is short, otherwise one line for each member."""
    line = json.dumps(value)
    if len(line) <= LONGEST or not isinstance(value, (dict, list)):
        return line
    pad = "\n" + " " * (indent + 1)
    if isinstance(value, list) and not any(isinstance(member, (dict, list, str)) for member in value):
        lines = textwrap.wrap(line[1:-1], LONGEST, break_on_hyphens=False)
        return "[" + pad + pad.join(lines) + "\n" + " " * indent + "]"
    if isinstance(value, dict):
        members = [f"{json.dumps(key)}: {text(member, indent + 1)}" for key, member in value.items()]
    else:
        members = [text(member, indent + 1) for member in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return opening + pad + ("," + pad).join(members) + "\n" + " " * indent + closing


def write(path, value):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text(value) + "\n")


if __name__ == "__main__":
    print(__doc__)
