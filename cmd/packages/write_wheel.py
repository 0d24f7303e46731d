#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the wheel: the Python package, and the archive's folder as its program.

write_wheel.py PYTHON_PACKAGE ARCHIVE_FOLDER VERSION ARCHITECTURE SECONDS OUTPUT_FOLDER

The format is that of PEP 427, the tag that of PEP 600. The archive's programs bring their C library, so they run where
the tag's glibc is older. Equal inputs give equal bytes: SECONDS since 1970 is the date of every file."""

import base64
import hashlib
import pathlib
import sys
import time
import zipfile

TAG = "py3-none-manylinux_2_17_{architecture}"
METADATA = """Metadata-Version: 2.1
Name: peeler
Version: {version}
Summary: Every layer of a glTF, PLY, STL, OBJ or 3MF scene, headless
License: Apache-2.0
Requires-Python: >=3.8
Requires-Dist: numpy
"""
WHEEL = """Wheel-Version: 1.0
Generator: peeler ({version})
Root-Is-Purelib: false
Tag: {tag}
"""
ENTRY_POINTS = """[console_scripts]
peeler = peeler_command:main
"""


def files_in(folder, target, is_kept=lambda name: True):
    """Returns {name in the wheel: (bytes, whether it is executable)}, sorted."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and is_kept(name):
            found[f"{target}/{name}"] = (path.read_bytes(), bool(path.stat().st_mode & 0o100))
    return found


def main(package, archive, version, architecture, seconds, output):
    tag = TAG.format(architecture=architecture)
    info = f"peeler-{version}.dist-info"
    files = files_in(pathlib.Path(package), "peeler", lambda name: "__pycache__" not in name)
    files.update(files_in(pathlib.Path(archive), "peeler/program"))
    command = pathlib.Path(__file__).with_name("peeler_command.py")
    files[command.name] = (command.read_bytes(), False)
    for name, text in (
        ("METADATA", METADATA.format(version=version)),
        ("WHEEL", WHEEL.format(version=version, tag=tag)),
        ("entry_points.txt", ENTRY_POINTS),
    ):
        files[f"{info}/{name}"] = (text.encode(), False)
    record = []
    for name, (data, _) in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record.append(f"{name},sha256={digest},{len(data)}\n")
    record.append(f"{info}/RECORD,,\n")
    files[f"{info}/RECORD"] = ("".join(record).encode(), False)

    date = time.gmtime(max(int(seconds), 315532800))[:6]  # ZIP dates begin in 1980
    wheel = pathlib.Path(output, f"peeler-{version}-{tag}.whl")
    with zipfile.ZipFile(wheel, "w") as zipped:
        for name, (data, executable) in files.items():
            member = zipfile.ZipInfo(name, date)
            member.external_attr = (0o100755 if executable else 0o100644) << 16
            member.compress_type = zipfile.ZIP_DEFLATED
            zipped.writestr(member, data, compresslevel=9)
    print(f"{wheel}: {(wheel.stat().st_size + 999_999) // 1_000_000} MB")


if __name__ == "__main__":
    main(*sys.argv[1:])
