# SPDX-License-Identifier: Apache-2.0
"""Every program that the tests have given to the driver, as PEELER_SAVE_SHADERS leaves it in a folder, by a compiler that
forgives less: each stage as GLSL 4.50 core, each program linked, made into SPIR-V for OpenGL, and that validated.

    python3 -B tests/strict_shaders_test.py FOLDER

Nothing may be said, not even a warning. That compiler knows GL_EXT_shader_framebuffer_fetch of GLES alone: what a shader
reads there of what it overwrites (`inout`) is an output for it, which may be read as well."""

import concurrent.futures
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SKIPPED = 77
FETCHED = re.compile(r"\binout (uint fetched_slot;)")
TOOLS = {"glslangValidator": "glslang-tools", "spirv-val": "spirv-tools"}


def run(*command):
    """What a tool that should have nothing to say says."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    said = [line for line in done.stdout.splitlines() if line.strip() and line.strip() not in command]
    if done.returncode != 0:
        said.append(f"exit code {done.returncode}")
    return said


def findings(stages):
    """What is found in a program, whose stages are files of one stem."""
    with tempfile.TemporaryDirectory() as folder:
        files, fetches = [], False
        for stage in stages:
            text, count = FETCHED.subn(r"out \1", stage.read_text(encoding="utf-8"))
            fetches |= count > 0
            files.append(pathlib.Path(folder, stage.name))
            files[-1].write_text(text, encoding="utf-8")
        said = run("glslangValidator", "-l", *map(str, files))
        for file in files:
            binary = f"{file}.spv"
            said += run("glslangValidator", "-G", "--target-env", "opengl", "-o", binary, str(file))
            if pathlib.Path(binary).exists():
                said += run("spirv-val", "--target-env", "opengl4.5", binary)
    return said, fetches


def main():
    missing = [package for tool, package in TOOLS.items() if not shutil.which(tool)]
    if missing:
        print(f"skipped: {' and '.join(missing)} of Debian are not installed")
        sys.exit(SKIPPED)
    programs = {}
    for stage in sorted(pathlib.Path(sys.argv[1]).iterdir()):
        programs.setdefault(stage.stem, []).append(stage)
    if not programs:
        print("skipped: no test that was run has compiled a shader")
        sys.exit(SKIPPED)
    failed = fetching = 0
    with concurrent.futures.ThreadPoolExecutor() as pool:
        for name, (said, fetches) in zip(programs, pool.map(findings, programs.values())):
            fetching += fetches
            if said:
                failed += 1
                print(name, *said, sep="\n    ")
    stages = sum(map(len, programs.values()))
    print(f"{len(programs)} programs of {stages} stages, {fetching} of them with fetched slots: {failed} with findings")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
