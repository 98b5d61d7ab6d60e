#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lets a shared library ask an older glibc for dlopen and related functions: their version GLIBC_2.34 becomes GLIBC_2.2.5.

  tools/portable/lower_versions.py LIBRARY    rewrites the file; refuses where another symbol needs 2.32 or later

It is for the Vulkan loader of the portable archive, which Debian has only as a shared library.
"""
import re
import struct
import subprocess
import sys

SAME_SINCE_THE_FIRST = {"dlopen", "dlsym", "dlclose", "dlerror", "dladdr"}
NEW, OLD = b"GLIBC_2.34", b"GLIBC_2.2.5"


def elf_hash(name):
    value = 0
    for byte in name:
        value = (value << 4) + byte
        high = value & 0xF0000000
        value = (value ^ (high >> 24)) & ~high & 0xFFFFFFFF
    return value


def sections(data):
    offset, = struct.unpack_from("<Q", data, 0x28)
    size, count = struct.unpack_from("<HH", data, 0x3A)
    for i in range(count):
        yield struct.unpack_from("<IIQQQQIIQQ", data, offset + i * size)


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__.strip())
        return 0 if sys.argv[1:] and sys.argv[1] in ("-h", "--help") else 2
    path = sys.argv[1]
    listing = subprocess.run(["objdump", "-T", path], check=True, stdout=subprocess.PIPE, text=True).stdout
    newer = {name for minor, name in re.findall(r"GLIBC_2\.(\d+)\S*\s+(\S+)$", listing, re.M) if int(minor) > 31}
    if newer - SAME_SINCE_THE_FIRST:
        print(f"lower_versions.py: {path} needs a newer glibc for {', '.join(sorted(newer - SAME_SINCE_THE_FIRST))}", file=sys.stderr)
        return 1
    with open(path, "rb") as file:
        data = bytearray(file.read())
    table = list(sections(data))
    needs = next(s for s in table if s[1] == 0x6FFFFFFE)  # SHT_GNU_verneed
    strings = table[needs[6]][4]
    at = needs[4]
    old_name = data.index(b"\0" + OLD + b"\0", strings, strings + table[needs[6]][5]) + 1 - strings
    while True:
        _, count, _, aux, following = struct.unpack_from("<HHIII", data, at)
        entry = at + aux
        for _ in range(count):
            _, flags, other, name, step = struct.unpack_from("<IHHII", data, entry)
            if data[strings + name:data.index(b"\0", strings + name)] == NEW:
                struct.pack_into("<IHHI", data, entry, elf_hash(OLD), flags, other, old_name)
            entry += step
        if following == 0:
            break
        at += following
    with open(path, "wb") as file:
        file.write(data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
