# SPDX-License-Identifier: Apache-2.0
"""Tests the verbs as functions, and compares the stub with the module."""

import ast
import inspect
import json
import os
import pathlib
import re
import unittest

from module import SCENES, ModuleTest, command, np, peeler, scene

STUB = pathlib.Path(peeler.__file__).with_name("__init__.pyi")
# Options of `peeler render` that are not keywords of the picture functions: options for files, the scene, the Renderer,
# sequences and reports.
ELSEWHERE = set(
    "output no_clobber no_mkdir background exposure tone_map as_ no_composite fxaa skip_existing keep_going dry_run layout "
    "dense fill dense_type compress compression deep_merge deep_z_tolerance deep_alpha_tolerance scene include exclude allow_outside ignore_extension "
    "deep_error deep_keep smooth_normals unit variant environment environment_rotation transmission frames chunk fps backend device require_gpu threads memory "
    "json report progress quiet verbose help manifest normalize cameras camera_convention views around seed distance elevation azimuth clockwise first_view "
    "cameras_out preset shard_member shard_size shard_count".split()
)


def options(verb):
    """Returns the keywords for a verb's options."""
    names = re.findall(r"^ +(?:-\w, )?--([a-z][a-z-]*)", command(verb, "--help", "all"), re.MULTILINE)
    return {n.replace("-", "_") + ("_" if n == "as" else "") for n in names}


def stubs():
    """Returns {name or Class.name: node} for all functions of the stub."""
    found = {}
    for node in ast.parse(STUB.read_text(encoding="utf-8")).body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            found[node.name] = node
        if isinstance(node, ast.ClassDef):
            found[node.name] = node
            found |= {f"{node.name}.{n.name}": n for n in node.body if isinstance(n, ast.FunctionDef)}
    return found


def keywords(function):
    return {a.arg for a in function.args.kwonlyargs}


class Stub(ModuleTest):
    def test_it_has_what_there_is(self):
        there = stubs()
        for name in peeler.__all__:
            thing = getattr(peeler, name)
            self.assertIn(name, there)
            if isinstance(thing, type):
                bases = {"Image": "_Picture", "Composite": "_Picture"}
                for member, _ in inspect.getmembers(thing, lambda m: not isinstance(m, type)):
                    own = member.startswith("_") and member != "_repr_png_"
                    if own or (name == "Error" and member in dir(Exception)):
                        continue
                    known = f"{name}.{member}" in there or f"{bases.get(name)}.{member}" in there
                    self.assertTrue(known or name == "Error", f"{name}.{member}")
                    doc = getattr(thing, member).__doc__
                    self.assertTrue(doc or member == "_repr_png_" or name == "Error", f"{name}.{member}: no docstring")
            self.assertTrue(thing.__doc__, name)
        for name in there:
            owner, _, member = name.partition(".")
            if owner == "_Picture":
                owner = "Image"
            self.assertTrue(hasattr(peeler, owner), name)
            self.assertTrue(not member or hasattr(getattr(peeler, owner), member), name)

    def test_keywords_are_the_options(self):
        there = stubs()
        camera = {"K", "world_to_camera", "gltf", "pixel_center", "progress"}
        render = options("render") - ELSEWHERE
        self.assertEqual(keywords(there["Renderer.layers"]), render | camera)
        self.assertEqual(keywords(there["Renderer.composite"]), (render | camera) - {"channels", "cryptomatte"})
        elsewhere = ELSEWHERE | {"points", "double", "map", "attenuation", "part", "range", "no_legend", "legend", "voxels",
                                 "parity", "overlap", "no_refine", "strict"}
        self.assertEqual(keywords(there["Renderer.rays"]) - camera, options("rays") - elsewhere)

    def test_functions_of_verbs(self):
        there = stubs()
        for name in peeler._verbs.NAMES:
            names = {k for k, (n, _) in peeler._options.table(name).items()}
            self.assertEqual(keywords(there[name]), names | {"progress"}, name)
            self.assertEqual(set(inspect.signature(getattr(peeler, name)).parameters), names | {"progress", "files"})

    def test_keywords_of_the_stub_are_taken(self):
        panes, there = scene("panes"), stubs()
        for name, call in (("layers", self.r.layers), ("composite", self.r.composite), ("rays", self.r.rays)):
            for keyword in keywords(there[f"Renderer.{name}"]):
                given = {"size": (8, 8)} if name != "rays" else {"direction": (0, 0, 1), "resolution": 8}
                call(panes, **given | {keyword: given.get(keyword)})
        for keyword in keywords(there["Scene.__init__"]):
            peeler.Scene(SCENES / "panes.glb", **{keyword: None})
        for keyword in keywords(there["_Picture.save"]):
            self.r.layers(panes, size=(8, 8)).save(self.folder / "x.exr", **{keyword: None})


class Verbs(ModuleTest):
    def test_results_are_the_command_lines(self):
        exr = self.folder / "a.exr"
        done = peeler.render(SCENES / "panes.glb", output=exr, size=(64, 36), channels=["id"])
        self.assertEqual((done["width"], done["height"]), (64, 36))
        for name in ("info", "verify"):
            self.assertEqual(getattr(peeler, name)(exr), json.loads(command(name, exr, "--json")))
        self.assertEqual(peeler.info(SCENES / "engine.glb"), json.loads(command("info", SCENES / "engine.glb", "--json")))
        peeler.convert(exr, output=self.folder / "deep.exr", as_="deep")
        self.assertTrue(peeler.compare(exr, self.folder / "deep.exr")["identical"])
        peeler.flatten(exr, output=self.folder / "flat.png", background=(1, 1, 1))
        peeler.extract(exr, npz=self.folder / "a.npz")
        self.assertEqual(len(np.load(self.folder / "a.npz")["z"]), done["fragmentsStored"])
        peeler.rays(SCENES / "panes.glb", output=self.folder / "h.npz", direction=(0, 0, 1), resolution=16)
        baked = peeler.bake(SCENES / "panes.glb", output=self.folder / "b.glb", directions=8, resolution=32)
        self.assertEqual(baked["quantity"], "ao")
        tiles = [self.folder / f"t{i}.exr" for i in (1, 2)]
        for i, tile in enumerate(tiles, 1):
            peeler.render(SCENES / "panes.glb", output=tile, size=(64, 36), tile=f"{i}/2", channels="id")
        peeler.merge(*tiles, output=self.folder / "m.exr")
        self.assertEqual((self.folder / "m.exr").read_bytes(), exr.read_bytes())
        self.assertEqual(peeler.check(SCENES / "bracket.glb")["verdict"], "good")
        self.assertTrue(peeler.devices()["devices"])

    def test_what_is_found_is_returned_and_no_error(self):
        a, b = self.folder / "a.exr", self.folder / "b.exr"
        self.r.layers(scene("panes"), size=(32, 18)).save(a)
        self.r.layers(scene("panes"), size=(32, 18), shading="unlit").save(b)
        self.assertFalse(peeler.compare(a, b)["identical"])
        (self.folder / "bad.exr").write_bytes(a.read_bytes()[:-100])
        self.assertEqual(peeler.verify(self.folder / "bad.exr")["verdict"], "bad")

    def test_errors(self):
        error = self.assert_error("input", peeler.info, "missing.glb")
        self.assertIn("missing.glb", error.where)
        self.assert_error("usage", peeler.render, SCENES / "panes.glb", output="-")
        self.assert_error("usage", peeler.render)
        with self.assertRaisesRegex(TypeError, "did you mean 'output'"):
            peeler.render(SCENES / "panes.glb", outptu="x.exr")
        with self.assertRaises(TypeError):
            peeler.info(SCENES / "panes.glb", json=True)
        self.assertFalse(hasattr(peeler, "batch"))

    def test_the_environment_stays(self):
        os.environ["CUDA_VISIBLE_DEVICES"] = "0"
        self.addCleanup(os.environ.pop, "CUDA_VISIBLE_DEVICES")
        before = dict(os.environ)
        peeler.render(SCENES / "panes.glb", output=self.folder / "a.exr", size=8, threads=1)
        self.assertEqual(os.popen("echo $CUDA_VISIBLE_DEVICES $LP_NUM_THREADS").read().split(),
                         [before[k] for k in ("CUDA_VISIBLE_DEVICES", "LP_NUM_THREADS") if k in before])

    def test_progress(self):
        shares = []
        peeler.render(SCENES / "engine.glb", output=self.folder / "a.exr", size=(400, 300), progress=shares.append)
        self.assertGreater(len(shares), 1)

    def test_help_lists_keywords(self):
        self.assertIn("ortho_height", peeler.render.__doc__)
        self.assertNotIn("--", peeler.render.__doc__)


if __name__ == "__main__":
    unittest.main()
