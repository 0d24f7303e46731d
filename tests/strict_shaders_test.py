# SPDX-License-Identifier: Apache-2.0
"""Compiles all shaders that the tests passed to the driver (saved through PEELER_SAVE_SHADERS) with a stricter
compiler: each stage as GLSL 4.50 core. Also links the programs, converts them to SPIR-V for OpenGL, and validates the
SPIR-V.

    python3 -B tests/strict_shaders_test.py FOLDER

No message is allowed, not even a warning. The compiler knows GL_EXT_shader_framebuffer_fetch only for GLES, so an
`inout` of that extension is compiled as an output, which may be read too. Links one program of each kind, or all with
PEELER_TEST_ALL.
"""

import collections
import concurrent.futures
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
SOME = 1  # programs per kind; each takes a fifth of a second
AT_ONCE = 200  # stages per call of the compiler
ALL = bool(os.environ.get("PEELER_TEST_ALL"))
FETCHED = re.compile(r"\binout (uint fetched_head;)")
TOOLS = {"glslangValidator": "glslang-tools", "spirv-val": "spirv-tools"}


def said(*command):
    """Returns the messages of a tool that should print none, without the names of the files."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if line.strip() and line.strip() not in command]
    return lines + ([f"exit code {done.returncode}"] if done.returncode != 0 else [])


def of_stages(stages):
    """Returns the messages about single stages."""
    return said("glslangValidator", "-t", *stages)


def of_program(stages):
    """Returns the messages about a program of several stages."""
    return said("glslangValidator", "-l", *stages)


def of_binary(stage):
    """Returns the messages about a stage converted to SPIR-V."""
    binary = f"{stage}.spv"
    found = said("glslangValidator", "-G", "--target-env", "opengl", "-o", binary, stage)
    if os.path.exists(binary):
        found += said("spirv-val", "--target-env", "opengl4.5", binary)
        os.remove(binary)
    return found


def gather(saved, folder):
    """Copies each distinct text once. Returns the stages, and the programs of each kind (such as "scene-count")."""
    stages, programs, fetching = {}, {}, 0
    for path in sorted(saved.iterdir()):
        text, fetches = FETCHED.subn(r"out \1", path.read_text(encoding="utf-8"))
        name = hashlib.sha256(text.encode()).hexdigest()[:32] + path.suffix
        if name not in stages:
            fetching += fetches
            stages[name] = str(folder / name)
            (folder / name).write_text(text, encoding="utf-8")
        programs.setdefault(path.stem, []).append(stages[name])
    kinds = collections.defaultdict(list)
    for stem, of_it in programs.items():
        kinds[stem.rpartition("-")[0]].append(of_it)
    return list(stages.values()), kinds, fetching


def main():
    missing = [package for tool, package in TOOLS.items() if not shutil.which(tool)]
    if missing:
        print(f"skipped: {' and '.join(missing)} of Debian are not installed")
        sys.exit(SKIPPED)
    with tempfile.TemporaryDirectory() as folder:
        stages, kinds, fetching = gather(pathlib.Path(sys.argv[1]), pathlib.Path(folder))
        if not stages:
            print("skipped: no test that was run has compiled a shader")
            sys.exit(SKIPPED)
        linked = [program for programs in kinds.values() for program in (programs if ALL else programs[:SOME])]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            parts = [stages[i : i + AT_ONCE] for i in range(0, len(stages), AT_ONCE)]
            findings = [line for found in pool.map(of_stages, parts) for line in found]
            findings += [line for found in pool.map(of_program, linked) for line in found]
            # Programs share stages, and two threads must not write the same binary file.
            of_linked = sorted({stage for program in linked for stage in program})
            findings += [line for found in pool.map(of_binary, of_linked) for line in found]
    print(*findings[:100], sep="\n")
    print(
        f"{len(stages)} stages, {fetching} of them with fetched list heads, {len(linked)} of "
        f"{sum(map(len, kinds.values()))} programs of {len(kinds)} kinds linked: {len(findings)} findings"
    )
    sys.exit(1 if findings else 0)


if __name__ == "__main__":
    main()
