# SPDX-License-Identifier: Apache-2.0
"""Compares the reference (reference.py) with gsplat's own PyTorch functions: projected means, inverse covariances,
compensation of antialiased training, depths along rays, harmonics. $PEELER_GSPLAT is a checkout of
nerfstudio-project/gsplat."""

import importlib
import os
import pathlib
import sys
import types
import unittest
import unittest.mock

import numpy as np
import reference
from clouds import joined, look, random_cloud, skip

SAME = 1e-9  # both compute in double precision; relative where values exceed 1


def functions(folder):
    """Returns two modules of gsplat's functions. Replaces modules that compile CUDA."""
    for name in ("gsplat", "gsplat.cuda"):
        module = types.ModuleType(name)
        module.__path__ = [str(folder.joinpath(*name.split(".")))]
        sys.modules[name] = module
    for name in ("_wrapper", "_torch_cameras"):
        sys.modules[f"gsplat.cuda.{name}"] = unittest.mock.MagicMock()
    return [importlib.import_module(f"gsplat.cuda.{name}") for name in ("_torch_impl", "_torch_impl_eval3d")]


class Gsplat(unittest.TestCase):
    def expect_same(self, what, ours, theirs):
        theirs = theirs.numpy()
        self.assertEqual(ours.shape, theirs.shape)
        apart = (np.abs(ours - theirs) / np.maximum(np.abs(theirs), 1)).max()
        print(f"{what}: {ours.size} values differ by at most {apart:.1e}")
        self.assertLess(apart, SAME, what)

    def check(self, camera, model):
        random = np.random.default_rng(11)
        cloud = joined(random_cloud(random, 500, 3), random_cloud(random, 200, 3, (0.5, 0.001, 0.001)),
                       random_cloud(random, 300, 3, (0.2, 0.1, 0.3), box=(8, 6, 3)))
        covariances, _ = THEIRS._quat_scale_to_covar_preci(torch.tensor(cloud.turns), torch.tensor(cloud.scales))
        pose = torch.tensor(np.vstack([camera.pose, [0, 0, 0, 1]]))
        lens = np.diag([*camera.focal, 1.0])
        lens[:2, 2] = camera.middle
        _, means, depths, conics, compensations = THEIRS._fully_fused_projection(
            torch.tensor(cloud.means), covariances, pose[None], torch.tensor(lens)[None], *camera.size, eps2d=0.3,
            calc_compensations=True, camera_model=model)
        ours = reference.project(cloud._replace(compensated=True, opacities=np.ones(len(cloud.means))), camera, 0.3)
        inverse = np.linalg.inv(ours.covariances)
        self.assertTrue((ours.at[:, 2] > 0).all())
        self.expect_same(f"{model}, means", ours.means, means[0])
        self.expect_same(f"{model}, depths", ours.at[:, 2], depths[0])
        self.expect_same(f"{model}, inverse covariances", inverse[:, [0, 0, 1], [0, 1, 1]], conics[0])
        # gsplat's compensation is at least 0.005.
        self.expect_same(f"{model}, compensation", np.maximum(ours.opacities, 0.005), compensations[0])

    def test_perspective(self):
        self.check(look((0.5, 0.3, 3.5)), "pinhole")

    def test_parallel(self):
        self.check(look((-0.4, 0.6, 3.5), focal=24, parallel=True), "ortho")

    def test_depths_along_rays(self):
        camera = look((0.5, 0.3, 3.5))
        random = np.random.default_rng(12)
        cloud = joined(random_cloud(random, 50, 0), random_cloud(random, 50, 0, (0.3, 0.3, 0.001)))
        z = reference.fragments(cloud, camera, 0, "ray").z
        pixels = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in camera.size)), -1)
        rays = np.concatenate([(pixels - camera.middle) / camera.focal, np.ones_like(pixels[..., :1])], -1)
        length = np.linalg.norm(rays, axis=-1)
        toward = torch.tensor((rays / length[..., None]) @ camera.pose[:, :3])
        eye = torch.tensor(-camera.pose[:, :3].T @ camera.pose[:, 3]).expand(toward.shape)
        whites = THEIRS._quat_scale_to_preci_half(torch.tensor(cloud.turns), torch.tensor(cloud.scales))
        found = []
        for mean, scale, white in zip(torch.tensor(cloud.means), torch.tensor(cloud.scales), whites):
            found.append(RAYS._compute_ray_gaussian_distance(eye, toward, mean, white.T, scale)[1])
        # A depth behind the camera is the centre's here, and positive there.
        ahead = z != reference.project(cloud, camera, 0.3).at[:, 2, None, None]
        self.assertGreater(ahead.mean(), 0.9)
        self.expect_same("depths along rays", (z * length)[ahead], torch.stack(found)[torch.tensor(ahead)])

    def test_harmonics(self):
        camera = look((0.5, 0.3, 3.5))
        eye = -camera.pose[:, :3].T @ camera.pose[:, 3]
        for degree in range(4):
            cloud = random_cloud(np.random.default_rng(degree), 1000, degree)
            theirs = THEIRS._spherical_harmonics(degree, torch.tensor(cloud.means - eye), torch.tensor(cloud.harmonics))
            self.expect_same(f"degree {degree}, colours", reference.colors(cloud, camera), (theirs + 0.5).clamp(min=0))


if __name__ == "__main__":
    if not os.environ.get("PEELER_GSPLAT"):
        skip("PEELER_GSPLAT is not set: a checkout of github.com/nerfstudio-project/gsplat")
    try:
        import torch
    except ImportError:
        skip("Debian's python3-torch is missing")
    THEIRS, RAYS = functions(pathlib.Path(os.environ["PEELER_GSPLAT"]))
    unittest.main(argv=sys.argv[:1])
