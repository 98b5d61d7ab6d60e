#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures how easy the tree is to change: sizes, signatures, members, and the files that a change of each kind touches.

    structure.py [--json] [ROOT]

Sizes are read with Universal Ctags (Debian: universal-ctags). The files of a change are those that name the last thing of
its kind that was added, without tests, documents and comments: whoever adds the next one edits as many. An attribute is
measured by adding one (tools/lab/new_attribute.py), or where that script is missing, by the files that name one. A second
process that trains along edits the users of the gradients' buffers but nothing that makes them, so the room that holds
those (engine/raster) does not count. The files of a format's own, reader, writer and layout, count as one. A number with
a target is marked where it misses it.
"""

import argparse
import json
import pathlib
import re
import subprocess
import sys

FOLDERS = ("engine", "trainer", "viewer", "tools", "shaders")
LONGEST_FUNCTION, MOST_PARAMETERS, MOST_MEMBERS = 60, 7, 25  # lines, of a signature, of a class

# kind of change: (example, pattern of what names it, most files that it should take)
CHANGES = {
    "kernel": ("multiquadric", r'KERNEL_INVERSE_MULTIQUADRIC|"inverse_multiquadric", [0-9]|multiquadric, parabolic', 2),
    "effect": ("off-centre", r"\boff_centre\b|OFF_CENTRE", 6),
    "format": (".ksplat", r"\bksplat|Ksplat", 2),
    "strategy": ("mcmc", r"\bmcmc|\bMcmc", 2),
    "command": ("psi", r"add_psi|ROW\(psi\b", 2),
    "sort": ("ballot", r'(?m)"ballot"|Strategy::ballot|^\s+ballot,|kBallot|radix_scatter_ballot|scatter=ballot', 3),
    "attribute": ("colour", r"\bsh_dc\b|kShDc|SH_DC", 8),
    "option": ("noise_lr", r"\bnoise_lr\b", 3),
    "second process": ("gradients before the step", r"GradientBuffers|gradient_buffers", 4),
}


def source_files(root):
    listed = subprocess.run(["git", "-C", root, "ls-files", *FOLDERS], capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.splitlines()
            if name.endswith((".cpp", ".h", ".comp", ".glsl", ".txt")) and not name.startswith("tools/lab/make_scene")]


def tags(root, files):
    """Every function and member of the C++ files."""
    command = ["ctags", "--sort=no", "--languages=C++", "--langmap=C++:.cpp.h", "--c++-kinds=fpmcs",
               "--fields=+neSKs", "--output-format=json", "-f", "-", "-L", "-"]
    cpp = [name for name in files if name.endswith((".cpp", ".h"))]
    done = subprocess.run(command, cwd=root, input="\n".join(cpp), capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"structure.py: ctags: {done.stderr.strip() or 'failed'}; install universal-ctags")
    return [json.loads(line) for line in done.stdout.splitlines()]


def parameters(signature):
    """Counts the parameters of a signature, without commas inside brackets."""
    inner = re.sub(r"\([^()]*\)|<[^<>]*>|\{[^{}]*\}", "", re.sub(r"<[^<>]*>", "", signature.strip()[1:-1]))
    return 0 if inner.strip() in ("", "void") else inner.count(",") + 1


def sizes(root, files):
    functions, signatures, members, methods = {}, {}, {}, {}
    for tag in tags(root, files):
        place = f"{tag['path']}: {tag.get('scope', '').removeprefix('darb::')}::{tag['name']}".replace(" ::", " ")
        if tag["kind"] == "function" and "end" in tag:
            functions[place] = tag["end"] - tag["line"] + 1
        if tag["kind"] in ("function", "prototype"):
            signatures[place] = max(signatures.get(place, 0), parameters(tag.get("signature", "()")))
        if tag.get("scopeKind") == "class":
            of_class = members if tag["kind"] == "member" else methods
            of_class.setdefault(tag["scope"].removeprefix("darb::"), set()).add(tag["name"])
    count = lambda of_class: {name: len(names) for name, names in of_class.items()}
    return functions, signatures, count(members), count(methods)


def over(values, limit):
    return sorted(((value, name) for name, value in values.items() if value > limit), reverse=True)


def without_comments(text):
    return re.sub(r"//[^\n]*", "", text)


def changes(root, files):
    root = pathlib.Path(root)
    texts = {name: name + "\n" + without_comments((root / name).read_text(errors="replace")) for name in files}
    found = {kind: sorted(name for name, text in texts.items() if re.search(pattern, text))
             for kind, (_, pattern, _) in CHANGES.items()}
    own = [name for name in found["format"] if pathlib.Path(name).name.startswith("spz")]
    found["format"] = own[:1] + [name for name in found["format"] if name not in own]
    found["second process"] = [name for name in found["second process"] if not name.startswith("engine/raster/")]
    if (root / "tools/lab/new_attribute.py").is_file():
        done = subprocess.run([sys.executable, root / "tools/lab/new_attribute.py", "--check"], capture_output=True, text=True,
                              check=False)
        if ": " not in done.stdout:
            sys.exit(f"structure.py: {done.stderr.strip()}")
        found["attribute"] = done.stdout.split(": ")[-1].split()
    return found


def same_names(files):
    """Names of headers and sources that occur in several folders, except a program's main.cpp."""
    folders = {}
    for name in files:
        path = pathlib.Path(name)
        if path.suffix in (".h", ".cpp") and path.name != "main.cpp":
            folders.setdefault(path.name, []).append(name)
    return sorted(" ".join(names) for names in folders.values() if len(names) > 1)


def matches(root, names, pattern, flags=0):
    return sum(len(re.findall(pattern, pathlib.Path(root, name).read_text(errors="replace"), flags)) for name in names)


def upward_arrows(root):
    """The rooms of trainer/, and the includes among them that go against the order in ARCHITECTURE.md."""
    page = pathlib.Path(root, "ARCHITECTURE.md").read_text()
    rooms = re.findall(r"^trainer/(\w+) *->", page, re.MULTILINE)
    climbs = 0
    for path in pathlib.Path(root, "trainer").glob("*/*"):
        for room in re.findall(r'^#include "trainer/(\w+)/', path.read_text(), re.MULTILINE):
            climbs += rooms.index(room) > rooms.index(path.parent.name)
    return len(rooms), climbs


def targets(root, files):
    """The targets for the shape of the tree: (what, current value, target)."""
    lines = {name: len(pathlib.Path(root, name).read_text(errors="replace").splitlines()) for name in files}
    code = [name for name in files if name.endswith((".cpp", ".h", ".comp", ".glsl"))]
    cpp = [name for name in code if name.endswith((".cpp", ".h")) and not name.startswith("shaders/")]
    command = [name for name in code if name.startswith("tools/darb/")]
    listed = subprocess.run(["git", "-C", root, "ls-files", "*.json"], capture_output=True, text=True, check=True)
    floors, climbs = upward_arrows(root)
    users = sum('"tools/darb/train_flags.h"' in pathlib.Path(root, name).read_text(errors="replace") for name in code)
    return [
        ("files that include train_flags.h", users, 4),
        ("headers of tools/darb in tools/python", matches(root, [n for n in code if n.startswith("tools/python/")],
                                                          r'^#include "tools/darb/', re.MULTILINE), 0),
        ("files of tools/darb", len(command), 60),
        ("lines of tools/darb", sum(lines[name] for name in command), 6000),
        ("rooms of trainer/", floors, 6),
        ("includes up the rooms of trainer/", climbs, 0),
        ("constructions of Schedule", matches(root, [n for n in code if n.endswith(".cpp")],
                                              r"\bSchedule(?: \w+)?[({](?!const\b)(?=\w)"), 3),
        # A compute shader is a file, and includes only what it calls, so that GLSL is not counted.
        ("files for each 1,000 lines of C++", round(1000 * len(cpp) / sum(lines[name] for name in cpp), 1), 6),
        ("lines of JSON", sum(len(pathlib.Path(root, name).read_text().splitlines())
                              for name in listed.stdout.split()), 8000),
        ("comments that begin with \"of\"", matches(root, code, r"//+ *[Oo]f "), 50),
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="the same, with every place, as JSON")
    parser.add_argument("root", nargs="?", default=".")
    options = parser.parse_args()
    files = source_files(options.root)
    functions, signatures, members, methods = sizes(options.root, files)
    touched = changes(options.root, files)
    lists = {"functions over 60 lines": over(functions, LONGEST_FUNCTION),
             "signatures over 7 parameters": over(signatures, MOST_PARAMETERS),
             "classes over 25 members": over(members, MOST_MEMBERS)}
    shape = targets(options.root, files)
    if options.json:
        print(json.dumps({**lists, "targets": shape, "files of one name": same_names(files), "files of a change": touched}, indent=1))
        return
    for title, rows in lists.items():
        print(f"{title}: {len(rows)}")
        for value, name in rows[:12]:
            print(f"  {value:4}  {name}")
    print(f"files of one name in different folders: {len(same_names(files))}")
    for names in same_names(files):
        print(f"        {names}")
    for name in ("Trainer", "Forward", "Viewer"):
        print(f"class {name}: {members.get(name, 0)} members, {methods.get(name, 0)} methods")
    print("the shape of the tree:")
    for what, now, most in shape:
        print(f"  {what:40} {now:6}  (target {most}){'' if now <= most else '  over'}")
    print("files that name the last thing of a kind:")
    for kind, (example, _, most) in CHANGES.items():
        count = len(touched[kind])
        print(f"  {kind:15} {count:3}  (target {most}; {example}){'' if count <= most else '  over'}")


if __name__ == "__main__":
    main()
