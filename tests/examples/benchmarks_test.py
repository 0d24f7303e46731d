# SPDX-License-Identifier: Apache-2.0
"""Tests that the benchmark scripts still run, and that tests/benchmarks/RESULTS.md and README.md agree.

Renders small pictures once; the measured values do not matter. Does not run parts that need the benchmarks' own
programs (side by side, baking), except the rows of hits and of data sets if these programs are built.
"""

import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
from unittest import mock

from peeler_command import EXAMPLES, PEELER, SOURCE, PeelerTest, main

BENCHMARKS = SOURCE / "tests" / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))
import against_three  # noqa: E402
import flip  # noqa: E402
import hit_rows  # noqa: E402
import numpy as np  # noqa: E402
import reasons  # noqa: E402
import results  # noqa: E402
import scenes  # noqa: E402
import side_by_side  # noqa: E402
import table  # noqa: E402
import three_scenes  # noqa: E402
import view_rows  # noqa: E402

SCENE = EXAMPLES / "scenes" / "coincident.glb"
REFEREE_RUNS = not subprocess.run(
    ["/usr/bin/python3", "-c", "import numpy, OpenImageIO"], capture_output=True, check=False
).returncode


class Benchmarks(PeelerTest):
    def printed(self, script, *arguments):
        """Returns the text that a script prints."""
        done = subprocess.run(
            ["/usr/bin/python3", "-B", str(BENCHMARKS / script), PEELER, *map(str, arguments)],
            text=True,
            capture_output=True,
            check=False,
        )
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def rows(self, script, *arguments):
        """Returns the rows of the tables that a script prints."""
        return list(results.rows(self.printed(script, *arguments)))

    def test_stage_times(self):
        methods = ("--methods", "a-buffer,two-pass")
        size = ("--size", "64x36", "--runs", 1)
        rows = self.rows("stage_times.py", SCENE, *size, *methods)
        self.assertEqual([row["capture / total, ms"] for row in rows], ["a-buffer", "two-pass"])
        rows = self.rows("stage_times.py", SCENE, SCENE, *size, "--methods", "dual")
        self.assertEqual([row.get("layers") for row in rows], ["6", "6", None])

    def test_file_sizes(self):
        rows = self.rows("file_sizes.py", SCENE, "--size", "32x18", "--runs", 1)
        self.assertEqual(len(rows), 15)
        self.assertEqual({"", "coincident, MB", "coincident, ms"}, rows[0].keys())

    def test_views_from_layers(self):
        row, = self.rows("views_from_layers.py", SCENE, "--size", "64x36", "--angles", 10)
        self.assertTrue(row["0°"].endswith(" / inf"), row)
        self.assertRegex(row["10°"], r"^[\d.]+ / [\d.]+$")

    def test_frames_in_one_process(self):
        render = ("--", "--size", "32x18")
        rows = self.rows("frames_in_one_process.py", SCENE, "--frames", 2, "--runs", 1, *render)
        self.assertEqual([(row["scene"], row["frames"]) for row in rows], [("coincident --size 32x18", "2")])

    def test_jobs_in_one_worker(self):
        rows = self.rows("jobs_in_one_worker.py", SCENE, "--jobs", 4, "--", "--size", "32x18")
        self.assertEqual([row["jobs at a time"] for row in rows], ["1", "2"])

    @unittest.skipUnless(REFEREE_RUNS, "Debian's python3-numpy or python3-openimageio is missing")
    def test_referee(self):
        tiny = ("--size", 12, "--samples", 256, "--height", 32, "--edge", 70)
        text = self.printed("referee.py", *tiny, "--only", "white")
        rows = list(results.rows(text))
        self.assertEqual([row["spheres"] for row in rows], ["white diffuse", "white metal", "white dielectric"])
        self.assertEqual([row[""] for row in rows], ["1", "5", "3"])
        for row in rows:
            for mean in row["mean, ours to the referee's"].split(" to "):
                self.assertAlmostEqual(float(mean), 1, delta=0.05, msg=row)
            self.assertLess(float(row["relative error up to"]), 0.2, row)
        self.assertLess(float(re.search(r"furnace 0.02 \(at most ([\d.]+)\)", text)[1]), 0.02)
        other = self.printed("referee.py", *tiny, "--only", "white diffuse", "--environment-rotation=90")
        self.assertGreater(float(next(results.rows(other))["relative error up to"]), 0.2)
        self.assertRegex(other, r"Missed by: white diffuse \(.*relative error")

    @unittest.skipUnless(REFEREE_RUNS, "Debian's python3-numpy or python3-openimageio is missing")
    def test_referee_in_a_furnace(self):
        """White lobes reflect all light, black lobes less, and clearcoat over black follows its Fresnel term."""
        import referee
        from referee_spheres import balls

        normals = referee.pixel_normals(8)
        normals = normals[normals[..., 2] > 0.5]
        judge = referee.Referee(np.ones((8, 16, 3)), 512)
        shaded = {ball.name: judge.sphere(ball, normals) for ball in balls()}
        for name in ("white diffuse", *(f"white metal {r}" for r in (0.2, 0.3, 0.5, 0.7, 1.0))):
            self.assertLess(np.abs(shaded[name] - 1).max(), 0.005, name)
        self.assertLess(shaded["black dielectric 0.2"].max(), 0.1)
        fresnel = 0.04 + 0.96 * (1 - normals[:, 2:]) ** 5
        self.assertLess(np.abs(shaded["clearcoat 0.2 on black"] - fresnel).max(), 0.002)

    @unittest.skipUnless(REFEREE_RUNS, "Debian's python3-numpy or python3-openimageio is missing")
    def test_referee_says_what_is_missed(self):
        import referee

        theirs = np.ones((4, 3))
        near = {
            "same": referee.nearness(theirs, theirs, theirs),
            "bright": referee.nearness(1.04 * theirs, theirs, None),
            "uneven": referee.nearness(theirs + [[0.2], [-0.2], [0.2], [-0.2]], theirs, None),
            "grey": referee.nearness(theirs, theirs, theirs - [[0], [0.03], [0], [0]]),
            "nothing": referee.nearness(np.nan * theirs, theirs, np.nan * theirs),
        }
        self.assertAlmostEqual(near["bright"].mean, 1.04, 12)
        self.assertAlmostEqual(near["uneven"].error, 0.2, 12)
        self.assertAlmostEqual(near["grey"].furnace, 0.03, 12)
        missed = "bright (mean); uneven (relative error); grey (furnace); nothing (mean, relative error, furnace)."
        self.assertTrue(referee.judgement(near).endswith(f"Missed by: {missed}"), referee.judgement(near))
        self.assertIn("Missed by: none.", referee.judgement({"same": near["same"]}))

    def test_budgets(self):
        rows = self.rows("budgets.py", "--quick")
        self.assertEqual([row["--memory"] for row in rows], ["400M"])


class CannedBench(side_by_side.Bench):
    """A Bench whose programs give canned answers."""

    def __init__(self, folder, answers, **more):
        paths = {name: pathlib.Path(name) for name in (*hit_rows.SOUPS, *hit_rows.MODELS, "2CylinderEngine", "helmet")}
        super().__init__(folder, folder, folder, paths, ["1920x1080"], 1, **more)
        self.answers = answers
        self.asked = []

    def program(self, name, *arguments):
        self.asked.append([name, *map(str, arguments)])
        return self.answers(name, self.asked[-1])


def hits_of(command):
    """Returns canned results with one hit per ray: Embree takes a nanosecond per hit, our program a tenth of that."""
    width, height = map(int, command[command.index("--size") + 1].split("x"))
    rays = width * height * (64 if "--bundles" in command else 1)
    times = {key: [1e-6 * rays * share] for key, share in (
        ("hits", 0.1), ("embree", 1), ("axes", 0.3), ("thickness", 0.12), ("parity", 0.2), ("voxels", 0.3))}
    return {"hits": rays, "axes": 3 * rays, "rays": rays, "cells": rays, "occupied": 1, "processor": times,
            "milliseconds": times, "resident": 8 * rays,
            "embree": {"hits": rays, "triangles": 12, "build": [1]}}


class HitRows(PeelerTest):
    """Tests the table rows on CPU hits."""

    NAMES = ("benchmark_hit_engine", "bake_ao")
    BUILT = all((pathlib.Path(PEELER).parent / "tests" / name).is_file() for name in NAMES)

    def test_the_slope_is_the_power(self):
        self.assertAlmostEqual(side_by_side.exponent([(x, 3 * x**1.5) for x in (1, 2, 8, 64)]), 1.5, 12)

    def test_a_row_that_fails_is_not_met(self):
        row = side_by_side.Row("what", "scene", "size", "rival", [1], [2], 0.6)
        self.assertTrue(row.met)
        row.fails = "the error is too large"
        self.assertFalse(row.met)
        self.assertEqual(row.record()["fails"], row.fails)

    def test_rows_of_what_programs_say(self):
        with tempfile.TemporaryDirectory() as scratch:
            bench = CannedBench(pathlib.Path(scratch), lambda _, command: hits_of(command))
            rows = {kind: list(hit_rows.KINDS[kind](bench)) for kind in ("bundle", "bundles", "maps")}
        for row in (*rows["bundle"], *rows["bundles"]):
            self.assertAlmostEqual(row.ratio, 0.1, 12)
            self.assertTrue(row.met)
        self.assertEqual({row.scene: row.target for row in rows["bundle"]}["soup-640k"], 0.5)
        self.assertEqual(len(rows["bundle"]), 8)
        self.assertEqual([row.size for row in rows["bundles"]], ["resolution 512", "resolution 1024", "resolution 1024"])
        # The canned time is 1.2 times that of the hits for thickness, and 2 times for parity. The limit is 1.3.
        self.assertEqual([row.met for row in rows["maps"]], 2 * [True, False, True])
        for row in sum(rows.values(), []):
            self.assertTrue(row.ours_alone, row.what)
            self.assertTrue(row.what.endswith("processor time"), row.what)

    def test_what_grows_as_hits_do(self):
        with tempfile.TemporaryDirectory() as scratch:
            bench = CannedBench(pathlib.Path(scratch), lambda _, command: hits_of(command), shrink=64)
            rows = hit_rows.growth(bench)
            of_rays = [next(rows), next(rows)]
        for row in of_rays:
            self.assertAlmostEqual(row.ratio, 1, 9)
            self.assertTrue(row.met)
        self.assertEqual(len(bench.asked), 2 * len(scenes.SOUPS))  # first for times, then for memory

    def test_occlusion_has_to_be_as_good(self):
        def answers(ours):
            return lambda *_: [{"receivers": 7, "errors": {"peeler": ours, "embree": 0.001, "raised": 0},
                                "seconds": {"peeler": [0.3], "embree": [1]}}]

        for error, met in ((0.0029, True), (0.0031, False)):
            bench = CannedBench(pathlib.Path(), answers(error))
            rows = list(hit_rows.baking(bench))
            self.assertEqual([row.met for row in rows], [met, met])
            for row in rows:
                self.assertIn(f"error {error:.4f}, Embree's 0.0010", row.note)
                self.assertEqual("not met" in row.note, not met)
        self.assertIn("--texels", bench.asked[1])

    @unittest.skipUnless(BUILT, "benchmark_hit_engine and bake_ao are not built (target benchmarks)")
    def test_rows_of_tiny_pictures(self):
        """Runs the real programs, with the commands of the table."""
        with tempfile.TemporaryDirectory() as scratch:
            told = pathlib.Path(scratch) / "rows.json"
            done = subprocess.run(
                ["/usr/bin/python3", "-B", str(BENCHMARKS / "table.py"), "--build", str(pathlib.Path(PEELER).parent),
                 "--rows", ",".join(hit_rows.KINDS), "--scenes", "soup-192k,2CylinderEngine", "--runs", "1",
                 "--shrink", "64", "--json", str(told)],
                text=True, capture_output=True, check=False,
            )
            self.assertEqual(done.returncode, 0, done.stderr)
            told = json.loads(told.read_text())
        self.assertFalse([why for why in told["skipped"] if why.startswith("the rest of")], told["skipped"])
        rows = [row for row in told["rows"] if not row["scene"].startswith("soup-192k, ")]  # other rows are of lenses
        self.assertGreater(len(told["rows"]), len(rows))
        maps = [f"{what} of soup-192k" for what in ("thickness", "parity", "voxels")]
        self.assertEqual([row["scene"] for row in rows[:6]], 3 * ["soup-192k"] + maps)
        self.assertEqual([row["what"] for row in rows[6:10]], 4 * ["exponent over hits"])
        self.assertEqual(len(list(results.rows(done.stdout))), len(told["rows"]))
        for row in told["rows"]:
            if row["what"].startswith("exponent"):
                self.assertTrue(math.isfinite(row["ratio"]), row)  # with hardly any hits, the ratio may be anything
            else:
                self.assertGreater(row["ratio"], 0, row)


class ViewRows(PeelerTest):
    """Tests the table rows on many views, data sets and masks, with small scenes instead of the models."""

    BUILD = pathlib.Path(PEELER).parent

    def rows(self, kind, scene):
        with tempfile.TemporaryDirectory() as scratch:
            scratch = pathlib.Path(scratch)
            bench = side_by_side.Bench(self.BUILD, scratch, scratch, {"gearbox": scene}, ["1920x1080"], 1, shrink=16)
            rows = list(view_rows.KINDS[kind](bench))
        self.assertEqual(bench.skipped, [])
        for row in rows:
            self.assertGreater(row.ratio, 0, row)
        return rows

    def test_views(self):
        stages, each = self.rows("views", SCENE)
        self.assertEqual((stages.size, stages.target, each.target), ("32x32, 6 views", 1.15, None))
        self.assertEqual(stages.ours, each.ours)
        self.assertRegex(stages.note, r"ms first, \d+ ms for all others together")
        self.assertEqual(each.note, "of 6 of the views")

    def test_masks(self):
        row, = self.rows("masks", SCENE)
        self.assertRegex(row.rival, "^[1-9][0-9]* renders, an object each")
        self.assertRegex(row.note, "^count, capture and sort: [0-9]+ ms; of the renders [0-9]+ ms$")

    @unittest.skipUnless((BUILD / "tests" / "benchmark_embree_views").is_file(),
                         "benchmark_embree_views is not built (target benchmarks)")
    def test_data_sets(self):
        """Embree gets the same task, so both programs find equally many layers in nearly all pixels."""
        with mock.patch("view_rows.models", lambda: {"bracket": EXAMPLES / "scenes" / "bracket.glb"}):
            rows = self.rows("datasets", SCENE)
        self.assertEqual([row.scene for row in rows], 2 * ["bracket"] + 2 * ["all 1 models"])
        self.assertGreater(float(rows[0].details["alike"].rstrip("%")), 98)
        for row in rows[2:]:
            self.assertRegex(row.details["alike"], "^objects a minute: [0-9.]+, [0-9.]+, Embree [0-9.]+$")

    def test_models(self):
        """Chooses models that are large enough; of each model, the form with the fewest required extensions."""
        lines = ["path\ttriangles_in_default_scene\textensionsRequired"]
        lines += [f"{path}\t{triangles}\t{needed}" for path, triangles, needed in (
            ("gltf-sample-assets/Duck/glTF-Draco/Duck.gltf", 4212, "KHR_draco_mesh_compression"),
            ("gltf-sample-assets/Duck/glTF/Duck.gltf", 4212, ""),
            ("gltf-sample-assets/Box/glTF/Box.gltf", 12, ""),
            ("gltf-asset-generator/Large/Large.gltf", 1000, ""))]
        with tempfile.TemporaryDirectory() as folder, mock.patch("view_rows.ASSETS", pathlib.Path(folder)):
            self.assertEqual(view_rows.models(), {})
            (pathlib.Path(folder) / "MODELS.tsv").write_text("\n".join(lines) + "\n")
            self.assertEqual(view_rows.models(), {"Duck": pathlib.Path(folder) / "gltf-sample-assets/Duck/glTF/Duck.gltf"})


def patterns():
    """Returns a picture of bands and blocks, and a copy with a darker block, a shift and a red corner."""
    y, x = np.mgrid[0:48, 0:64] / 16
    a = np.stack([0.5 + 0.5 * np.sin(3 * x), 0.5 + 0.4 * np.cos(2 * y + x), (x + y) % 1], axis=-1)
    b = a.copy()
    b[10:20, 12:40] *= 0.7
    b[..., 0] = np.roll(b[..., 0], 2, axis=1)
    b[30:, 50:] = (1, 0, 0)
    return a, b


class Flip(PeelerTest):
    def test_is_that_of_its_authors(self):
        """For these pictures, the mean of the authors' own program (FLIP.h, in C++) is 0.3634523."""
        error = flip.flip(*patterns())
        self.assertAlmostEqual(error.mean(), 0.3634523, 5)
        self.assertAlmostEqual(flip.PIXELS_PER_DEGREE, 67.0206, 4)

    def test_its_ends(self):
        a, b = patterns()
        self.assertEqual(flip.flip(a, a).max(), 0)
        green, blue = (np.zeros((32, 32, 3)) + color for color in ((0, 1, 0), (0, 0, 1)))
        self.assertAlmostEqual(flip.flip(green, blue).min(), 1, 6)
        self.assertLessEqual(flip.flip(a, 1 - b).max(), 1)

    def test_takes_either_for_the_reference(self):
        a, b = patterns()
        self.assertLess(np.abs(flip.flip(a, b) - flip.flip(b, a)).max(), 1e-12)

    def test_who_stands_back_sees_less(self):
        grey = np.full((64, 64, 3), 0.5)
        checked = grey + 0.2 * ((np.indices((64, 64)).sum(axis=0) % 2)[..., None] - 0.5)
        near, far = (flip.flip(grey, checked, ppd).mean() for ppd in (10, 67))
        self.assertLess(far, 0.5 * near)


class AgainstThree(PeelerTest):
    def test_compared(self):
        """The pictures are half covered; ours is a tenth too bright there."""
        theirs = np.zeros((16, 16, 4))
        theirs[:8] = (0.5, 0.5, 0.5, 1)
        ours = theirs * (1.1, 1.1, 1.1, 1)
        measured = against_three.compared(ours, theirs)
        self.assertAlmostEqual(measured.psnr, -20 * np.log10(0.05), 6)
        self.assertAlmostEqual(measured.luminance, 1.1, 6)
        self.assertGreater(measured.flip, 0)
        # Values above the maximum of a screen differ in luminance but look the same.
        bright = against_three.compared(4 * theirs, 8 * theirs)
        self.assertEqual((bright.psnr, bright.flip, bright.luminance), (np.inf, 0, 0.5))
        self.assertEqual(against_three.compared(theirs, theirs).psnr, np.inf)

    def test_sample_positions(self):
        """Checks the positions that make three.js take the same four samples per pixel as peeler."""
        self.assertEqual(against_three.sample_positions(1), [(0.5, 0.5)])
        positions = against_three.sample_positions(4)
        self.assertEqual(positions, [(0.125, 0.375), (0.375, 0.875), (0.625, 0.125), (0.875, 0.625)])

    def test_our_part(self):
        """Our scenes render, and the environments have their documented properties."""
        image = three_scenes.studio(64, 32)
        self.assertEqual((image.shape, image.dtype), ((32, 64, 3), np.float32))
        self.assertGreater(image.max(), 10 * image.min())
        self.assertLess(image[-1].max(), 0.3)  # the floor is at the bottom
        with tempfile.TemporaryDirectory() as scratch:
            folder = pathlib.Path(scratch)
            bench = against_three.Bench(PEELER, folder, 32, 2, None)
            against_three.save(folder / "white.exr", np.ones((4, 8, 3)))
            path = folder / "ball.glb"
            made = three_scenes.MADE["furnace: dielectric, roughness 0.5"]
            path.write_bytes(made.scene().bytes())
            ours, view = bench.ours(against_three.Scene("ball", path, made.environment))
        self.assertEqual((ours.shape, view["width"], view["height"]), ((32, 32, 4), 32, 32))
        self.assertLess(np.abs(ours[16, 16] - 1).max(), 0.03)
        self.assertEqual(ours[0, 0, 3], 0)
        for made in three_scenes.MADE.values():
            self.assertIn(made.environment, three_scenes.ENVIRONMENTS)
            self.assertEqual(made.scene().bytes()[:4], b"glTF")

    def test_what_is_far_apart_is_listed(self):
        decibels = {"ToyCar": 21.04, "Duck": 29.9, "Fox": 30.0, "GlassVaseFlowers": 25.0, "metal, roughness 1": 7.0}
        text = against_three.reasons({name: against_three.Measured(psnr, 0, 1) for name, psnr in decibels.items()})
        self.assertEqual(
            text.splitlines()[3:],
            [
                "- **Glass.** ToyCar; GlassVaseFlowers.",
                "- **Not looked into.** Duck; metal, roughness 1.",
            ],
        )
        self.assertIn("Nothing is below 30 dB", against_three.reasons({"Fox": against_three.Measured(np.inf, 0, 1)}))

    def test_what_hardly_differs_has_ranges(self):
        measured = against_three.Measured
        text = against_three.table({"a": measured(30.0, 0.2, 1.1), "b": measured(50.0, 0.1, 0.9), "c": measured(40.0, 0, 1)})
        self.assertEqual([row["scene"] for row in results.rows(text)], ["a"])
        self.assertTrue(text.endswith("have 40.0 to 50.0 dB, FLIP up to 0.100, luminance 0.900 to 1.000."), text)

    def test_reasons(self):
        """Every reason belongs to an existing row, and appears in the guide."""
        names = {*three_scenes.MADE, *(model.split("/")[0] for model in three_scenes.MODELS)}
        self.assertLessEqual(reasons.THREE.keys(), names)
        guide = (SOURCE / "examples/guide/light.md").read_text(encoding="utf-8")
        section = guide.split("## Beside three.js")[1].split("\n## ")[0]
        for reason in reasons.THREE.values():
            self.assertIn(f"**{reason}", section)
        self.assertEqual(len(names), len(three_scenes.MADE) + len(three_scenes.MODELS))


class Results(PeelerTest):
    TEXT = results.RESULTS.read_text(encoding="utf-8")

    def test_sections(self):
        sections = results.split(self.TEXT)
        self.assertEqual(list(sections), list(results.SECTIONS))
        self.assertEqual(results.joined(sections), self.TEXT)
        for name, text in sections.items():
            for fact in ("commit", "machine", "renderer"):
                self.assertIn(f"\n- {fact}: ", text, name)
            self.assertGreater(len(list(results.rows(text))), 0, name)

    def test_tables_of_comparisons(self):
        """Three scenes of one kind of work get their own table, which parses like a comparison in the common table."""
        rows = [side_by_side.Row("draw", name, "9x9", "them, twice", [7], [2], 0.5) for name in "abc"]
        rows += [side_by_side.Row("draw", "a", size, "others", [7], [9], 1) for size in ("9x9", "7x7")]
        rows.append(side_by_side.Row("write", "d", "8x8", "them", [1], [2], 1, "MB"))
        text = table.tables(rows)
        self.assertIn("| draw; 9x9 | ours, ms | them, twice, ms | ratio ≤ 0.5 | others, ms | ratio ≤ 1 |", text)
        self.assertIn("| a | 7.00 | 2.00 | **3.50** | 9.00 | 0.78 |", text)
        self.assertIn("| a, 7x7 | 7.00 |  |  | 9.00 | 0.78 |", text)
        self.assertIn("| write | d, 8x8 | 1.00 MB | 2.00 MB (them) | 0.50 (≤ 1) |", text)
        found = [(row["scene"], row["size"], row["theirs"]) for row in results.comparisons(text)]
        self.assertEqual(found, [
            ("a", "9x9", "2.00 ms (them, twice)"), ("a", "9x9", "9.00 ms (others)"), ("b", "9x9", "2.00 ms (them, twice)"),
            ("c", "9x9", "2.00 ms (them, twice)"), ("a", "7x7", "9.00 ms (others)"), ("d", "8x8", "2.00 MB (them)")])

    def test_a_table_without_targets_has_no_ratios(self):
        rows = [side_by_side.Row("see", name, "9x9", "them", [7], [2], None, mine="us", details={"alike": name}) for name in "abc"]
        self.assertIn("| see; 9x9 | us, ms | them, ms | alike |", table.tables(rows))
        powers = [side_by_side.Row("grow", name, "9x9", "", [0.9], [1], 1, "", mine="from 8") for name in "abc"]
        self.assertIn("| grow; 9x9 | from 8 ≤ 1 |\n| --- | ---: |\n| a | 0.90 |", table.tables(powers))

    def test_a_gpu_page_is_condensed(self):
        lines = ["- a, x: 1 same, 2 other", "- a, y: 3 same, 4 other", "- b, of 1: alike", "- b, of 2: alike", "- c, z: 5 same, 6 other",
                 "- d, up to 2, ms: 1 gpu, 2 cpu", "- d, up to 4, ms: 3 gpu, 4 cpu"]
        expected = ["| a | same | other |", "| --- | ---: | ---: |", "| x | 1 | 2 |", "| y | 3 | 4 |", "", "- b, of {1, 2}: alike",
                    "- c, z: 5 same, 6 other", "", "| d: up to …, ms | gpu | cpu |", "| --- | ---: | ---: |", "| 2 | 1 | 2 |",
                    "| 4 | 3 | 4 |"]
        self.assertEqual(results.condensed(["", *lines]).strip().splitlines(), expected)

    def test_similar_rows_of_a_gpu_page_become_one(self):
        lines = [f"- a, {name}: {k} same, {2 if name == 'f' else 0} beyond" for k, name in enumerate("abcdefgh")]
        shown = results.condensed(["", *lines]).strip().splitlines()
        self.assertEqual(shown[2:], ["| f | 5 | 2 |", "| a, b, c, d, e, g, h | 0 to 7 | 0 |"])

    def test_parts_of_a_gpu_page_are_listed(self):
        page = ["| part | passed | failed | skipped | s |", "| --- | ---: | ---: | ---: | ---: |", "| a | 2 | 0 | 1 | 7 |", "", "**failed**"]
        self.assertEqual(results.parts(page), ["**parts**", "", "- a: 2 passed, 1 skipped", "", "**failed**"])

    def test_facts_are_said_once(self):
        """Facts of most sections are in the head, and those of other sections in the first of these."""
        def section(name, machine):
            facts = {"commit": f"of {name}", "machine": machine, "renderer": "good", "versions": "1"}
            return results.written(name, facts, "| scene |\n| --- |\n| a |\n")

        machines = {"hits": "fast", "stages": "slow", "files": "slow", "views": "fast", "frames": "fast"}
        sections = {name: section(name, machine) for name, machine in machines.items()}
        text = results.joined(sections)
        self.assertEqual(re.findall("^- machine: (.*)$", text, re.M), ["fast", "slow", "as in Stages"])
        self.assertEqual(text.count("- renderer: good"), 1)
        self.assertEqual(results.split(text), sections)

    def test_a_section_takes_its_place(self):
        known = {"commit": "abc", "machine": "fast", "renderer": "good", "versions": "new"}
        new = results.written("views", known, "| scene |\n| --- |\n| new |\n")
        sections = results.split(results.joined({**results.split(self.TEXT), "views": new}))
        self.assertEqual(list(sections), list(results.SECTIONS))
        self.assertEqual(sections["views"], new)
        self.assertEqual([row["scene"] for row in results.rows(sections["views"])], ["new"])

    def test_numbers(self):
        """Different results change the table, and results that lack a required row are an error."""
        readme = (SOURCE / "README.md").read_text(encoding="utf-8")
        self.assertEqual(results.with_numbers(readme, self.TEXT), readme)
        row = "| spheres | "
        other = self.TEXT.replace(row, row + "9")
        self.assertNotEqual(results.with_numbers(readme, other), readme)
        gone = self.TEXT.replace("| capture; 1920x1080 |", "| cubes; 1920x1080 |")
        self.assertRaises(LookupError, results.with_numbers, readme, gone)


if __name__ == "__main__":
    sys.exit(main())
