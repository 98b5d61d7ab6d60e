# SPDX-License-Identifier: MIT
"""A copy of the sources with changes that stay out of the tree, and the command built from it, for scripts that measure
what a change brings. It does nothing by itself.
"""

import os
import shutil
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def changed_texts(script, changes):
    """The text of each file with its changes (file, text, other text); exits where one no longer fits the sources."""
    texts = {}
    for path, held, other in changes:
        if path not in texts:
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                texts[path] = file.read()
        if texts[path].count(held) != 1:
            sys.exit(f"{script}: {path} holds '{held}' {texts[path].count(held)} times")
        texts[path] = texts[path].replace(held, other)
    return texts


def built_copy(copy, texts):
    """Builds the command in the folder `copy` of the tree, from the sources with these texts; a second call rebuilds changes."""
    copy = os.path.join(ROOT, copy)
    files = subprocess.run(["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, check=True,
                           capture_output=True, text=True).stdout
    for name in files.splitlines():
        old, new = os.path.join(ROOT, name), os.path.join(copy, name)
        if not os.path.isfile(old) or name.startswith(("docs/", "assets/")):
            continue
        os.makedirs(os.path.dirname(new), exist_ok=True)
        if name in texts:
            with open(new, "w", encoding="utf-8") as file:
                file.write(texts[name])
        elif not os.path.isfile(new) or os.path.getmtime(old) > os.path.getmtime(new):
            shutil.copy2(old, new)
    os.environ.update(CCACHE_BASEDIR=copy, CCACHE_NOHASHDIR="1")
    folder = os.path.join(copy, "build")
    for command in (["cmake", "-G", "Ninja", "-S", copy, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", "-DDARB_TESTS=OFF",
                     "-DCMAKE_UNITY_BUILD=ON"], ["ninja", "-j2", "-C", folder, "darb"]):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return os.path.join(folder, "darb")


if __name__ == "__main__":
    print(__doc__.strip())
