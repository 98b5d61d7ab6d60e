#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Whether every source compiles with clang and libc++, the compiler and library of macOS.

    libcxx.py BUILD [--compiler clang++-16] [--jobs N] [WORD...]

BUILD is a build folder whose generated headers are there. Only syntax and types are checked, without
the headers that are parsed beforehand, so it takes a few minutes. WORDs choose files by a part of
their names. Debian's packages are clang-16, libc++-16-dev and libc++abi-16-dev.
"""

import argparse
import concurrent.futures
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys

OTHERS = ("/tests/", "/python/", "cmake_pch")  # they need libraries that were built with another standard library


def arguments(command):
    """The include folders, definitions and standard of a line of compile_commands.json."""
    words = iter(shlex.split(command))
    kept = []
    for word in words:
        if word in ("-isystem", "-I"):
            kept += [word, next(words)]
        elif word in ("-include", "-o", "-c"):
            next(words)
        elif word.startswith(("-I", "-D", "-std=")):
            kept.append(word)
    return kept


def check(compiler, entry):
    words = [compiler, "-stdlib=libc++", "-fsyntax-only", "-w", "-ferror-limit=0", *arguments(entry["command"]), entry["file"]]
    done = subprocess.run(words, cwd=entry["directory"], text=True, capture_output=True, check=False)
    errors = [line for line in done.stderr.splitlines() if " error: " in line or " fatal error: " in line]
    return entry["file"], errors or ([done.stderr.strip()] if done.returncode else [])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--compiler", default="clang++-16")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    given = parser.parse_args()
    if not shutil.which(given.compiler):
        sys.exit(f"libcxx.py: no {given.compiler} (apt install clang-16 libc++-16-dev libc++abi-16-dev)")
    entries = [e for e in json.loads((given.build / "compile_commands.json").read_text())
               if not any(part in e["file"] for part in OTHERS)
               and (not given.words or any(word in e["file"] for word in given.words))]
    if not entries:
        sys.exit(f"libcxx.py: {given.build} compiles no such file")
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        for file, errors in pool.map(lambda e: check(given.compiler, e), entries):
            if errors:
                failed += 1
                print("\n  ".join([f"FAILED  {os.path.relpath(file)}", *errors]), flush=True)
    print(f"{len(entries) - failed} of {len(entries)} compile with libc++")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
