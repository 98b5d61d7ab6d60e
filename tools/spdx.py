#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Puts the line "SPDX-License-Identifier: MIT" at the head of every source file that lacks it.

    tools/spdx.py            writes the line: first in a file, or after a #! line
    tools/spdx.py --check    only names the files that lack it; exit code 1 if there is one
    tools/spdx.py --root DIR the tree (default: the one that this script is in)

The files are those that git tracks in the folders of sources, C++, GLSL, Python, shell, CMake and JavaScript. A file that
has the line is left as it is, so a second run changes nothing. In shaders the line is a comment before #version, which
GLSL allows.
"""

import argparse
import os
import re
import subprocess
import sys

IDENTIFIER = "SPDX-License-Identifier: MIT"
COMMENTS = {".cpp": "//", ".h": "//", ".comp": "//", ".glsl": "//", ".js": "//", ".py": "#", ".sh": "#", ".cmake": "#"}
FOLDERS = ("cmake", "engine", "examples", "shaders", "tests", "tools", "trainer", "viewer")


def comment_of(path):
    """The comment mark of a file's language; None for files that are not sources."""
    if os.path.basename(path) == "CMakeLists.txt":
        return "#"
    return COMMENTS.get(os.path.splitext(path)[1])


def sources(root):
    listed = subprocess.run(["git", "-C", root, "ls-files", "-z", "--", *FOLDERS, "CMakeLists.txt"],
                            check=False, capture_output=True, text=True)
    if listed.returncode != 0:  # an unpacked archive
        return []
    return [path for path in listed.stdout.split("\0") if path and comment_of(path)]


def with_line(text, comment):
    """The text with the line; unchanged where one of its first five lines is that line."""
    if any(IDENTIFIER in line for line in text.split("\n", 5)[:5]):
        return text
    line = f"{comment} {IDENTIFIER}\n"
    if text.startswith("#!"):
        first, _, rest = text.partition("\n")
        # Scripts print their head as help, from the second line on; with this line, from the third.
        rest = re.sub(r"(?<=sed -n ')2,(\d+|/)", lambda m: "3," + ("/" if m[1] == "/" else str(int(m[1]) + 1)), rest)
        return f"{first}\n{line}{rest}"
    return line + text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing, name the files that lack the line")
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(os.path.abspath(__file__))), help="the tree")
    arguments = parser.parse_args()
    paths = sources(arguments.root)
    lacking = 0
    for path in paths:
        full = os.path.join(arguments.root, path)
        with open(full, encoding="utf-8", newline="") as file:
            text = file.read()
        wanted = with_line(text, comment_of(path))
        if wanted == text:
            continue
        lacking += 1
        if arguments.check:
            print(f"{path}: no line {IDENTIFIER} (tools/spdx.py writes it)")
        else:
            with open(full, "w", encoding="utf-8", newline="") as file:
                file.write(wanted)
    print(f"licences: {len(paths)} files, {lacking} {'without the line' if arguments.check else 'written'}")
    return 1 if arguments.check and lacking else 0


if __name__ == "__main__":
    sys.exit(main())
