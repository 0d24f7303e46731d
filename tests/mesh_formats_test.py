# SPDX-License-Identifier: Apache-2.0
"""Tests that a model is the same in glTF, PLY, STL, OBJ and 3MF, and that peeler reads the meshes of other programs as these
programs do.

PEELER is the program.
"""

import importlib.util
import json
import os
import pathlib
import shutil
import struct
import subprocess
import tempfile
import unittest

import numpy

import threemf_package

PEELER = os.environ.get("PEELER", "peeler")
HAS_MESHIO = importlib.util.find_spec("meshio") is not None
HAS_OPEN3D = importlib.util.find_spec("open3d") is not None
ASSIMP = shutil.which("assimp")
MESHLAB = [shutil.which("xvfb-run"), "-a", shutil.which("meshlabserver")]


def peeler(*words, code=0):
    ran = subprocess.run([PEELER, *map(str, words)], capture_output=True, check=False)
    if ran.returncode != code:
        raise AssertionError(f"{words}: exit code {ran.returncode}\n{ran.stderr.decode()}")
    return ran


def info(path, *more):
    return json.loads(peeler("info", path, "--json", *more).stdout)


# ---- a model


def bumpy_ball(rings=24, sides=37):
    """Returns a closed surface with uneven coordinates, as vertices (n, 3) of float32 and triangles (m, 3)."""
    vertices = [(0, 1, 0)]
    for ring in range(1, rings):
        for side in range(sides):
            around, down = 2 * numpy.pi * side / sides, numpy.pi * ring / rings
            radius = 1 + 0.2 * numpy.sin(5 * around) * numpy.sin(down)
            vertices.append(
                (
                    radius * numpy.sin(down) * numpy.cos(around),
                    radius * numpy.cos(down),
                    radius * numpy.sin(down) * numpy.sin(around),
                )
            )
    vertices.append((0, -1, 0))
    last = len(vertices) - 1
    triangles = []
    for side in range(sides):
        after = (side + 1) % sides
        triangles.append((0, 1 + after, 1 + side))
        for ring in range(rings - 2):
            a, b = 1 + ring * sides + side, 1 + ring * sides + after
            triangles += [(a, b, a + sides), (b, b + sides, a + sides)]
        triangles.append((last, last - sides + side, last - sides + after))
    return numpy.array(vertices, numpy.float32), numpy.array(triangles, numpy.uint32)


GREY = {
    "name": "neutral",
    "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0},
    "doubleSided": True,
}


def write_gltf(path, vertices, triangles):
    data = vertices.tobytes() + triangles.tobytes()
    path.with_suffix(".bin").write_bytes(data)
    gltf = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "ball"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [GREY],
        "buffers": [{"byteLength": len(data), "uri": path.with_suffix(".bin").name}],
        "bufferViews": [
            {"buffer": 0, "byteLength": vertices.nbytes},
            {"buffer": 0, "byteOffset": vertices.nbytes, "byteLength": triangles.nbytes},
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(vertices),
                "type": "VEC3",
                "min": vertices.min(0).tolist(),
                "max": vertices.max(0).tolist(),
            },
            {"bufferView": 1, "componentType": 5125, "count": triangles.size, "type": "SCALAR"},
        ],
    }
    path.write_text(json.dumps(gltf), encoding="utf-8")


def write_ply(path, vertices, triangles, order="<"):
    name = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    head = f"ply\nformat {name} 1.0\nelement vertex {len(vertices)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    with open(path, "wb") as file:
        file.write(head.encode())
        if not order:
            for v in vertices:
                file.write(("%.9g %.9g %.9g\n" % tuple(v)).encode())
            for t in triangles:
                file.write(("3 %d %d %d\n" % tuple(t)).encode())
            return
        file.write(vertices.astype(order + "f4").tobytes())
        rows = numpy.zeros(len(triangles), [("n", "u1"), ("corners", order + "i4", 3)])
        rows["n"], rows["corners"] = 3, triangles
        file.write(rows.tobytes())


def write_stl(path, vertices, triangles):
    rows = numpy.zeros(len(triangles), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = vertices[triangles]
    path.write_bytes(b"solid, and binary".ljust(80) + struct.pack("<I", len(triangles)) + rows.tobytes())


def write_text_stl(path, vertices, triangles):
    with open(path, "w", encoding="utf-8") as file:
        file.write("solid ball\n")
        for corners in vertices[triangles]:
            file.write("facet normal 0 0 0\nouter loop\n")
            for corner in corners:
                file.write("vertex %.9g %.9g %.9g\n" % tuple(corner))
            file.write("endloop\nendfacet\n")
        file.write("endsolid ball\n")


def write_obj(path, vertices, triangles):
    with open(path, "w", encoding="utf-8") as file:
        file.write("# a ball\no ball\n")
        for v in vertices:
            file.write("v %.9g %.9g %.9g\n" % tuple(v))
        for i, t in enumerate(triangles.astype(int)):
            corners = t - len(vertices) if i % 2 else t + 1  # indices relative to the end, or from the start
            file.write("f %d %d %d\n" % tuple(corners))


def write_3mf(path, vertices, triangles):
    mesh = f'<object id="1" name="binary">{threemf_package.mesh(vertices, triangles)}</object>'
    item = '<item objectid="1" transform="1 0 0 0 0 1 0 -1 0 0 0 0"/>'  # turns +Y to +Z, which is up
    path.write_bytes(threemf_package.package(threemf_package.model(mesh, item)))


FORMATS = {
    "little.ply": write_ply,
    "big.ply": lambda *a: write_ply(*a, order=">"),
    "text.ply": lambda *a: write_ply(*a, order=""),
    "binary.stl": write_stl,
    "text.stl": write_text_stl,
    "plain.obj": write_obj,
    "metres.3mf": write_3mf,
}


class Scratch(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="meshes")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class OneModel(Scratch):
    def setUp(self):
        super().setUp()
        model = bumpy_ball()
        write_gltf(self.folder / "ball.gltf", *model)
        for name, write in FORMATS.items():
            write(self.folder / name, *model)

    def arrays(self, name, verb, *words):
        out = self.folder / "out.npz"
        peeler(verb, self.folder / name, "-o", out, "--quiet", *words)
        return dict(numpy.load(out))

    def assert_same(self, *words):
        whole = self.arrays("ball.gltf", *words)
        self.assertGreater(whole["ray_splits"][-1], 1000)
        for name in FORMATS:
            arrays = self.arrays(name, *words)
            self.assertEqual(arrays.keys(), whole.keys(), name)
            for key, array in whole.items():
                if key == "output_hash":  # the hash depends on the file
                    continue
                self.assertEqual(array.tobytes(), arrays[key].tobytes(), f"{name}: {key}")

    def test_layers_depths_and_ids(self):
        self.assert_same("render", "--as", "arrays", "--size", "160x90", "--channels", "id,geometric-normal,facing")

    def test_hits(self):
        self.assert_same("rays", "--directions", "3", "--resolution", "64")

    def test_parity(self):
        for name in ("ball.gltf", *FORMATS):
            report = json.loads(
                peeler("rays", self.folder / name, "--parity", "fail", "--directions", "3", "--resolution", "64",
                       "--json", "--quiet").stdout
            )
            self.assertTrue(report["parity"]["holds"], name)
            self.assertEqual([s["openEdges"] for s in report["parity"]["solids"]], [0], name)

    def test_ids_are_the_triangles_of_the_file(self):
        vertices, triangles = bumpy_ball()
        hits = self.arrays("binary.stl", "rays", "--direction", "0.3,-1,0.2", "--resolution", "64", "--no-refine")
        self.assertGreater(len(numpy.unique(hits["primitive_ids"])), 500)
        corners = vertices[triangles[hits["primitive_ids"]]].astype(float)
        normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= numpy.linalg.norm(normals, axis=1, keepdims=True)
        self.assertLess(numpy.abs(normals - hits["primitive_normals"]).max(), 1e-5)

    def test_checks(self):
        stl, mf3 = (json.loads(peeler("check", self.folder / name, "--json", "--quiet").stdout)
                    for name in ("binary.stl", "metres.3mf"))
        for report in (stl, mf3):
            for key in ("input", "format", "up", "metresPerUnit", "peakMemory", "milliseconds"):
                report.pop(key, None)
        self.assertTrue(stl["parts"][0]["closed"])
        self.assertEqual(stl, mf3)

    def test_axes_and_units(self):
        bounds = info(self.folder / "binary.stl")["bounds"]
        turned = info(self.folder / "binary.stl", "--up", "z", "--unit", "mm")
        self.assertEqual(
            [turned["format"], turned["up"], turned["metresPerUnit"]], ["STL", "z", 0.001]
        )
        low, high = (numpy.array(bounds[side]) for side in ("min", "max"))
        numpy.testing.assert_allclose(turned["bounds"]["min"], numpy.array([low[0], low[2], -high[1]]) / 1000)
        numpy.testing.assert_allclose(turned["bounds"]["max"], numpy.array([high[0], high[2], -low[1]]) / 1000)
        said = peeler("rays", self.folder / "ball.gltf", "--directions", "1", "--resolution", "8", "--up", "z",
                      "--parity", "report", "--quiet").stderr.decode()
        self.assertIn("are for PLY, STL and OBJ", said)

    def test_baked_into_a_glb(self):
        baked = self.folder / "baked.glb"
        peeler("bake", self.folder / "binary.stl", "-o", baked, "--directions", "8", "--resolution", "64", "--quiet")
        vertices, triangles = bumpy_ball()
        self.assertEqual(info(baked)["triangles"], len(triangles))
        text = baked.read_bytes()
        gltf = json.loads(text[20 : 20 + struct.unpack("<I", text[12:16])[0]])
        primitive = gltf["meshes"][0]["primitives"][0]
        self.assertEqual(gltf["accessors"][primitive["attributes"]["_AO"]]["count"], len(vertices))

    def test_smooth_normals(self):
        flat = self.arrays("binary.stl", "rays", "--direction", "0,0,1", "--resolution", "32")
        smooth = self.arrays("binary.stl", "rays", "--direction", "0,0,1", "--resolution", "32", "--smooth-normals", "90")
        numpy.testing.assert_array_equal(flat["primitive_normals"], smooth["primitive_normals"])
        numpy.testing.assert_array_equal(flat["primitive_ids"], smooth["primitive_ids"])
        turned = (flat["normals"] * smooth["normals"]).sum(1)
        self.assertGreater(turned.min(), 0.8)
        self.assertLess(turned.min(), 0.9999)


class Points(Scratch):
    def test_of_extract_are_read_back(self):
        scene = self.folder / "ball.gltf"
        write_gltf(scene, *bumpy_ball())
        layers, points = self.folder / "out.exr", self.folder / "points.ply"
        peeler("render", scene, "-o", layers, "--size", "64x36", "--quiet")
        count = json.loads(peeler("extract", layers, "--points", points, "--json", "--quiet").stdout)["fragments"]
        cloud = info(points)
        self.assertEqual((cloud["points"], cloud["triangles"]), (count, 0))
        peeler("render", points, "-o", self.folder / "cloud.png", "--size", "64x36", "--quiet")
        if HAS_OPEN3D:
            import open3d

            self.assertEqual(len(open3d.io.read_point_cloud(str(points)).points), count)


class OtherPrograms(Scratch):
    """Compares the numbers of vertices and faces in files from other programs."""

    def counts(self, path):
        out = self.folder / "hits.npz"
        found = info(path)
        peeler("rays", path, "-o", out, "--direction", "0,-1,0", "--resolution", "32", "--quiet")
        return found["triangles"], found["bounds"], len(numpy.load(out)["t_hit"])

    def test_meshio(self):
        if not HAS_MESHIO:
            self.skipTest("no meshio for this Python (Debian's python3-meshio)")
        import meshio

        vertices, triangles = bumpy_ball()
        mesh = meshio.Mesh(vertices, [("triangle", triangles.astype(numpy.int32))])
        write_gltf(self.folder / "ball.gltf", vertices, triangles)
        whole = self.counts(self.folder / "ball.gltf")
        for name, options in {
            "a.ply": {"binary": True},
            "b.ply": {"binary": False},
            "a.stl": {"binary": True},
            "b.stl": {"binary": False},
            "a.obj": {},
        }.items():
            path = self.folder / name
            meshio.write(path, mesh, **options)
            again = meshio.read(path)
            self.assertEqual(sum(len(c.data) for c in again.cells), whole[0], name)
            found = self.counts(path)
            self.assertEqual(found[0], whole[0], name)
            self.assertEqual(found[2], whole[2], name)
            numpy.testing.assert_allclose(found[1]["max"], whole[1]["max"], rtol=1e-6)

    def test_quads_of_meshio(self):
        if not HAS_MESHIO:
            self.skipTest("no meshio for this Python (Debian's python3-meshio)")
        import meshio

        points = [(float(x), float(y), 0.0) for y in range(4) for x in range(5)]
        quads = [(5 * y + x, 5 * y + x + 1, 5 * y + x + 6, 5 * y + x + 5) for y in range(3) for x in range(4)]
        for name in ("quads.ply", "quads.obj"):
            meshio.write(self.folder / name, meshio.Mesh(points, [("quad", quads)]))
            self.assertEqual(info(self.folder / name)["triangles"], 2 * len(quads), name)

    def test_assimp(self):
        if not ASSIMP:
            self.skipTest("no assimp in PATH (Debian's assimp-utils)")
        vertices, triangles = bumpy_ball()
        source = self.folder / "ball.obj"
        write_obj(source, vertices, triangles)
        for name, form in {"c.ply": "ply", "d.ply": "plyb", "c.stl": "stl", "d.stl": "stlb", "c.obj": "obj"}.items():
            path = self.folder / name
            ran = subprocess.run([ASSIMP, "export", source, path, f"-f{form}"], capture_output=True, check=False)
            if ran.returncode != 0 or not path.is_file():
                print(f"assimp writes no {form}: {ran.stdout.decode().strip().splitlines()[-1:]}")
                continue
            self.assertEqual(info(path)["triangles"], len(triangles), name)


    def test_open3d(self):
        if not HAS_OPEN3D:
            self.skipTest("no Open3D for this Python (Debian's python3-open3d)")
        import open3d

        vertices, triangles = bumpy_ball()
        write_gltf(self.folder / "ball.gltf", vertices, triangles)
        whole = self.counts(self.folder / "ball.gltf")
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(vertices.astype(numpy.float64)),
            open3d.utility.Vector3iVector(triangles.astype(numpy.int32)),
        )
        mesh.compute_vertex_normals()  # the STL writer of Open3D needs normals
        mesh.paint_uniform_color([1, 0.5, 0])
        for name, text in {"e.ply": False, "f.ply": True, "e.stl": False, "e.obj": False}.items():
            path = self.folder / name
            self.assertTrue(open3d.io.write_triangle_mesh(str(path), mesh, write_ascii=text), name)
            found = self.counts(path)
            again = open3d.io.read_triangle_mesh(str(path))
            self.assertEqual(found[0], len(again.triangles), name)
            # Text files have six digits; binary files keep every bit.
            if name in ("e.ply", "e.stl"):
                self.assertEqual(found[1:], whole[1:], name)

        scan = open3d.geometry.PointCloud(mesh.vertices)
        open3d.io.write_point_cloud(str(self.folder / "scan.ply"), scan)
        self.assertEqual(info(self.folder / "scan.ply")["points"], len(vertices))

    def test_meshlab(self):
        if not all(MESHLAB):
            self.skipTest("no meshlabserver or xvfb-run in PATH (Debian's meshlab, xvfb and xauth)")
        vertices, triangles = bumpy_ball()
        write_ply(self.folder / "ball.ply", vertices, triangles, "<")
        for form in ("ply", "stl", "obj"):
            path = self.folder / f"m.{form}"
            ran = subprocess.run(
                [*MESHLAB, "-i", self.folder / "ball.ply", "-o", path], capture_output=True, check=False, timeout=120
            )
            said = ran.stdout.decode(errors="replace")
            self.assertTrue(path.is_file(), said + ran.stderr.decode(errors="replace"))
            self.assertIn(f"({len(vertices)} vn {len(triangles)} fn)", said)
            self.assertEqual(info(path)["triangles"], len(triangles), form)


class Materials(Scratch):
    def test_of_an_obj(self):
        (self.folder / "m.mtl").write_text(
            "newmtl red\nKd 1 0 0\nd 0.5\nNs 30\nnewmtl metal\nKd 0.8 0.8 0.8\nPm 1\nPr 0.25\nKe 0 2 0\n",
            encoding="utf-8",
        )
        (self.folder / "m.obj").write_text(
            "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\no A\nusemtl red\nf 1 2 3 4\n"
            "g left\nusemtl metal\nf -4 -3 -2\no B\nf 1 3 4\nusemtl none\nf 1 2 4\nl 1 3\np 1 2\n",
            encoding="utf-8",
        )
        found = info(self.folder / "m.obj")
        self.assertEqual([n["name"] for n in found["nodes"]], ["A", "left", "B"])
        self.assertEqual([n["triangles"] for n in found["nodes"]], [2, 1, 2])
        self.assertEqual([found["triangles"], found["lines"], found["points"]], [5, 1, 2])
        self.assertEqual(found["nodes"][0]["children"], [1])
        self.assertEqual(found["materials"], {"OPAQUE": 2, "MASK": 0, "BLEND": 1})
        self.assertEqual(len([w for w in found["warnings"] if '"none" is missing' in w]), 1)


if __name__ == "__main__":
    unittest.main()
