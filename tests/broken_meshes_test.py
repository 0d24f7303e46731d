# SPDX-License-Identifier: Apache-2.0
"""Tests broken PLY, STL, OBJ, 3MF and splat files, which are generated here: each is rejected with the position of the fault, or
drawn with a warning.

Each file may take at most SECONDS of processor time and MEBIBYTES, unless PEELER_SANITIZE is set. Prints a table.
PEELER is the program.
"""

import gzip
import pathlib
import struct
import tempfile
import unittest

import threemf_package
from bombs_test import MEBIBYTES, SANITIZED, SECONDS, run

# Each file: its fault, its name, its bytes, and the expected texts. For a rejected file (exit code 3), these are the
# message, and the position after the file name; for a drawn file (exit code 0), the warning, or "" for none.
REFUSED, SHOWN = [], []


def refused(what, name, data, words, place):
    REFUSED.append((what, name, data if isinstance(data, bytes) else data.encode(), words, place))


def shown(what, name, data, words=""):
    SHOWN.append((what, name, data if isinstance(data, bytes) else data.encode(), words, ""))


# ---- PLY

AXES = "property float x\nproperty float y\nproperty float z\n"
CORNERS = "0 0 0\n1 0 0\n0 1 0\n"


def ply(vertices="3", faces="1", data=CORNERS + "3 0 1 2\n", kind="ascii", list_type="uchar int", more=""):
    head = f"ply\nformat {kind} 1.0\nelement vertex {vertices}\n{AXES}{more}"
    head += f"element face {faces}\nproperty list {list_type} vertex_indices\nend_header\n"
    return head.encode() + (data if isinstance(data, bytes) else data.encode())


def packed(order=">", indices=(0, 1, 2), corners=(0, 0, 0, 1, 0, 0, 0, 1, 0), count=3):
    return struct.pack(f"{order}9fB3i", *corners, count, *indices)


LITTLE, BIG = "binary_little_endian", "binary_big_endian"
NAN, INF = float("nan"), float("inf")

shown("ply: whole", "p.ply", ply())
shown("ply: no line feed at the end", "p.ply", ply()[:-1])
shown("ply: CRLF", "p.ply", ply().replace(b"\n", b"\r\n"))
shown("ply: a byte order mark", "p.ply", b"\xef\xbb\xbf" + ply())
shown("ply: big-endian", "p.ply", ply(kind=BIG, data=packed()))
shown("ply: CR alone", "p.ply", ply().replace(b"\n", b"\r"))
shown("ply: CRLF before binary data", "p.ply", ply(kind=LITTLE, data=b"").replace(b"\n", b"\r\n") + packed("<"))
shown("ply: called .stl", "p.stl", ply())
shown("ply: no faces", "p.ply", ply(faces="0", data=CORNERS))
shown("ply: no vertices", "p.ply", ply("0", "0", ""), "nothing to draw")
shown("ply: NaN of a normal", "p.ply", ply(more="property float nx\nproperty float ny\nproperty float nz\n",
      data="0 0 0 0 0 1\n1 0 0 nan 0 0\n0 1 0 0 0 1\n3 0 1 2\n"), "normals are left out")
shown("ply: a face of two corners", "p.ply", ply(data=CORNERS + "2 0 1\n"), "fewer than three corners")
shown("ply: a face of one vertex", "p.ply", ply(data=CORNERS + "3 0 0 0\n"))
shown("ply: bytes behind the end", "p.ply", ply() + b"9 9 9\n", "Bytes after")
shown("ply: an unknown element", "p.ply", ply().replace(b"end_header", b"element q 0\nproperty int i\nend_header"))
refused("ply: the header alone", "p.ply", ply(data=""), "ends before", ":10")
refused("ply: cut in the header", "p.ply", ply()[:60], "no end_header", ":")
refused("ply: only its first line", "p.ply", "ply\n", "no end_header", ":2")
refused("ply: cut in a vertex", "p.ply", ply(data="0 0 0\n1 0"), "ends before", ":")
refused("ply: cut in a face", "p.ply", ply(data=CORNERS + "3 0 1"), "ends before", ":")
refused("ply: binary, cut in a vertex", "p.ply", ply(kind=LITTLE, data=packed("<")[:30]), "ends before", ", byte ")
refused("ply: binary, cut in a face", "p.ply", ply(kind=LITTLE, data=packed("<")[:-1]), "ends before", ", byte ")
refused("ply: 2^31 faces", "p.ply", ply(faces="2147483648"), "ends before", ":")
refused("ply: binary, 2^31 faces", "p.ply", ply(kind=BIG, faces="2147483648", data=packed()), "ends before", ", byte ")
refused("ply: 2^31 vertices", "p.ply", ply(vertices="2147483648"), "ends before", ":")
refused("ply: 2^64 vertices", "p.ply", ply(vertices="18446744073709551616"), "number of elements", ":3")
refused("ply: −1 faces", "p.ply", ply(faces="-1"), "number of elements", ":7")
refused("ply: a list of 2^31 corners", "p.ply", ply(kind=LITTLE, list_type="uint int", data=packed("<")[:36]
        + struct.pack("<I3i", 1 << 31, 0, 1, 2)), "ends before", ", byte ")
refused("ply: a list of −1 corners", "p.ply", ply(list_type="char int", data=CORNERS + "-1\n"), "length", ":")
refused("ply: a list of 2.5 corners", "p.ply", ply(list_type="float int", data=CORNERS + "2.5 0 1\n"), "length", ":")
refused("ply: NaN", "p.ply", ply(data="nan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), "NaN", ":")
refused("ply: infinite", "p.ply", ply(data="0 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"), "infinite", ":")
refused("ply: too large", "p.ply", ply(data="0 0 0\n1 1e39 0\n0 1 0\n3 0 1 2\n"), "too large", ":")
refused("ply: binary, NaN", "p.ply", ply(kind=BIG, data=packed(corners=(0, 0, NAN, 1, 0, 0, 0, 1, 0))), "NaN",
        ", byte ")
refused("ply: an index past the end", "p.ply", ply(data=CORNERS + "3 0 1 3\n"), "vertex 3 is out of range", ":")
refused("ply: a negative index", "p.ply", ply(data=CORNERS + "3 0 1 -1\n"), "vertex -1 is out of range", ":")
refused("ply: binary, an index past the end", "p.ply", ply(kind=LITTLE, data=packed("<", (0, 1, 1 << 30))), "there are 3",
        ", byte ")
refused("ply: a word for a number", "p.ply", ply(data=CORNERS.replace("1 0 0", "1 zero 0") + "3 0 1 2\n"), '"zero"', ":")
refused("ply: an unknown type", "p.ply", ply(more="property quad q\n"), "unknown type", ":7")
refused("ply: an unknown format", "p.ply", ply(kind="binary_middle_endian"), "unknown format", ":2")
refused("ply: a line that means nothing", "p.ply", ply(more="what is this\n"), "an unknown line", ":7")
refused("ply: no x", "p.ply", ply().replace(b"property float x\n", b"property float w\n"), "no x, y and z", "")
refused("ply: no list of corners", "p.ply", ply().replace(b"vertex_indices", b"corners"), "vertex_indices", ":")
refused("ply: faces before vertices", "p.ply", "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int "
        f"vertex_indices\nelement vertex 3\n{AXES}end_header\n3 0 1 2\n{CORNERS}", "before the vertices", ":")
refused("ply: no vertices at all", "p.ply", "ply\nformat ascii 1.0\nelement q 1\nproperty int i\nend_header\n1\n",
        "no element vertex", "")

# ---- STL

FACET = struct.pack("<12fH", 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
TEXT = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n"


def stl(count=2, facets=FACET * 2, head=b"made here"):
    return head.ljust(80, b"\0") + struct.pack("<I", count) + facets


shown("stl: whole", "s.stl", stl())
shown("stl: binary that begins with solid", "s.stl", stl(head=b"solid but binary"))
shown("stl: called .ply", "s.ply", stl())
shown("stl: no triangles", "s.stl", stl(0, b""), "nothing to draw")
shown("stl: colours", "s.stl", stl(facets=FACET[:48] + b"\xff\xff" + FACET), "colours")
shown("stl: bytes behind the end", "s.stl", stl(facets=FACET * 2 + b"more"), "Bytes after")
shown("stl: text", "s.stl", TEXT)
shown("stl: text, no line feed at the end", "s.stl", TEXT[:-1])
shown("stl: text, CRLF", "s.stl", TEXT.replace("\n", "\r\n"))
shown("stl: text, a byte order mark", "s.stl", "\ufeff" + TEXT)
shown("stl: text, capitals", "s.stl", TEXT.upper())
shown("stl: text, a normal that is none", "s.stl", TEXT.replace("0 0 1", "-nan(ind) x"))
refused("stl: shorter than a header", "s.stl", stl()[:83], "shorter than a header", "")
refused("stl: nothing", "s.stl", b"", "shorter than a header", "")
refused("stl: cut in a triangle", "s.stl", stl()[:150], "ends before its 2 triangles", ", byte 150")
refused("stl: 2^31 triangles", "s.stl", stl(1 << 31), "ends before", ", byte 184")
refused("stl: NaN", "s.stl", stl(facets=FACET + FACET[:12] + struct.pack("<f", NAN) + FACET[16:]), "triangle 1",
        ", byte 146")
refused("stl: infinite", "s.stl", stl(facets=FACET[:44] + struct.pack("<f", -INF) + b"\0\0" + FACET), "triangle 0",
        ", byte 96")
refused("stl: text, cut", "s.stl", TEXT[:80], "", ":")
shown("stl: text, cut behind a facet", "s.stl", TEXT[: TEXT.index("endsolid")], "may be cut off")
shown("stl: text, in one line", "s.stl", TEXT.replace("\n", " "))
shown("stl: text, solid twice", "s.stl", "solid s\n" + TEXT)
refused("stl: text, none of it", "s.stl", "solid s\nOnce upon a time\n" * 9, "does not belong here", ":2")
refused("stl: text, two corners", "s.stl", TEXT.replace("vertex 1 0 0\n", ""), "fewer than three", ":7")
refused("stl: text, four corners", "s.stl", TEXT.replace("endloop", "vertex 1 1 1\nendloop"), "more than three", ":7")
refused("stl: text, a word for a number", "s.stl", TEXT.replace("1 0 0", "1 none 0"), '"none"', ":5")
refused("stl: text, NaN", "s.stl", TEXT.replace("1 0 0", "nan 0 0"), '"nan"', ":5")
refused("stl: text, a strange word", "s.stl", TEXT.replace("endloop", "enough"), '"enough"', ":7")

# ---- OBJ

OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n"

shown("obj: whole", "o.obj", OBJ)
shown("obj: no line feed at the end", "o.obj", OBJ[:-1])
shown("obj: CRLF", "o.obj", OBJ.replace("\n", "\r\n"))
shown("obj: a byte order mark", "o.obj", "\ufeff" + OBJ)
shown("obj: a face before its vertices", "o.obj", "f 1 2 3\n" + OBJ)
shown("obj: called .stl", "o.stl", OBJ)
shown("obj: a face of two corners", "o.obj", OBJ + "f 1 2\n", "fewer than three corners")
shown("obj: half of the corners have normals", "o.obj", OBJ + "f 1//1 2 3\n", "others lack")
shown("obj: statements that mean nothing", "o.obj", OBJ + "hello world\n", "Unknown lines are ignored")
shown("obj: curves", "o.obj", OBJ + "cstype bezier\n", "Curves and surfaces")
shown("obj: no materials", "o.obj", "mtllib none.mtl\nusemtl red\n" + OBJ, "does not exist")
shown("obj: materials outside", "o.obj", "mtllib ../none.mtl\n" + OBJ, "leads out of the scene's folder")
shown("obj: absolute materials", "o.obj", "mtllib /etc/passwd\n" + OBJ, "an absolute path")
shown("obj: no faces", "o.obj", "v 0 0 0\n", "nothing to draw")
shown("obj: comments behind statements", "o.obj", OBJ.replace("\n", " # a\n"))
shown("obj: normals that are NaN", "o.obj", OBJ + "vn nan 0 0\n", "left out")
shown("obj: a backslash at the end", "o.obj", OBJ + "f 1 2 \\", "fewer than three corners")
refused("obj: index 0", "o.obj", OBJ + "f 0 1 2\n", "index 0 is out of range", ":7")
refused("obj: an index past the end", "o.obj", OBJ + "f 1 2 4\n", "index 4 is out of range", ":7")
refused("obj: a negative index past the beginning", "o.obj", OBJ + "f -1 -2 -4\n", "index -4 is out of range", ":7")
refused("obj: an index of 2^63", "o.obj", OBJ + "f 1 2 9223372036854775808\n", "expected an index", ":7")
refused("obj: a texture coordinate past the end", "o.obj", OBJ + "f 1/2 2/1 3/1\n", "index 2 is out of range", ":7")
refused("obj: a normal past the end", "o.obj", OBJ + "f 1//1 2//1 3//9\n", "index 9 is out of range", ":7")
refused("obj: a word for an index", "o.obj", OBJ + "f one two three\n", '"one"', ":7")
refused("obj: no index", "o.obj", OBJ + "f /1 2/1 3/1\n", "expected an index", ":7")
refused("obj: two coordinates", "o.obj", "v 1 2\n" + OBJ, "fewer than three coordinates", ":1")
refused("obj: a word for a number", "o.obj", "v 1 2 c\n" + OBJ, '"c"', ":1")
refused("obj: NaN", "o.obj", "v 1 2 nan\n" + OBJ, "NaN", ":1")
refused("obj: too large", "o.obj", "v 1 2 1e300\n" + OBJ, "too large", ":1")
refused("obj: text that is none", "o.obj", "Once upon a time\n", "not an OBJ file", ":1")
refused("obj: UTF-16", "o.obj", OBJ.encode("utf-16"), "UTF-16", "")
refused("obj: a pointer of Git LFS", "o.obj", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS", "")
refused("obj: cut in a vertex", "o.obj", OBJ + "v 1 2", "fewer than three coordinates", ":7")
refused("obj: a polygon of 200,000 zigzags", "o.obj", "".join(f"v {i} {i % 2 * 10} {i % 3}\n" for i in range(60000))
        + "f " + " ".join(map(str, range(1, 60001))) + "\n", "takes too long", ":60001")

# ---- 3MF


def threemf(resources=threemf_package.OBJECT, **more):
    return threemf_package.package(threemf_package.model(resources, **more))


NESTED = threemf_package.OBJECT + "".join(
    f'<object id="{i}"><components><component objectid="{i - 1}"/></components></object>' for i in range(2, 1500)
)

shown("3mf: whole", "m.3mf", threemf())
shown("3mf: called .stl", "m.stl", threemf())
shown("3mf: no build items", "m.3mf", threemf(build=""), "nothing to draw")
for end in (4, 100, 300, 500, len(threemf()) - 1):
    refused(f"3mf: cut at {end}", "m.3mf", threemf()[:end], "the archive is damaged", "")
refused("3mf: a damaged model", "m.3mf", threemf()[:600] + b"????" + threemf()[604:], "", "")
refused("3mf: XML that ends early", "m.3mf", threemf_package.package("<model><resources>"), "lib3mf cannot read", "")
refused("3mf: no XML", "m.3mf", threemf_package.package("Once upon a time"), "lib3mf cannot read", "")
refused("3mf: no resources", "m.3mf", threemf_package.package("<model/>"), "lib3mf cannot read", "")
refused("3mf: no model", "m.3mf", threemf_package.package("").replace(b"3dmodel.model", b"3dmodel.modal"), "not a 3MF",
        "")
refused("3mf: a vertex that does not exist", "m.3mf", threemf(threemf_package.OBJECT.replace('v3="2"', 'v3="9"')),
        "index", "")
refused("3mf: NaN", "m.3mf", threemf(threemf_package.OBJECT.replace('x="1"', 'x="nan"')), "Coordinates", "")
refused("3mf: an item of no object", "m.3mf", threemf(build='<item objectid="4"/>'), "Build item", "")
refused("3mf: 1,500 levels", "m.3mf", threemf(NESTED, build='<item objectid="1499"/>'), "", "")

# ---- Gaussian splats

SPLAT = [*"x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()]
VALUES = dict(zip(SPLAT, (0, 0, 0, 0, 0, 0, 0, -3, -3, -3, 1, 0, 0, 0)))


def splats(count="1", kind=LITTLE, names=(), data=None, **values):
    """Returns a 3DGS PLY with one splat."""
    names = [*SPLAT, *names]
    head = f"ply\nformat {kind} 1.0\nelement vertex {count}\n" + "".join(f"property float {name}\n" for name in names)
    row = struct.pack(f"<{len(names)}f", *(values.get(name, VALUES.get(name, 0)) for name in names))
    return head.encode() + b"end_header\n" + (row if data is None else data)


LIMITS = [f"{end}_{what}{axis}" for what in ("", "scale_") for end in ("min", "max") for axis in "xyz"]
PACKED = [f"packed_{name}" for name in ("position", "rotation", "scale", "color")]


def chunked(chunks=1, rows=1, count="1", kind="uint", limit=1.0, data=None):
    """Returns a compressed PLY."""
    head = f"ply\nformat {LITTLE} 1.0\nelement chunk {chunks}\n" + "".join(f"property float {n}\n" for n in LIMITS)
    head += f"element vertex {count}\n" + "".join(f"property {kind} {name}\n" for name in PACKED) + "end_header\n"
    body = struct.pack("<12f", *[limit] * 12) * chunks + struct.pack("<4I", 0, 0, 0, 255) * rows
    return head.encode() + (body if data is None else data)


def spz(count=1, version=3, degree=0, bits=12, flags=0, size=20, magic=b"NGSP"):
    head = magic + struct.pack("<IIBBBB", version, count, degree, bits, flags, 0)
    return gzip.compress(head + bytes(size), mtime=0)


DOT = struct.pack("<6f8B", 0, 0, 0, 1, 1, 1, 9, 9, 9, 255, 255, 128, 128, 128)

shown("splats: whole", "p.ply", splats())
shown("splats: an infinite opacity", "p.ply", splats(opacity=INF))
shown("splats: scales of exp(-inf)", "p.ply", splats(scale_0=-INF))
shown("splats: NaN", "p.ply", splats(x=NAN), "left out (1")
shown("splats: NaN of a colour", "p.ply", splats(f_dc_1=NAN), "left out (1")
shown("splats: an opacity of NaN", "p.ply", splats(opacity=NAN), "left out (1")
shown("splats: scales of exp(1e30)", "p.ply", splats(scale_1=1e30), "left out (1")
shown("splats: a rotation of zeros", "p.ply", splats(rot_0=0), "not turned (1")
shown("splats: an infinite rotation", "p.ply", splats(rot_0=INF), "left out (1")
shown("splats: bytes behind the end", "p.ply", splats() + b"more", "Bytes after")
shown("splats: none", "p.ply", splats("0", data=b""), "nothing to draw")
refused("splats: cut in a splat", "p.ply", splats()[:-1], "ends before", ", byte ")
refused("splats: 2^31 splats", "p.ply", splats("2147483648"), "ends before", ", byte ")
refused("splats: 2^64 splats", "p.ply", splats("18446744073709551616"), "number of elements", ":3")
refused("splats: text, cut", "p.ply", splats(kind="ascii", data=b"0 0 0 0"), "ends before", ":")
refused("splats: one of nine coefficients", "p.ply", splats(names=["f_rest_0"]), "no whole degree", "")
refused("splats: flat ones", "p.ply", splats().replace(b"scale_2", b"other_2"), "no scale_2", "")
shown("chunks: whole", "p.ply", chunked())
shown("chunks: NaN", "p.ply", chunked(limit=NAN), "left out (1")
refused("chunks: none", "p.ply", chunked(chunks=0), "need 1 chunks", "")
refused("chunks: 2^31 splats", "p.ply", chunked(count="2147483648"), "ends before", ", byte ")
refused("chunks: 257 splats of one chunk", "p.ply", chunked(rows=257, count="257"), "need 2 chunks", "")
refused("chunks: floats", "p.ply", chunked(kind="float"), "must be uint", "")
refused("chunks: text out of range", "p.ply", chunked(chunks=0, data=b"1 2 -3 4\n").replace(LITTLE.encode(), b"ascii"),
        "out of range", ":")
refused("chunks: cut", "p.ply", chunked()[:-1], "ends before", ", byte ")
shown("spz: whole", "s.spz", spz())
shown("spz: called .splat", "s.splat", spz())
shown("spz: version 2", "s.spz", spz(version=2, size=19))
shown("spz: bytes behind the end", "s.spz", spz(size=21), "Bytes after")
shown("spz: unknown flags", "s.spz", spz(flags=4), "Unknown flags")
refused("spz: 2^32 - 1 splats", "s.spz", spz(count=(1 << 32) - 1), "ends before", "")
refused("spz: one byte short", "s.spz", spz(size=19), "ends before", "")
refused("spz: version 4", "s.spz", spz(version=4), "SPZ version 4", "")
refused("spz: degree 4", "s.spz", spz(degree=4), "degree 4", "")
refused("spz: 255 fractional bits", "s.spz", spz(bits=255), "fractional bits", "")
refused("spz: extensions", "s.spz", spz(flags=2), "extensions", "")
refused("spz: other gzip", "s.spz", spz(magic=b"text"), "not an SPZ", "")
refused("spz: damaged", "s.spz", spz()[:-9] + bytes(9), "damaged", "")
for end in (2, 10, 20):
    refused(f"spz: cut at {end}", "s.spz", spz()[:end], "damaged", "")
shown("splat: whole", "s.splat", DOT)
shown("splat: NaN", "s.splat", struct.pack("<f", NAN) + DOT[4:], "left out (1")
shown("splat: a scale of -1", "s.splat", DOT[:12] + struct.pack("<f", -1) + DOT[16:], "left out (1")
shown("splat: a rotation of zeros", "s.splat", DOT[:28] + b"\x80" * 4, "not turned (1")
shown("splat: nothing", "s.splat", b"", "nothing to draw")
refused("splat: cut", "s.splat", DOT + DOT[:-1], "within splat 1", ", byte 63")
refused("sog", "s.sog", b"PK\3\4", "SOG splats are not supported", "")

# ---- unknown formats

refused("nothing", "x.glb", b"", "empty", "")
refused("a picture", "x.bin", b"\x89PNG\r\n\x1a\n" + bytes(40), "neither a scene nor", "")
refused("text", "x.txt", "Once upon a time\n", "neither a scene nor", "")


class BrokenMeshes(unittest.TestCase):
    def judge(self, what, name, data, words, place, code):
        with tempfile.TemporaryDirectory(prefix="broken") as folder:
            path = pathlib.Path(folder) / name
            path.write_bytes(data)
            verb = ["info", "{}/" + name]
            ran = run(verb, pathlib.Path(folder))
            said = ran.err.decode("utf-8", "replace")
        self.rows.append(f"{what:45} {ran.code:4} {ran.seconds:6.2f} s {ran.mebibytes:5.0f} MB  "
                         + said.replace(folder, "…").partition("\n")[0][:110])
        faults = []
        if ran.code != code:
            faults.append(f"exit code {ran.code}")
        if words not in said or (code == 0) != (words == "" or "warning: " in said) and code == 0:
            faults.append(f'no word of "{words}"')
        if code == 0 and words == "" and said:
            faults.append("a warning")
        if code != 0 and str(path) + place not in said:
            faults.append(f'no place "{place}"')
        if ran.seconds > SECONDS and not SANITIZED:
            faults.append(f"{ran.seconds:.1f} s")
        if ran.mebibytes > MEBIBYTES and not SANITIZED:
            faults.append(f"{ran.mebibytes:.0f} MB")
        return [f"{what}: {', '.join(faults)}\n    {said[:300]}"] if faults else []

    def test_all(self):
        self.rows, errors = [], []
        self.assertGreaterEqual(len(REFUSED), 50)
        for each in REFUSED:
            errors += self.judge(*each, 3)
        for each in SHOWN:
            errors += self.judge(*each, 0)
        print("\n".join(self.rows))
        print(f"{len(REFUSED)} refused, {len(SHOWN)} shown")
        if errors:
            self.fail("\n" + "\n".join(errors))


if __name__ == "__main__":
    unittest.main()
