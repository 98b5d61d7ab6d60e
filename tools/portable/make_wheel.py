#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Packs a wheel from what tools/wheel.sh built, with the libraries that it needs.

    make_wheel.py BUILD PYTHON OUT [--copyrights FOLDER]     PYTHON: 311, 313 and so on

The rules are those of auditwheel for manylinux_2_36: of the libraries of the system, only those that
every Linux has may be needed, with symbols no newer than Debian 12's. All others lie in darb.libs,
under names with a hash, so that two packages with different versions of one get along. Vulkan's
loader is one of them: a driver brings its own file for the loader, but not always the loader.
"""

import argparse
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PLATFORM = "manylinux_2_36_x86_64"
EVERYWHERE = {"libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "libstdc++.so.6",
              "libgcc_s.so.1", "libz.so.1", "ld-linux-x86-64.so.2"}
NEWEST = {"GLIBC": (2, 36), "GLIBCXX": (3, 4, 30), "CXXABI": (1, 3, 13), "GCC": (12, 0, 0), "ZLIB": (1, 2, 9)}
# The packages of what is in the wheel, compiled or bundled; each has its licence in a file.
COPYRIGHTS = ("libfmt-dev libzip-dev libmuparser-dev libmeshoptimizer-dev libglfw3-dev libimgui-dev "
              "libstb-dev libzstd1 libwebp7 libpng16-16 libjpeg62-turbo libvulkan1 nlohmann-json3-dev "
              "libglm-dev libnanoflann-dev libcli11-dev libeigen3-dev pybind11-dev fonts-roboto-unhinted").split()
COMMAND = '''#!python
# Starts the command of the package darb.
import importlib.util
import os
import sys

package = os.path.dirname(importlib.util.find_spec("darb").origin)
command = os.path.join(package, "bin", "darb")
os.execv(command, [sys.argv[0], *sys.argv[1:]])
'''


def run(*words):
    return subprocess.run([str(w) for w in words], check=True, text=True, stdout=subprocess.PIPE).stdout


def needed(file):
    return re.findall(r"\(NEEDED\).*\[(.*)\]", run("readelf", "-dW", file))


def found(file):
    """Where the loader finds each library that the file needs, itself or through another."""
    pairs = re.findall(r"^\s*(\S+) => (/\S+)", run("ldd", file), re.MULTILINE)
    return {name: pathlib.Path(path).resolve() for name, path in pairs}


def check_symbols(file):
    for name, version in re.findall(r"\b(GLIBCXX|GLIBC|CXXABI|GCC|ZLIB)_([0-9.]+)\b", run("readelf", "-VW", file)):
        if tuple(int(n) for n in version.split(".")) > NEWEST[name]:
            sys.exit(f"make_wheel.py: {file} needs {name}_{version}, which {PLATFORM} does not have")


class Libraries:
    """The folder darb.libs, which grows by what is asked for."""

    def __init__(self, folder):
        self.folder = folder
        self.names = {}

    def bundle(self, file, name):
        """Copies a library and what it needs; returns its new name."""
        if name not in self.names:
            digest = hashlib.sha256(file.read_bytes()).hexdigest()[:8]
            stem, rest = name.split(".so", 1)
            self.names[name] = f"{stem}-{digest}.so{rest}"
            self.folder.mkdir(exist_ok=True)
            copy = self.folder / self.names[name]
            shutil.copyfile(file, copy)
            copy.chmod(0o755)
            run("patchelf", "--set-soname", self.names[name], copy)
            self.mend(copy, "$ORIGIN", file)
        return self.names[name]

    def mend(self, file, rpath, original):
        """Makes the file look for what is bundled, there."""
        paths = found(original)
        own = [name for name in needed(file) if name not in EVERYWHERE]
        for name in own:
            run("patchelf", "--replace-needed", name, self.bundle(paths[name], name), file)
        if own:
            run("patchelf", "--force-rpath", "--set-rpath", rpath, file)
        check_symbols(file)


def metadata(version, python, licences):
    lines = ["Metadata-Version: 2.1", "Name: darb", f"Version: {version}",
             "Summary: 3D splats with a choice of kernel, trained and rendered on any Vulkan device, without CUDA",
             "Author: The darb authors", "License: MIT", f"Requires-Python: >={python[0]}.{python[1:]}",
             "Requires-Dist: numpy>=1.23", "Provides-Extra: torch", 'Requires-Dist: torch>=1.13; extra == "torch"',
             "Classifier: License :: OSI Approved :: MIT License", "Classifier: Operating System :: POSIX :: Linux",
             "Classifier: Programming Language :: C++",
             f"Classifier: Programming Language :: Python :: {python[0]}.{python[1:]}",
             "Classifier: Topic :: Multimedia :: Graphics :: 3D Rendering",
             *(f"License-File: {name}" for name in licences),
             "Description-Content-Type: text/markdown", "", (SOURCE / "README.md").read_text(encoding="utf-8")]
    return "\n".join(lines)


def copy_licences(copyrights, folder):
    """darb's and those of COPYRIGHTS, with the texts that Debian's files only refer to; returns their names."""
    shutil.copyfile(SOURCE / "LICENSE", folder / "LICENSE")
    common = pathlib.Path("/usr/share/common-licenses")
    for name in COPYRIGHTS:
        places = [place / name / "copyright" for place in (copyrights, pathlib.Path("/usr/share/doc"))]
        text = next(p for p in places if p.exists()).read_text(encoding="utf-8")
        (folder / f"{name}.txt").write_text(text, encoding="utf-8")
        for known in re.findall(rf"{common}/([A-Za-z0-9.+-]*[A-Za-z0-9+])", text):
            shutil.copyfile(common / known, folder / f"{known}.txt")
    return sorted(p.name for p in folder.iterdir())


def stage(build, python, version, copyrights, root):
    """Lays the wheel's files out in root."""
    package = root / "darb"
    shutil.copytree(SOURCE / "tools" / "python" / "darb", package, ignore=shutil.ignore_patterns("__pycache__"))
    libraries = Libraries(root / "darb.libs")
    module = next((build / "python-wheels").glob(f"_darb.cpython-{python}-*.so"))
    (package / "bin").mkdir()
    for file, to, rpath in ((module, package / module.name, "$ORIGIN/../darb.libs"),
                            (build / "darb", package / "bin" / "darb", "$ORIGIN/../../darb.libs")):
        run("strip", "-o", to, file)
        libraries.mend(to, rpath, file)
    scripts = root / f"darb-{version}.data" / "scripts"
    scripts.mkdir(parents=True)
    (scripts / "darb").write_text(COMMAND)
    info = root / f"darb-{version}.dist-info"
    (info / "licenses").mkdir(parents=True)
    licences = copy_licences(copyrights, info / "licenses")
    (info / "METADATA").write_text(metadata(version, python, licences), encoding="utf-8")
    (info / "WHEEL").write_text("Wheel-Version: 1.0\nGenerator: darb (tools/wheel.sh)\nRoot-Is-Purelib: false\n"
                                f"Tag: cp{python}-cp{python}-{PLATFORM}\n")
    return info


def pack(root, info, file):
    """Writes the files in order, with one date, so that the same files make the same bytes."""
    programs = {"bin/darb", "scripts/darb"}
    rows = []
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as wheel:
        def add(name, data, executable=False):
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.external_attr = (0o100755 if executable else 0o100644) << 16
            wheel.writestr(entry, data, zipfile.ZIP_DEFLATED)
            digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
            rows.append(f"{name},sha256={digest},{len(data)}")
        for path in sorted(p for p in root.rglob("*") if p.is_file()):
            name = path.relative_to(root).as_posix()
            add(name, path.read_bytes(), name.split("/", 1)[1] in programs or ".so" in path.name)
        record = f"{info.name}/RECORD"
        add(record, ("\n".join([*rows, f"{record},,"]) + "\n").encode())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("python")
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--copyrights", type=pathlib.Path, default=pathlib.Path("/usr/share/doc"))
    given = parser.parse_args()
    cache = (given.build / "CMakeCache.txt").read_text()
    version = re.search(r"^CMAKE_PROJECT_VERSION:STATIC=(.*)$", cache, re.MULTILINE)[1]
    file = given.out / f"darb-{version}-cp{given.python}-cp{given.python}-{PLATFORM}.whl"
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        info = stage(given.build, given.python, version, given.copyrights, root)
        pack(root, info, file)
        bundled = ", ".join(sorted(p.name for p in (root / "darb.libs").iterdir()))
    print(f"{file}: {os.path.getsize(file) / 1e6:.1f} MB, with {bundled}")


if __name__ == "__main__":
    main()
