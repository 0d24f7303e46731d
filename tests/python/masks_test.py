# SPDX-License-Identifier: Apache-2.0
"""Tests that the readers and procedures of bop_toolkit get the same results from our masks as from one render per
object."""

import glob
import json
import os
import pathlib
import sys
import unittest

from module import ALL, SCENES, SOURCE, ModuleTest, np, peeler, scene

CLIENT = SOURCE.parent / "shared" / "clients" / "bop_toolkit"
if not CLIENT.is_dir():
    print(f"skipped: no {CLIENT}")
    sys.exit(77)
sys.path.insert(0, str(CLIENT))
try:
    import imageio

    try:
        import imageio.v2
    except ImportError:  # the version in Debian 12 has it under an older name
        sys.modules["imageio.v2"] = imageio
    from bop_toolkit_lib import inout, misc, visibility
except ImportError as missing:
    print(f"skipped: {missing}; Debian has it: python3-imageio python3-png python3-scipy python3-opencv")
    sys.exit(77)

WIDTH, HEIGHT = 120, 90
MODELS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets") / "gltf-sample-assets"
# Whole models, with their numbers of objects.
WHOLE_MODELS = (
    ("GearboxAssy/glTF-Draco/GearboxAssy.gltf", 95),
    ("2CylinderEngine/glTF/2CylinderEngine.gltf", 67),
    ("StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp.gltf", 8),
    ("NegativeScaleTest/glTF-Binary/NegativeScaleTest.glb", 11),
)


def first_layer(image):
    """Returns the Z of the nearest fragments, and 0 for empty pixels, as in BOP's depth pictures."""
    counts = np.diff(image.splits.astype(np.int64))
    z = np.zeros(counts.size, np.float32)
    z[counts > 0] = image.z[image.splits[:-1][counts > 0]]
    return z.reshape(image.shape)


def decoded(rle):
    """Decodes a mask as pycoco_utils.rle_to_binary_mask of bop_toolkit does; that module needs packages that Debian
    lacks."""
    flat = np.zeros(np.prod(rle["size"]), dtype=bool)
    ends = np.cumsum(rle["counts"])
    for begin, end in zip(ends[0::2], ends[1::2]):
        flat[begin:end] = True
    return flat.reshape(*rle["size"], order="F")


class Masks(ModuleTest):
    def masks(self, name, **keywords):
        folder = self.folder / name
        result = peeler.masks(SCENES / f"{name}.glb", output=folder, size=(WIDTH, HEIGHT), **keywords)
        return folder, result

    def compare(self, name, canvas=1):
        """Does the work of scripts/calc_gt_masks.py and calc_gt_info.py, with one render per object instead of their
        renderer."""
        folder, result = self.masks(name, canvas=canvas)
        gt = inout.load_scene_gt(folder / "scene_gt.json")
        info = inout.load_json(folder / "scene_gt_info.json", keys_to_int=True)
        camera = inout.load_scene_camera(folder / "scene_camera.json")
        names = {o["object"]: o["name"] for o in json.loads((folder / "objects.json").read_text())["objects"]}
        coco = json.loads((folder / "coco.json").read_text())
        annotations = {a["category_id"]: a for a in coco["annotations"]}
        K = camera[0]["cam_K"]
        whole = self.r.layers(scene(name), size=(WIDTH, HEIGHT))
        np.testing.assert_allclose(K, whole.K, atol=1e-9)
        np.testing.assert_allclose(camera[0]["cam_R_w2c"], whole.world_to_camera[:3, :3], atol=1e-12)
        np.testing.assert_allclose(
            camera[0]["cam_t_w2c"][:, 0], 1000 * whole.world_to_camera[:3, 3], atol=1e-9
        )
        dist = misc.depth_im_to_dist_im_fast(first_layer(whole), K)
        self.assertEqual(len(gt[0]), len(info[0]))
        self.assertGreater(len(gt[0]), 4)
        hidden = 0
        for gt_id, (entry, told) in enumerate(zip(gt[0], info[0])):
            with self.subTest(names[entry["obj_id"]]):
                alone = self.r.layers(
                    scene(name, include=[names[entry["obj_id"]]]), size=(WIDTH, HEIGHT)
                )
                dist_gt = misc.depth_im_to_dist_im_fast(first_layer(alone), K)
                mask = dist_gt > 0
                visible = visibility.estimate_visib_mask_gt(dist, dist_gt, 0, visib_mode="bop19")
                ours = inout.load_im(folder / "mask" / f"000000_{gt_id:06d}.png")
                self.assertEqual((ours.dtype, ours.shape), (np.uint8, (HEIGHT, WIDTH)))
                self.assert_same(ours, 255 * mask.astype(np.uint8))
                ours = inout.load_im(folder / "mask_visib" / f"000000_{gt_id:06d}.png")
                self.assert_same(ours, 255 * visible.astype(np.uint8))
                self.assertEqual(told["px_count_valid"], int(np.sum(dist[mask] > 0)))
                self.assertEqual(told["px_count_visib"], int(visible.sum()))
                if canvas == 1:
                    self.assertEqual(told["px_count_all"], int(mask.sum()))
                self.assertGreaterEqual(told["px_count_all"], int(mask.sum()))
                if not visible.any():
                    hidden += 1
                    self.assertEqual(told["bbox_obj"], [-1, -1, -1, -1])
                    self.assertNotIn(entry["obj_id"], annotations)
                    continue
                ys, xs = visible.nonzero()
                self.assertEqual(told["bbox_visib"], [int(e) for e in misc.calc_2d_bbox(xs, ys)])
                ys, xs = mask.nonzero()
                if canvas == 1:
                    self.assertEqual(told["bbox_obj"], [int(e) for e in misc.calc_2d_bbox(xs, ys)])
                self.assertAlmostEqual(told["visib_fract"], visible.sum() / told["px_count_all"])
                annotation = annotations[entry["obj_id"]]
                self.assert_same(decoded(annotation["segmentation"]), visible)
                self.assert_same(decoded(annotation["amodal_segmentation"]), mask)
        self.assertEqual(len(result["objects"]), len(gt[0]))
        print(f"{name}: {len(gt[0])} objects, {hidden} of them hidden")

    def test_of_the_toolkit(self):
        self.compare("panes")
        self.compare("glasses", canvas=3)

    def compare_whole(self, path, count):
        """Compares masks with renders of single objects, and visible masks with each other and with the first layer."""
        low, high = peeler.Scene(path).bounds
        size, middle = np.linalg.norm(high - low), (low + high) / 2
        eye = middle + 1.4 * size * np.array([0.5, 0.4, 0.77])
        camera = {"eye": tuple(eye), "target": tuple(middle), "near": 0.1 * size, "size": (320, 240)}

        def covered(**keywords):
            image = self.r.layers(peeler.Scene(path, **keywords), **camera)
            return image.counts.reshape(image.shape) > 0

        folder = self.folder / path.stem
        peeler.masks(path, output=folder, **camera)
        names = {o["object"]: o["name"] for o in json.loads((folder / "objects.json").read_text())["objects"]}
        self.assertEqual((len(names), len(set(names.values()))), (count, count))
        listed = [entry["obj_id"] for entry in inout.load_scene_gt(folder / "scene_gt.json")[0]]
        seen = np.zeros((240, 320), np.uint8)
        for number, name in names.items():
            alone = 255 * covered(include=[glob.escape(name)]).astype(np.uint8)
            if number not in listed:
                self.assertFalse(alone.any(), name)
                continue
            amodal, visible = (inout.load_im(folder / kind / f"000000_{listed.index(number):06d}.png")
                               for kind in ("mask", "mask_visib"))
            self.assert_same(amodal, alone, name)
            self.assertFalse((visible & ~amodal).any(), name)
            seen += visible // 255
        self.assert_same(seen, covered().astype(np.uint8))  # no pixel is in two masks, and none is missing
        print(f"{path.stem}: {len(listed)} of {count} objects, {seen.sum()} pixels")

    @unittest.skipUnless(ALL, "a render an object of whole models: only under PEELER_TEST_ALL")
    @unittest.skipUnless(MODELS.is_dir(), f"no {MODELS}")
    def test_of_whole_models(self):
        for path, count in WHOLE_MODELS:
            with self.subTest(path):
                self.compare_whole(MODELS / path, count)

    def test_one_camera_file(self):
        folder, _ = self.masks("bracket")
        read = inout.load_cam_params(folder / "camera.json")
        self.assertEqual(read["im_size"], (WIDTH, HEIGHT))
        np.testing.assert_array_equal(
            read["K"], inout.load_scene_camera(folder / "scene_camera.json")[0]["cam_K"]
        )


if __name__ == "__main__":
    unittest.main()
