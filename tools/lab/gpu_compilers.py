#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Compiles every pass with the compilers of GPUs that this machine does not have, and prints what they make of them.

    gpu_compilers.py fetch DIR [--all]       unpacks Mesa's drivers below DIR: AMD's, with --all every vendor's
    gpu_compilers.py run DIR GPU [--json F]  darb devices --passes as that GPU's driver would compile
    gpu_compilers.py check DIR [GPU]         AMD's compiler against assets/results/gpu_passes.json; 1: worse than there
    gpu_compilers.py record DIR              writes what is measured now to that table
    gpu_compilers.py tables DIR              prints the tables of docs/gpu.md, of every GPU that is there

    --darb PATH   the command (build/darb)
    --again       check: what the last call measured, without compiling

Mesa's drivers run over its no-op kernel driver (Debian: mesa-drm-shim). Nothing is executed, so results of the passes mean
nothing, but each pass is compiled as it would be on the GPU. GPUs: AMD's navi31, navi21 and vega10; with --all also
Intel's dg2 and bmg, NVIDIA's turing, ada, hopper and blackwell by Mesa's NVK, Apple's m1, and Adreno's a630 and a740.
Packages are unpacked, not installed. No package has Intel's no-op kernel driver, so it is built from Debian's source of
Mesa, which takes two minutes.
"""

import argparse
import json
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = ROOT / "assets/results/gpu_passes.json"
LIB = "usr/lib/x86_64-linux-gnu"
STABLE, NEW = "bookworm-backports", "unstable"

# GPU -> (suite, driver, no-op kernel driver, environment)
GPUS = {
    "navi31": (STABLE, "radeon", "amdgpu", {"AMDGPU_GPU_ID": "navi31"}),
    "navi21": (STABLE, "radeon", "amdgpu", {"AMDGPU_GPU_ID": "navi21"}),
    "vega10": (STABLE, "radeon", "amdgpu", {"AMDGPU_GPU_ID": "vega10"}),
    "dg2": (STABLE, "intel", "intel", {"INTEL_STUB_GPU_PLATFORM": "dg2"}),
    "bmg": (STABLE, "intel", "intel", {"INTEL_STUB_GPU_PLATFORM": "bmg"}),
    "turing": (NEW, "nouveau", "nouveau", {"NOUVEAU_CHIPSET": "162"}),
    "ada": (NEW, "nouveau", "nouveau", {"NOUVEAU_CHIPSET": "192"}),
    "hopper": (NEW, "nouveau", "nouveau", {"NOUVEAU_CHIPSET": "180"}),
    "blackwell": (NEW, "nouveau", "nouveau", {"NOUVEAU_CHIPSET": "1b2"}),
    "m1": (NEW, "asahi", "asahi", {}),
    "a630": (NEW, "freedreno", "freedreno", {"FD_GPU_ID": "630"}),
    "a740": (NEW, "freedreno", "freedreno", {"FD_GPU_ID": "740"}),
}
CHECKED = ("navi31", "navi21", "vega10")
NAMES = {"navi31": "RDNA 3 (navi31)", "navi21": "RDNA 2 (navi21)", "vega10": "Vega", "dg2": "Arc A770 (dg2)",
         "bmg": "Battlemage", "turing": "Turing", "ada": "Ada", "hopper": "Hopper", "blackwell": "Blackwell", "m1": "M1", "a630": "Adreno 630", "a740": "Adreno 740"}

PACKAGES = {
    STABLE: "mesa-vulkan-drivers mesa-drm-shim libdrm2 libdrm-common libdrm-amdgpu1",
    # A suite with a newer C library comes with its loader and everything that the drivers link.
    NEW: "mesa-vulkan-drivers mesa-drm-shim libdrm2 libdrm-common libdrm-amdgpu1 libvulkan1 libc6 libgcc-s1 "
         "libstdc++6 libllvm22 libz3-4 libzstd1 zlib1g libelf1t64 libexpat1 libffi8 libedit2 libtinfo6 libxml2-16 "
         "libbsd0 libmd0 libdisplay-info3 libwayland-client0 libx11-6 libx11-xcb1 libxau6 libxdmcp6 libxcb1 "
         "libxcb-dri3-0 libxcb-present0 libxcb-randr0 libxcb-shm0 libxcb-sync1 libxcb-xfixes0 libxshmfence1 spirv-tools",
}


def fail(text):
    sys.exit(f"gpu_compilers.py: {text}")


def apt(folder, *words):
    """apt-get with its own lists and sources, below `folder`."""
    options = {"Dir::Etc::SourceList": folder / "sources.list", "Dir::Etc::SourceParts": "/nonexistent",
               "Dir::State::Lists": folder / "lists", "Dir::Cache::archives": folder / "archives",
               "Dir::Cache::pkgcache": "", "Dir::Cache::srcpkgcache": ""}
    command = ["apt-get", "-q", *(f"-o{name}={value}" for name, value in options.items()), *words]
    return subprocess.run(command, cwd=folder / "archives", capture_output=True, text=True, check=False)


def mirror():
    """The mirror that this machine's apt uses."""
    listed = subprocess.run(["apt-get", "indextargets", "--format", "$(RELEASE) $(REPO_URI)", "Created-By: Packages"],
                            capture_output=True, text=True, check=False).stdout
    for line in listed.splitlines():
        release, _, uri = line.partition(" ")
        if release.startswith("bookworm") and "security" not in uri:
            return uri.strip()
    return fail("no apt source for Debian 12 (bookworm) here")


def fetch(root, suite):
    folder = root / f"apt-{suite}"
    for name in ("lists/partial", "archives"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    key = "[signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] " \
        if pathlib.Path("/usr/share/keyrings/debian-archive-keyring.gpg").exists() else ""
    suites = [suite] if suite == NEW else [suite, "bookworm"]
    (folder / "sources.list").write_text("".join(f"{kind} {key}{mirror()} {name} main\n" for name in suites
                                                 for kind in ("deb", "deb-src")))
    done = apt(folder, "update")
    if done.returncode != 0:
        fail(f"apt-get update of {suite}: {done.stderr.strip()}")
    for package in PACKAGES[suite].split():
        if apt(folder, "download", f"{package}/{suite}").returncode != 0 and \
                apt(folder, "download", package).returncode != 0:
            print(f"gpu_compilers.py: no package {package} in {suite}", file=sys.stderr)
    for archive in sorted((folder / "archives").glob("*.deb")):
        subprocess.run(["dpkg", "-x", archive, root / suite], check=True)
    for library in sorted((root / suite / LIB).glob("libvulkan_*.so")):
        manifest = {"file_format_version": "1.0.0", "ICD": {"library_path": str(library), "api_version": "1.3.0"}}
        name = library.stem.removeprefix("libvulkan_")
        (root / f"{suite}-{name}.json").write_text(json.dumps(manifest))


# What building Intel's no-op kernel driver needs besides a compiler: what to look for, and its package. Meson is
# fetched, too.
BUILD_NEEDS = {"/usr/bin/ninja": "ninja-build", "/usr/bin/bison": "bison", "/usr/bin/flex": "flex",
               "/usr/include/expat.h": "libexpat1-dev", "/usr/include/zlib.h": "zlib1g-dev",
               "/usr/include/libdrm/drm.h": "libdrm-dev", "/usr/lib/python3/dist-packages/mako": "python3-mako",
               "/usr/lib/python3/dist-packages/yaml": "python3-yaml"}


def build_intel(root):
    """Intel's no-op kernel driver, from the same source as the driver that fetch() unpacked."""
    missing = [package for path, package in BUILD_NEEDS.items() if not pathlib.Path(path).exists()]
    if missing:
        print(f"gpu_compilers.py: no dg2 and bmg: building Intel's no-op kernel driver needs {' '.join(missing)}",
              file=sys.stderr)
        return
    folder, work, library = root / f"apt-{STABLE}", root / "intel", "src/intel/tools/libintel_noop_drm_shim.so"
    apt(folder, "source", "--download-only", f"mesa/{STABLE}")
    apt(folder, "download", f"meson/{STABLE}")
    source = next((folder / "archives").glob("mesa_*.orig.tar.xz"), None)
    meson = next((folder / "archives").glob("meson_*.deb"), None)
    if not source or not meson:
        print(f"gpu_compilers.py: no dg2 and bmg: no source of mesa or no meson in {STABLE}", file=sys.stderr)
        return
    work.mkdir(exist_ok=True)
    subprocess.run(["tar", "-xf", source, "-C", work, "--strip-components=1"], check=True)
    subprocess.run(["dpkg", "-x", meson, work / "meson"], check=True)
    off = [f"-D{name}=disabled" for name in ("glx", "egl", "gbm", "gles1", "gles2", "llvm", "zstd", "xmlconfig", "valgrind",
                                             "libunwind")]
    env = {**os.environ, "PATH": "/usr/bin:/bin", "PYTHONPATH": str(work / "meson/usr/lib/python3/dist-packages")}
    for command in (["/usr/bin/python3", work / "meson/usr/bin/meson", "setup", "--wipe", work / "build", work, *off,
                     "-Dbuildtype=release", "-Dopengl=false", "-Dplatforms=", "-Dgallium-drivers=", "-Dvulkan-drivers=",
                     "-Dtools=drm-shim,intel"], ["ninja", "-C", work / "build", library]):
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            print(f"gpu_compilers.py: no dg2 and bmg: {done.stdout[-1000:]}{done.stderr[-1000:]}", file=sys.stderr)
            return
    (root / STABLE / LIB / pathlib.Path(library).name).write_bytes((work / "build" / library).read_bytes())


def is_there(root, gpu):
    suite, driver, shim, _ = GPUS[gpu]
    return (root / f"{suite}-{driver}.json").exists() and (root / suite / LIB / f"lib{shim}_noop_drm_shim.so").exists()


def passes(root, gpu, darb, out):
    """`darb devices --passes` on this GPU; the figures go to the file `out`."""
    if not is_there(root, gpu):
        fail(f"{gpu}: no driver below {root}; get it with: gpu_compilers.py fetch {root} --all")
    suite, driver, shim, extra = GPUS[gpu]
    libraries = root / suite / LIB
    manifest = str(root / f"{suite}-{driver}.json")
    env = {**os.environ, **extra, "VK_DRIVER_FILES": manifest, "VK_ICD_FILENAMES": manifest,
           "MESA_SHADER_CACHE_DISABLE": "true", "NVK_I_WANT_A_BROKEN_VULKAN_DRIVER": "1",
           "XDG_CACHE_HOME": str(root / f"cache-{gpu}")}
    shim_library = str(libraries / f"lib{shim}_noop_drm_shim.so")
    command = [str(darb), "devices", "--passes", "--json", str(out)]
    if suite == NEW:  # started by that suite's own loader, because its C library is newer
        loader = next((root / suite).rglob("ld-linux-x86-64.so.2"), None) or fail(f"no libc6 of {suite} below {root}")
        command = [str(loader), "--library-path", f"{libraries}:/{LIB}", "--preload", shim_library, *command]
    else:
        env |= {"LD_LIBRARY_PATH": str(libraries), "LD_PRELOAD": shim_library}
    return subprocess.run(command, env=env, capture_output=True, text=True, check=False)


def measured(root, gpu, darb, again=False):
    """again: uses what the last call measured, where that exists."""
    out = root / f"passes-{gpu}.json"
    if again and out.exists():
        return json.loads(out.read_text())
    out.unlink(missing_ok=True)
    done = passes(root, gpu, darb, out)
    if done.returncode != 0 or not out.exists():
        fail(f"{gpu}: darb devices --passes ended with {done.returncode}: {done.stderr.strip()[-2000:]}")
    return json.loads(out.read_text())


def key(row):
    """Identifies a pass on one GPU: shader, lanes of a subgroup, and its constants except a kernel's coefficients and those
    that are 0, so that a new constant that is off changes no name."""
    constants = [one for one in row["constants"].split()
                 if not re.match(r"KERNEL_|[A-Z_]+=-?\d*\.\d|\w+=\S*e-|\w+=0$", one)]
    return f"{row['shader']} [{' '.join(constants)}] {row['subgroup_size']}"


def limits(report):
    """What the table keeps for a GPU: registers, occupancy and scratch of each pass, the worst for each key."""
    table = {}
    for row in report["passes"]:
        kept = table.setdefault(key(row), {})
        for name, choose in (("registers", max), ("occupancy", min), ("scratch_bytes", max)):
            if name in row:
                kept[name] = choose(kept.get(name, row[name]), row[name])
    return table


def worse(gpu, report, table):
    """Sentences, one for each pass that is worse than the table or not in it."""
    found = []
    now, known = limits(report), table.get(gpu, {})
    for name, row in now.items():
        if row.get("scratch_bytes", 0) > known.get(name, {}).get("scratch_bytes", 0):
            found.append(f"{gpu}: {name} takes {row['scratch_bytes']:.0f} bytes of scratch memory")
        if name not in known:
            found.append(f"{gpu}: {name} is not in the table")
            continue
        if row.get("registers", 0) > known[name].get("registers", 0):
            found.append(f"{gpu}: {name} takes {row['registers']:.0f} registers, the table says "
                         f"{known[name]['registers']:.0f}")
        if row.get("occupancy", 0) < known[name].get("occupancy", 0):
            found.append(f"{gpu}: {name} has an occupancy of {row['occupancy']:.0f}, the table says "
                         f"{known[name]['occupancy']:.0f}")
    return found


def check(root, darb, gpus, again):
    table = json.loads(TABLE.read_text())
    found = []
    for gpu in gpus:
        report = measured(root, gpu, darb, again)
        if not report["has_statistics"] or not report["passes"]:
            fail(f"{gpu}: the driver tells nothing of its passes")
        found += worse(gpu, report, table)
        print(f"{gpu}: {len(report['passes'])} passes compiled")
    for line in found:
        print(line)
    if found:
        print("Where it is meant, write the table anew: tools/lab/gpu_compilers.py record DIR")
    return 1 if found else 0


def record(root, darb):
    table = {gpu: limits(measured(root, gpu, darb)) for gpu in CHECKED}
    lines = [f' "{gpu}": {{\n' + ",\n".join(f"  {json.dumps(name)}: {json.dumps(row)}" for name, row in sorted(rows.items()))
             + "\n }" for gpu, rows in table.items()]
    TABLE.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    return 0


# The rows of the tables: what they begin with, and which of the compiled passes they show.
ROWS = (("project, degree 3", r"^project \[.*SH_DEGREE=3"), ("emit", r"^emit \["), ("emit, slots", r"^emit_slots "),
        ("radix scatter, ballot", r"^radix_scatter_ballot "), ("blend", r"^blend \["),
        ("blend backward, team", r"^blend_backward_team "),
        ("blend backward, one subgroup", r"^blend_backward \["), ("blend backward, buckets", r"^blend_backward_buckets "),
        ("chunks of sums", r"^partial_chunks "),
        ("project backward + Adam, degree 3", r"^project_backward \[(?!.*UPDATE=).*SH_DEGREE=3"),
        ("loss by strips", r"^loss \["), ("loss by tiles, maps", r"^loss_maps "),
        ("loss by tiles, gradient", r"^loss_gradient "))


def tables(root, darb):
    gpus = [gpu for gpu in GPUS if is_there(root, gpu)]
    reports = {gpu: measured(root, gpu, darb) for gpu in gpus}
    for title, columns in (("Registers of a thread, subgroups that a core holds", ("registers", "occupancy")),
                           ("Instructions, static cycles", ("instructions", "cycles")),
                           ("Spills, bytes of scratch memory", ("spills", "scratch_bytes"))):
        print(f"\n{title}:\n\n| pass | " + " | ".join(NAMES[gpu] for gpu in gpus) + " |")
        print("|---" * (len(gpus) + 1) + "|")
        for name, pattern in ROWS:
            cells = []
            for gpu in gpus:
                row = next((row for row in reports[gpu]["passes"] if re.search(pattern, key(row))), None)
                values = [f"{row[c]:,.0f}" if row and c in row else "-" for c in columns]
                cells.append(", ".join(values) if row else "")
            print(f"| {name} | " + " | ".join(cells) + " |")
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=("fetch", "run", "check", "record", "tables"))
    parser.add_argument("dir", type=pathlib.Path)
    parser.add_argument("gpu", nargs="?", choices=sorted(GPUS))
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--darb", type=pathlib.Path, default=ROOT / "build/darb")
    flags = parser.parse_args()
    root = flags.dir.resolve()
    if flags.again and flags.verb != "check":
        fail(f"--again belongs to check, not to {flags.verb}")
    if flags.verb == "fetch":
        for suite in (STABLE, NEW) if flags.all else (STABLE,):
            fetch(root, suite)
        if flags.all:
            build_intel(root)
        print("there: " + " ".join(gpu for gpu in GPUS if is_there(root, gpu)))
        return 0 if is_there(root, CHECKED[0]) else 1
    if not flags.darb.exists():
        fail(f"{flags.darb} does not exist; build it, or name another with --darb")
    if flags.verb == "run":
        if not flags.gpu:
            fail("run: name a GPU: " + " ".join(GPUS))
        done = passes(root, flags.gpu, flags.darb.resolve(), (flags.json or root / f"passes-{flags.gpu}.json").resolve())
        print(done.stdout, end="")
        print(done.stderr, end="", file=sys.stderr)
        return done.returncode
    darb = flags.darb.resolve()
    if flags.verb == "check":
        return check(root, darb, [flags.gpu] if flags.gpu else CHECKED, flags.again)
    return {"record": record, "tables": tables}[flags.verb](root, darb)


if __name__ == "__main__":
    sys.exit(main())
