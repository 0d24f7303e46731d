# SPDX-License-Identifier: Apache-2.0
"""Uses what the target `packages` makes (cmd/packages) in fresh Debian roots, which debootstrap makes in memory. Takes
minutes, so only with PEELER_TEST_ALL. $PEELER_PACKAGES may name a folder of finished packages."""

import os
import pathlib
import shutil
import subprocess
import unittest

import debian
import dockerfile
from peeler_command import EXAMPLES, PEELER

ALL = bool(os.environ.get("PEELER_TEST_ALL"))
BUILD = pathlib.Path(shutil.which(PEELER) or PEELER).resolve().parent
SCENE = "coincident.glb"
NOBODY = "65534:65534"  # a user who may write only to /work

RENDER = ("render", SCENE, "-o", "layers.exr", "--size", "320x180", "--quiet")
# Commands that load modules on demand: the first loads OpenImageIO, the second OpenVDB.
MORE = (
    ("flatten", "layers.exr", "-o", "composite.tif", "--quiet"),
    ("rays", SCENE, "-o", "inside.vdb", "--voxels", "16", "--quiet"),
)
MADE = ("layers.exr", "composite.tif", "inside.vdb")


def run(*command, **options):
    done = subprocess.run(
        list(map(str, command)),
        text=True,
        check=False,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        **options,
    )
    if done.returncode != 0:
        raise AssertionError(f"exit code {done.returncode}: {command}\n{done.stdout[-3000:]}")
    return done.stdout


@unittest.skipUnless(ALL, "made and installed only with PEELER_TEST_ALL: debootstrap, compile, apt")
class PackedTest(debian.RootsTest):
    """A test case with finished packages in `made`, and in `expected` the scene and the files that this build makes of
    it by RENDER and MORE."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.made = pathlib.Path(os.environ.get("PEELER_PACKAGES") or BUILD / "packages")
        if "PEELER_PACKAGES" not in os.environ:
            cls.say(run("cmake", "--build", BUILD, "--target", "packages").splitlines()[-1])
        cls.expected = pathlib.Path(cls.scratch, "expected")
        cls.expected.mkdir()
        shutil.copy(EXAMPLES / "scenes" / SCENE, cls.expected)
        for arguments in (RENDER, *MORE):
            run(BUILD / "peeler", *arguments, cwd=cls.expected)

    def root(self, suite, name, *packages):
        """Returns a fresh root of that Debian release with these packages, and the scene in /work."""
        base = f"{self.scratch}/{suite}"
        if not os.path.isdir(base):
            self.say(f"a root of {debian.make_root(suite, base)}: {suite}")
        root = dockerfile.Stage(base, f"{self.scratch}/{name}")
        self.addCleanup(self.remove, root)
        root.variables |= {"LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive"}
        self.run_in(root, "apt-get", "update", "-qq")
        self.install(root, *packages)
        work = pathlib.Path(root.root, "work")
        work.mkdir()
        shutil.copy(EXAMPLES / "scenes" / SCENE, work)
        os.chown(work, 65534, 65534)
        self.say(f"{name}: {' '.join(packages)}")
        return root

    def remove(self, root):
        for name in dockerfile.MOUNTED:
            subprocess.run(["umount", "-l", f"{root.root}/{name}"], check=True)
        shutil.rmtree(root.root)

    def run_in(self, root, *command, user=None):
        done = root.run(list(map(str, command)), user=user)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout[-3000:]}")
        return done.stdout

    def install(self, root, *packages):
        if packages:
            self.run_in(root, "apt-get", "install", "-y", "-qq", "--no-install-recommends", *packages)

    def run_as_user(self, root, program, *commands):
        """Runs each command in /work as NOBODY."""
        root.folder = "/work"
        for arguments in commands:
            self.run_in(root, program, *arguments, user=NOBODY)
        root.folder = "/"

    def assert_same_files(self, root, *names):
        for name in names:
            same = (self.expected / name).read_bytes()
            self.assertEqual(pathlib.Path(root.root, "work", name).read_bytes() == same, True, name)
