# SPDX-License-Identifier: Apache-2.0
"""Tests that CPU hits have the same bits with every compilation: builds the hit finder without optimisation, and for
processors with and without fused multiply-adds and wider registers, and compares the output (same_hits/hit_hashes.cpp).

    python3 tests/same_hits.py SOURCE_FOLDER BUILD_FOLDER

Exits with 1 if two builds differ. Skips flags that this machine cannot run, with a message.
"""

import json
import os
import pathlib
import platform
import re
import shutil
import struct
import subprocess
import sys

# The relevant features of the x86-64 levels, by their names in /proc/cpuinfo.
V3 = {"avx2", "bmi2", "fma"}
V4 = V3 | {"avx512f", "avx512bw", "avx512cd", "avx512dq", "avx512vl"}
# Each build: name, build type, flags, and the processor features that it needs (None: any processor).
BUILDS = [
    ("debug", "Debug", "-O0", None),
    ("release", "Release", "-O3", None),
    ("x86-64", "Release", "-O2 -march=x86-64", set()),
    ("x86-64-v3", "Release", "-O3 -march=x86-64-v3", V3),
    ("x86-64-v4", "Release", "-O3 -march=x86-64-v4 -mprefer-vector-width=512", V4),
]
MODELS = ["Duck/glTF-Binary/Duck.glb", "DamagedHelmet/glTF-Binary/DamagedHelmet.glb"]


def processor():
    """Returns the features of the processor; None if it is not x86-64."""
    if platform.machine() != "x86_64":
        return None
    found = re.search(r"^flags\s*:(.*)", pathlib.Path("/proc/cpuinfo").read_text(), re.M)
    return set(found[1].split()) if found else set()


def write_mesh(glb, path):
    """Writes the first primitive of a .glb in the format of hit_hashes."""
    data = glb.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document, binary = json.loads(data[20 : 20 + length]), data[28 + length :]

    def numbers(accessor, code, components):
        found = document["accessors"][accessor]
        view = document["bufferViews"][found["bufferView"]]
        start = view.get("byteOffset", 0) + found.get("byteOffset", 0)
        size = components * struct.calcsize(code)
        step = view.get("byteStride", size)
        return b"".join(
            binary[start + i * step : start + i * step + size] for i in range(found["count"])
        )

    primitive = document["meshes"][0]["primitives"][0]
    code = {5123: "H", 5125: "I"}[document["accessors"][primitive["indices"]]["componentType"]]
    positions = numbers(primitive["attributes"]["POSITION"], "f", 3)
    indices = [i for (i,) in struct.iter_unpack("<" + code, numbers(primitive["indices"], code, 1))]
    path.write_bytes(
        struct.pack("<2I", len(positions) // 12, len(indices))
        + positions
        + struct.pack(f"<{len(indices)}I", *indices)
    )


def meshes(source, folder):
    assets = pathlib.Path(os.environ.get("PEELER_ASSETS") or source.parent / "shared" / "assets")
    if not assets.is_dir():
        print("left out: real models, no asset folder (set PEELER_ASSETS)")
        return []
    files = []
    for model in MODELS:
        files.append(folder / (pathlib.Path(model).stem + ".mesh"))
        write_mesh(assets / "gltf-sample-assets" / model, files[-1])
    return files


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{done.stdout}{done.stderr}\n{command[0]} has failed")
    return done.stdout


def built(source, folder, build_type, flags):
    """Returns the path of the built program. The flags replace those of the build type."""
    kind = build_type.upper()
    run("cmake", "-S", source, "-B", folder, "-G", "Ninja", f"-DCMAKE_BUILD_TYPE={build_type}",
        f"-DCMAKE_CXX_FLAGS_{kind}={flags}")  # fmt: skip
    run("cmake", "--build", folder, "--target", "hit_hashes")
    return folder / "tests" / "hit_hashes"


def main():
    source, folder = (pathlib.Path(path).resolve() for path in sys.argv[1:])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    files, has = meshes(source, folder), processor()
    printed = {}
    for name, build_type, flags, needs in BUILDS:
        if needs is not None and (has is None or not needs <= has):
            missing = "no x86-64" if has is None else "without " + ", ".join(sorted(needs - has))
            print(f"left out: {flags}, the processor is {missing}")
            continue
        program = built(source, folder / name, build_type, flags)
        printed[name] = run(program, *files).splitlines()
        shutil.rmtree(folder / name)
    first, *others = printed
    print(*printed[first], sep="\n")
    differing = 0
    for name in others:
        for expected, line in zip(printed[first], printed[name], strict=True):
            if line == expected:
                continue
            print(f"{name} differs from {first}: {line}")
            differing += 1
    print(f"{len(printed)} builds ({', '.join(printed)}), {differing} differences")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
