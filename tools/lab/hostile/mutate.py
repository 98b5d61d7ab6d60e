# SPDX-License-Identifier: MIT
"""Damage to files: bytes, text and JSON. Every function takes a random.Random and returns (damaged, what was done)."""

import json
import struct

HOSTILE_TEXT = [
    "", " ", "\"", "'", "a'b\"c", "a\nb", "a\r\nb", "a\tb", "\x1b[31mred\x1b[0m", "\x1b]0;title\x07", "\x9b2J", "\x08\x08",
    "</script><script>alert(1)</script>", "<img src=x onerror=alert(1)>", "\" onload=\"alert(1)", "<!--", "]]>",
    "\u202etxt.gnp", "\u2066a\u2069", "../../escape.png", "../escape", "/dev/zero", "/dev/stdin", "/dev/full", "/proc/self/mem",
    "mine/notes.txt", "..", ".", "/", "CON", "%s%n%d", "$(touch owned)", "`touch owned`", "; touch owned", "a" * 5000, "\0",
    "a\0b", "\ufeff", "\ud83d\ude00".encode("utf-16", "surrogatepass").decode("utf-16"), "__import__('os').system('id')",
    "nan", "1e999", "-1", "true", "null", "{}", "{{", "}", "-rf", "--help", "C:\\x", "\\", "a\\nb",
]
HOSTILE_NUMBERS = [
    "0", "-0", "-1", "1", "255", "256", "65536", "2147483647", "2147483648", "-2147483648", "4294967295", "4294967296",
    "9223372036854775807", "9223372036854775808", "18446744073709551615", "1e9", "1e18", "1e38", "3.5e38", "1e308", "1e309",
    "-1e308", "1e-320", "1e-45", "nan", "inf", "-inf", "0.5", "-0.5", "1700000000", "0x10", "1e", "--1", "1,5", "٣", "1" * 400,
]
HOSTILE_JSON = [
    None, True, False, 0, -1, 1, 0.5, -0.5, 2**31, 2**32, 2**63, -2**63, 2**64, 10**30, 1e38, 1e39, 1e300, -1e300, 1e-300,
    1700000000, [], {}, [[]], [0], [None], {"a": 1}, [1e300] * 4, ["x"] * 3, [0] * 2000,
]


def numbers(rng):
    """The bytes of a number that may trip readers."""
    if rng.random() < 0.5:
        value = rng.choice([0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1, 10**6, 10**9, 10**12])
        size = rng.choice([1, 2, 4, 8])
        return (value % (1 << 8 * size)).to_bytes(size, rng.choice(["little", "big"]))
    value = rng.choice([float("nan"), float("inf"), float("-inf"), 1e38, -1e38, 1e-40, 0.0, -0.0, 1e9, -1.0, 1700000000.0])
    return struct.pack(rng.choice(["<f", "<d"]), value)


def flip_bit(data, rng):
    data = bytearray(data)
    at, bit = rng.randrange(len(data)), rng.randrange(8)
    data[at] ^= 1 << bit
    return bytes(data), f"bit {bit} of byte {at} flipped"


def truncate(data, rng):
    length = rng.choice([0, 1, len(data) - 1, rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)])
    return data[:max(0, length)], f"cut to {max(0, length)} of {len(data)} bytes"


def damage_bytes(data, rng, other=b""):
    """Any damage; other: a second file to splice from."""
    if not data:
        return rng.randbytes(rng.randrange(64)), "random bytes"
    kind = rng.randrange(9)
    at = rng.randrange(len(data))
    if kind == 0:
        return flip_bit(data, rng)
    if kind == 1:
        return truncate(data, rng)
    if kind == 2:
        for _ in range(rng.randrange(2, 30)):
            data, _ = flip_bit(data, rng)
        return data, "several bits flipped"
    if kind == 3:
        put = numbers(rng)
        return data[:at] + put + data[at + len(put):], f"{put.hex()} put over byte {at}"
    if kind == 4:
        start, length = rng.randrange(len(data)), rng.randrange(1, 200)
        return data[:at] + data[start:start + length] + data[at:], f"{length} bytes of {start} put in at {at}"
    if kind == 5:
        length = rng.randrange(1, 200)
        return data[:at] + data[at + length:], f"{length} bytes taken out at {at}"
    if kind == 6:
        return data[:at] + other[rng.randrange(len(other)):] if other else data + data, f"spliced at {at}"
    if kind == 7:
        put = rng.randbytes(rng.randrange(1, 64))
        return data[:at] + put + data[at + len(put):], f"{len(put)} random bytes over {at}"
    at = min(at, 160)  # headers come first
    put = numbers(rng)
    return data[:at] + put + data[at + len(put):], f"{put.hex()} put over byte {at}"


def damage_text(data, rng):
    """A word or a line of a text file."""
    lines = data.decode("utf-8", "surrogateescape").split("\n")
    at = rng.randrange(len(lines))
    if len(lines) > 12 and rng.random() < 0.5:
        at = rng.randrange(12)
    kind = rng.randrange(6)
    if kind == 0:
        del lines[at]
        done = f"line {at} taken out"
    elif kind == 1:
        lines.insert(at, lines[rng.randrange(len(lines))])
        done = f"a line put in at {at}"
    elif kind == 2:
        lines[at] += rng.choice(HOSTILE_TEXT)
        done = f"text behind line {at}"
    else:
        words = lines[at].split(" ")
        word = rng.randrange(len(words))
        words[word] = rng.choice(HOSTILE_NUMBERS if kind < 5 else HOSTILE_TEXT)
        lines[at] = " ".join(words)
        done = f"word {word} of line {at} is {words[word][:40]!r}"
    return "\n".join(lines).encode("utf-8", "surrogateescape"), done


def _nodes(value, path=()):
    yield path
    if isinstance(value, dict):
        for key in value:
            yield from _nodes(value[key], (*path, key))
    elif isinstance(value, list):
        for i, item in enumerate(value[:20]):
            yield from _nodes(item, (*path, i))


def damage_json(data, rng):
    """A value of the wrong type or size, a missing key, or a hostile name; in JSON lines, in one line."""
    text = data.decode("utf-8", "surrogateescape")
    lines = text.splitlines() if "\n{" in text and not text.startswith(("[", "{\n")) else [text]
    line = rng.randrange(len(lines))
    try:
        document = json.loads(lines[line])
    except ValueError:
        return damage_bytes(data, rng)
    path = rng.choice(list(_nodes(document)))
    if not path:
        changed, done = rng.choice(HOSTILE_JSON), "the document"
        document = changed
    else:
        parent = document
        for step in path[:-1]:
            parent = parent[step]
        kind = rng.randrange(5)
        if kind == 0:
            del parent[path[-1]]
            done = "taken out"
        elif kind == 1:
            value = rng.choice(HOSTILE_TEXT)
            if isinstance(parent, dict) and rng.random() < 0.3:
                parent[value] = parent.pop(path[-1])
                done = f"key is {value[:40]!r}"
            else:
                parent[path[-1]] = value
                done = f"is {value[:40]!r}"
        elif kind == 2 and isinstance(parent, list):
            parent += parent * 3
            done = "list repeated"
        else:
            parent[path[-1]] = rng.choice(HOSTILE_JSON)
            done = f"is {str(parent[path[-1]])[:40]}"
    lines[line] = json.dumps(document, indent=None, ensure_ascii=rng.random() < 0.5)
    if rng.random() < 0.05:
        lines[line] = "[" * 100000 + lines[line]
        done = "deeply nested"
    where = ".".join(str(step) for step in path)
    return "\n".join(lines).encode("utf-8", "surrogatepass"), f"line {line}, {where}: {done}"
