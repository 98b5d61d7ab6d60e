#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks every include of the project's own files against the arrows of ARCHITECTURE.md.

    check_includes.py [ROOT]

The arrows are the lines "PART -> PART PART ..." of the block fenced as ```arrows. A part is a
folder; a file belongs to the longest part that holds it, and may always include its own part. The
words in angle brackets are outside libraries that only the parts naming them may include: <posix>
and <windows> are the headers of those systems, which are neither C++ nor C. A target may also be a
folder of parts, which stands for all of them. An arrow that no include uses is a violation, too.
"""

import os
import re
import sys

SUFFIXES = (".h", ".cpp", ".comp", ".glsl")
SYSTEMS = {
    "<posix>": ("sys", "arpa", "mach-o", "net", "netinet", "dlfcn.h", "execinfo.h", "fcntl.h", "ifaddrs.h", "malloc.h", "netdb.h",
                "poll.h", "pthread.h", "pwd.h", "sched.h", "semaphore.h", "signal.h", "spawn.h", "strings.h",
                "termios.h", "ucontext.h", "unistd.h"),
    "<windows>": ("direct.h", "io.h", "process.h", "psapi.h", "shellapi.h", "shlobj.h", "windows.h", "winsock2.h"),
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)


def read_arrows(path):
    """-> ({part: set of parts it may include}, set of guarded library prefixes)"""
    with open(path, encoding="utf-8") as file:
        block = re.search(r"^```arrows\n(.*?)^```", file.read(), re.MULTILINE | re.DOTALL)
    if not block:
        sys.exit(f"{path}: no block fenced as ```arrows")
    arrows = {}
    for line in block.group(1).splitlines():
        if line.strip():
            part, _, targets = line.partition("->")
            arrows[part.strip()] = set(targets.split())
    libraries = set(SYSTEMS) | {t for targets in arrows.values() for t in targets if t.startswith("<")}
    for part, targets in arrows.items():
        for target in targets - libraries - arrows.keys():
            if not any(other.startswith(target + "/") for other in arrows):
                sys.exit(f"{path}: {part} -> {target}: no such part")
    return arrows, libraries


def part_of(path, arrows):
    """The longest part whose folder holds the path, or None."""
    fitting = [part for part in arrows if path.startswith(part + "/")]
    return max(fitting, key=len, default=None)


def named(part, targets):
    """The targets that name the part, either itself or as one part of a folder."""
    return {target for target in targets if part == target or (part or "").startswith(target + "/")}


def library_of(included):
    """The word in angle brackets that stands for an include of an outside library."""
    first = included.split("/")[0]
    return next((system for system, heads in SYSTEMS.items() if first in heads), f"<{first}>")


def source_files(root, arrows):
    for top in sorted({part.split("/")[0] for part in arrows}):
        for folder, _, names in os.walk(os.path.join(root, top)):
            for name in sorted(names):
                if name.endswith(SUFFIXES):
                    yield os.path.relpath(os.path.join(folder, name), root)


def resolve(root, file, included):
    """The included file relative to root, looked up beside the includer and then in an include folder."""
    beside = os.path.normpath(os.path.join(os.path.dirname(file), included))
    for candidate in (beside, included, "shaders/" + included):
        if os.path.isfile(os.path.join(root, candidate)):
            return candidate
    return None


def violations(root, file, arrows, libraries, used):
    """Yields (line, message), and adds the arrows (part, target) that the file needs to `used`."""
    part = part_of(file, arrows)
    if part is None:
        yield 1, "in no part that ARCHITECTURE.md names"
        return
    with open(os.path.join(root, file), encoding="utf-8") as opened:
        text = opened.read()
    for match in INCLUDE.finditer(text):
        line = text.count("\n", 0, match.start(2)) + 1
        bracket, included = match.groups()
        if bracket == "<":
            library = library_of(included)
            used.add((part, library))
            if library in libraries and library not in arrows[part]:
                yield line, f"{part} may not include <{included}>"
            continue
        target_file = resolve(root, file, included)
        if target_file is None:
            yield line, f'"{included}" is neither beside this file nor under the root'
            continue
        target = part_of(target_file, arrows)
        allowed = named(target, arrows[part])
        used.update((part, name) for name in allowed)
        if target != part and not allowed:
            yield line, f"{part} may not include {target_file}"


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        print(__doc__.strip())
        return 0
    root = sys.argv[1] if len(sys.argv) > 1 else "."
    arrows, libraries = read_arrows(os.path.join(root, "ARCHITECTURE.md"))
    files = list(source_files(root, arrows))
    count, used = 0, set()
    for file in files:
        for line, message in violations(root, file, arrows, libraries, used):
            print(f"{file}:{line}: {message}")
            count += 1
    for part, targets in arrows.items():
        for target in sorted(targets):
            if (part, target) not in used:
                print(f"ARCHITECTURE.md: no include uses {part} -> {target}")
                count += 1
    print(f"includes: {len(files)} files, {count} violations")
    return 1 if count or not files else 0


if __name__ == "__main__":
    sys.exit(main())
