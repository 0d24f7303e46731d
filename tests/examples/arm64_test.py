# SPDX-License-Identifier: Apache-2.0
"""Tests peeler on arm64 processors: cross-builds the packages in a Debian root (preset arm64), and runs the archive, the
wheel and the Debian packages under qemu. Everything that does not go through GL must have the same bytes as on this
machine. Runs only with PEELER_TEST_ALL, because it compiles everything. $PEELER_ARM64 may name a folder of finished
arm64 packages; if there is none, they are built, and kept there.

qemu's user emulation has no seccomp(2), so decoders run with their other limits only."""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys

import debian
import dockerfile
import own_machine
from packed import run
from peeler_command import EXAMPLES, PEELER, SOURCE, main, skip

sys.path.insert(0, str(SOURCE / "tests"))
import threemf_package

ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or SOURCE.parent / "shared" / "assets")
QEMU = shutil.which("qemu-aarch64-static")
PROGRAM = pathlib.Path(shutil.which(PEELER) or PEELER).resolve()
# How the kernel recognises arm64 programs (qemu's scripts/qemu-binfmt-conf.sh). With the flag F it opens qemu now, so
# that qemu need not be in the root.
MAGIC = r"\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00"
MASK = r"\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff"
# Since Linux 6.7, each user namespace has its own table of such rules, so the machine's table does not change.
IN_ROOT = rf"""mount -t binfmt_misc none /proc/sys/fs/binfmt_misc || exit 99
printf %s ':arm64:M::{MAGIC}:{MASK}:{QEMU}:F' > /proc/sys/fs/binfmt_misc/register || exit 99
exec chroot "$@" """

# Commands on files that this machine makes first: SCENES, MODELS, and the pictures of RENDERED.
SCENES = ("bracket", "coincident", "engine", "glasses", "jellyfish", "plant")
MODELS = {"draco": "Box/glTF-Draco", "meshopt": "Pirate", "skin": "CesiumMan/glTF-Binary"}
RENDERED = (
    "render engine.glb -o layers.exr --size 160x90",
    "render glasses.glb -o deep.exr --as deep --size 96x54",
)
COMMANDS = (
    "rays glasses.glb -o direction.npz --direction 1,2,3 --resolution 128 --columns all",
    "rays glasses.glb -o axes.ply --axes --resolution 64",
    "rays plant.glb -o sphere.npz --directions 500 --resolution 16 --columns all",
    "rays engine.glb -o camera.npz --camera main --size 160x90 --dense 4 --columns t_hit,normals --engine cpu",
    "rays engine.glb -o turn.@@.npz --views 24 --around turntable --elevation 17 --size 32x32 --columns all",
    "rays jellyfish.glb -o swim.npz --time 0.37 --directions 8 --resolution 64 --columns all",
    "rays engine.glb -o xray.png --map transmission --direction=-0.75,-0.45,-1 --resolution 128",
    "rays glasses.glb -o map.exr --map thickness,count --exclude backdrop --axes --resolution 64",
    "rays coincident.glb -o inside.vdb --voxels 16",
    "rays part.3mf -o part.npz --axes --resolution 16 --columns all",
    "bake engine.glb -o occluded.glb --directions 16 --resolution 64",
    "bake plant.glb -o texture.exr --size 64 --directions 8 --quantity bent-normal",
    "bake coincident.glb -o lit.npz --quantity irradiance --environment studio --bounces 3 --directions 16",
    "check bracket.glb --min-wall 1.5",
    "check glasses.glb --exclude backdrop",
    "info layers.exr --json",
    "verify layers.exr",
    "compare layers.exr layers.exr",
    "flatten layers.exr -o flat.png --exposure 0.37 --tone-map aces",
    "flatten layers.exr -o flat.tif",
    "flatten layers.exr -o flat.jpg --exclude housing*",
    "convert layers.exr -o as_deep.exr --as deep",
    "convert deep.exr -o as_layers.exr --as ldi",
    "convert layers.exr -o layers.safetensors",
    "extract layers.exr -o layer.##.png",
    "extract layers.exr --points points.ply --npz points.npz --quiet",
    "view layers.exr -o page.html",
    "view layers.exr -o view.png --orbit 10,5",
)
# Parts of messages and of JSON that differ between any two runs.
CHANGING = re.compile(rb'"(peakMemory|milliseconds)": (\d+|\{[^}]*\})|peeler: [a-z]+ \d+ %\n')
OF_MODELS = {
    "draco": "rays draco/Box.gltf -o draco.npz --axes --resolution 32 --columns all",
    "meshopt": "rays meshopt/pirate.glb -o meshopt.npz --axes --resolution 32 --columns all",
    "skin": "rays skin/CesiumMan.glb -o skin.npz --time 0.9 --directions 8 --resolution 64 --columns all",
}


def run_arm64(root, *command, folder="/"):
    """Runs an arm64 program in a root. Returns the subprocess."""
    in_folder = ("/usr/bin/env", "-C", folder) if folder != "/" else ()
    return subprocess.run(
        ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c", IN_ROOT, "sh", root, *in_folder, *command],
        env={"PATH": dockerfile.PATH, "HOME": "/root", "LC_ALL": "C.UTF-8"},
        capture_output=True,
        check=False,
    )


def files_of(folder):
    return {str(path.relative_to(folder)): path for path in pathlib.Path(folder).rglob("*") if path.is_file()}


class Arm64(debian.RootsTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        kept = os.environ.get("PEELER_ARM64")
        cls.packages = pathlib.Path(kept or f"{cls.scratch}/packages")
        if not cls.packages.is_dir():
            cls.build()
        (cls.archive,) = cls.packages.glob("*-linux-aarch64.tar.xz")
        (cls.wheel,) = cls.packages.glob("*_aarch64.whl")
        for file in sorted(cls.packages.iterdir()):
            cls.say(f"{file.stat().st_size / 1e6:5.1f} MB  {file.name}")
        cls.root = f"{cls.scratch}/arm64"
        debian.unpack_root(
            debian.suite(), cls.root, "arm64", ("libegl1", "libgl1-mesa-dri", "python3-numpy", "python3-venv")
        )
        for name in ("proc", "dev"):
            own_machine.mount(f"/{name}", f"{cls.root}/{name}", "none", flags=own_machine.MS_BIND | own_machine.MS_REC)
        cls.work = pathlib.Path(cls.root, "work")
        cls.work.mkdir()
        run("tar", "-C", cls.work, "-xf", cls.archive)
        cls.program = f"/work/{cls.archive.name.removesuffix('.tar.xz')}/bin/peeler"
        cls.say("a root with the archive")
        cls.here = pathlib.Path(cls.scratch, "here")
        cls.here.mkdir()
        for scene in SCENES:
            shutil.copy(EXAMPLES / "scenes" / f"{scene}.glb", cls.here)
        (cls.here / "part.3mf").write_bytes(threemf_package.package(threemf_package.model(threemf_package.OBJECT)))
        if ASSETS.is_dir():
            for name, model in MODELS.items():
                shutil.copytree(ASSETS / "gltf-sample-assets" / model, cls.here / name)
        else:
            print("left out: Draco, meshopt, skins; no asset folder (set PEELER_ASSETS)")
        for command in RENDERED:
            run(PROGRAM, *command.split(), "--quiet", cwd=cls.here)
        cls.there = cls.work / "there"
        shutil.copytree(cls.here, cls.there)

    @classmethod
    def build(cls):
        """Builds the packages in a Debian root, from the tracked files."""
        debian.make_root(debian.suite(), f"{cls.scratch}/base")
        root = dockerfile.Stage(f"{cls.scratch}/base", f"{cls.scratch}/build")
        shutil.rmtree(f"{cls.scratch}/base")
        debian.copy_sources(root.root)
        root.folder = "/peeler"
        root.variables["SOURCE_DATE_EPOCH"] = run("git", "log", "-1", "--format=%ct", cwd=SOURCE).strip()
        for command in (
            "sh examples/install_dependencies.sh arm64",
            "cmake --preset arm64",
            "cmake --build --preset arm64",
        ):
            done = root.run(["sh", "-c", command])
            if done.returncode != 0:
                raise AssertionError(f"{command}\n{done.stdout[-3000:]}")
            cls.say(command)
        shutil.copytree(f"{root.root}/peeler/build/arm64/packages", cls.packages)
        for name in dockerfile.MOUNTED:
            subprocess.run(["umount", "-l", f"{root.root}/{name}"], check=True)
        shutil.rmtree(root.root)

    def run_there(self, *command, folder="/work/there"):
        done = run_arm64(self.root, *command, folder=folder)
        self.assertNotEqual(done.returncode, 99, done.stderr.decode())
        return done

    def test_same_bytes_as_here(self):
        commands = [*COMMANDS, *(line for name, line in OF_MODELS.items() if (self.here / name).is_dir())]
        names = set(files_of(self.here))
        for command in commands:
            with self.subTest(command):
                words = [*command.split(), "--quiet"] if " -o " in command else command.split()
                here = subprocess.run([PROGRAM, *words], cwd=self.here, capture_output=True, check=False)
                there = self.run_there(self.program, *words)
                self.assertIn(here.returncode, (0, 3), here.stderr)
                self.assertEqual(*((done.returncode, CHANGING.sub(b"", done.stdout + done.stderr))
                                   for done in (here, there)))  # fmt: skip
        made = {name: path for name, path in files_of(self.here).items() if name not in names}
        self.assertGreater(len(made), len(COMMANDS))
        other = files_of(self.there)
        self.assertEqual([n for n, path in made.items() if path.read_bytes() != other[n].read_bytes()], [])
        self.say(f"{len(commands)} commands, {len(made)} files: the same bytes")

    def test_renders(self):
        """Renders in software. Mesa computes with the instructions of each processor, so a few pixels may differ."""
        done = self.run_there(self.program, "render", "engine.glb", "-o", "rendered.exr", "--size", "160x90", "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        compared = subprocess.run([PROGRAM, "compare", self.there / "rendered.exr", self.here / "layers.exr", "--json"],
                                  capture_output=True, check=False)  # fmt: skip
        result = json.loads(compared.stdout)
        self.say(f"rendered: {result['countPixels']} of {result['pixels']} pixels have other surfaces")
        self.assertLess(result["countPixels"], 0.001 * result["pixels"])

    def test_nothing_but_the_archive(self):
        """The launcher takes the archive's C library if there is no other."""
        bare = pathlib.Path(self.scratch, "bare")
        shutil.copytree(pathlib.Path(self.root + self.program).parents[1], bare / "peeler", symlinks=True)
        for name in ("proc", "dev"):
            (bare / name).mkdir()
            own_machine.mount(f"/{name}", str(bare / name), "none", flags=own_machine.MS_BIND | own_machine.MS_REC)
        shutil.copy(self.here / "coincident.glb", bare)
        words = ("rays", "coincident.glb", "-o", "hits.npz", "--axes", "--resolution", "32", "--quiet")
        done = run_arm64(bare, "/peeler/bin/peeler", *words)
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        run(PROGRAM, *words, cwd=self.here)
        self.assertEqual((bare / "hits.npz").read_bytes() == (self.here / "hits.npz").read_bytes(), True)

    def test_wheel(self):
        shutil.copy(self.wheel, self.work)
        for command in (
            ("python3", "-m", "venv", "--system-site-packages", "/work/venv"),
            ("/work/venv/bin/pip", "install", "--no-index", f"/work/{self.wheel.name}"),
        ):
            done = self.run_there(*command, folder="/work")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        done = self.run_there("/work/venv/bin/peeler", "--version")
        self.assertEqual(done.stdout.split()[:2], run(PROGRAM, "--version").encode().split()[:2])
        code = "import peeler; print(peeler.Scene('coincident.glb'))"
        # Where Debian's NumPy finds these libraries if they are not configured.
        libraries = "LD_LIBRARY_PATH=/usr/lib/aarch64-linux-gnu/blas:/usr/lib/aarch64-linux-gnu/lapack"
        done = self.run_there("/usr/bin/env", libraries, "/work/venv/bin/python", "-c", code)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.say(done.stdout.decode().strip())


if __name__ == "__main__":
    if not os.environ.get("PEELER_TEST_ALL"):
        skip("arm64 packages are only built with PEELER_TEST_ALL (sh tests/run.sh all)")
    if not QEMU:
        skip("no qemu-aarch64-static (examples/install_dependencies.sh datasets)")
    debian.in_own_machine("arm64", main, debian.suite(), Arm64.NEEDED)
