# SPDX-License-Identifier: Apache-2.0
"""Tests that the forecast of --dry-run is between a job's real peak and 1.5 times that peak. Tests that under a memory
limit of the kernel a job fits, or is refused before its first band, but is never killed.

Prints two tables. PEELER is the program, PEELER_ASSETS the folder of models. PEELER_TEST_ALL makes the tables long.
"""

import contextlib
import functools
import json
import os
import pathlib
import shlex
import subprocess
import tempfile
import unittest

PEELER = os.environ.get("PEELER", "peeler")
ALL = os.environ.get("PEELER_TEST_ALL") is not None
HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE.parent / "examples" / "scenes"
ASSETS = pathlib.Path(os.environ.get("PEELER_ASSETS") or HERE.parents[1] / "shared" / "assets") / "gltf-sample-assets"
MOST = 1.5  # the maximum ratio of a forecast to the peak
RENDERED = tempfile.TemporaryDirectory()  # pylint: disable=consider-using-with

# The jobs: verb, scene, output, and the other words. "*" marks the jobs of the short run. For an extract, the words
# before the colon render its input. "{}" is the output.
JOBS = """
* render coincident.glb a.exr --size 64x64
  render coincident.glb a.png --size 64x64
* render engine.glb a.exr --size 320x180
  render engine.glb a.exr --size 640x360
  render engine.glb a.exr --size 1600x1200
  render engine.glb a.exr --size 1600x1200 --threads 1
  render engine.glb a.exr --size 3840x2160
* render engine.glb a.exr --size 640x480 --as deep
  render engine.glb a.exr --size 1920x1080 --as deep
  render engine.glb a.npz --size 1280x720
  render engine.glb a.npz --size 640x480 --dense 4
  render engine.glb a.exr --size 1920x1080 --as composite
* render engine.glb a.png --size 960x540
  render engine.glb a.png --size 3840x2160
  render engine.glb a.jpg --size 1280x720 --fxaa
  render engine.glb a.tif --size 1280x720
  render engine.glb a.exr --size 640x360 --samples 4
  render engine.glb a.png --size 800x600 --samples 4
  render engine.glb a.png --size 640x480 --shadows
  render engine.glb a.exr --size 1280x720 --method dual --as composite
  render engine.glb a.exr --size 1280x720 --method weighted-sum --as composite
  render engine.glb a.exr --size 640x480 --method front-to-back
  render engine.glb a.exr --size 640x480 --method two-pass --layers 4
  render engine.glb a.exr --size 960x540 --channels all
  render engine.glb a.exr --size 960x540 --cryptomatte
  render engine.glb a.exr --size 1600x1200 --memory 420M
  render engine.glb a.exr --size 3840x2160 --memory 600M
  render engine.glb a.exr --size 8000x8000 --crop 0,2000,8000,1000
  render glasses.glb a.exr --size 1280x720
  render glasses.glb a.png --size 640x480
  render glasses.glb a.png --size 1920x1080 --memory 480M
  render plant.glb a.exr --size 1920x1080
* render plant.glb a.html --size 320x240
  render panes.glb a.exr --size 640x360 --precision float
  render jellyfish.glb a.exr --size 1280x720
  render bracket.glb a.exr --size 512x512
  render DamagedHelmet a.exr --size 512x512
  render DamagedHelmet a.png --size 1920x1080
  render Fox a.##.exr --size 640x480 --frames 1-3
  render GearboxAssy a.exr --size 1280x720
  render StainedGlassLamp a.png --size 800x600
  render GlassVaseFlowers a.exr --size 1024x768
  render CesiumMilkTruck a.png --size 1280x720
  render 2CylinderEngine a.exr --size 1280x720 --as deep
* rays engine.glb a.npz --engine cpu --axes --resolution 256
  rays engine.glb a.npz --engine cpu --axes --resolution 1024
* rays engine.glb a.exr --engine cpu --axes --resolution 512 --map thickness --map count
  rays engine.glb a.exr --engine cpu --axes --resolution 256
  rays engine.glb a.ply --engine cpu --axes --resolution 512
  rays engine.glb a.##.png --engine cpu --axes --resolution 1024 --map count
  rays engine.glb a.npz --engine cpu --voxels 256
  rays engine.glb a.npz --engine cpu --eye 3,2,4 --target 0,0,0 --size 1920x1080
  rays plant.glb a.npz --engine cpu --axes --resolution 512
* rays engine.glb a.npz --engine gl --axes --resolution 256
  rays engine.glb a.exr --engine gl --axes --resolution 512 --map thickness
  rays DamagedHelmet a.npz --engine gl --direction 0,0,1 --resolution 1024
* bake engine.glb a.glb --engine cpu --directions 16
  bake engine.glb a.glb --engine cpu --directions 256
  bake coincident.glb a.glb --engine cpu --directions 8
  bake glasses.glb a.glb --engine cpu --directions 16 --quantity bent-normal
  bake plant.glb a.glb --engine cpu --directions 16 --quantity irradiance --environment studio
  bake DamagedHelmet a.exr --engine cpu --directions 8 --size 2048
  bake DamagedHelmet a.png --engine cpu --directions 8
  bake DamagedHelmet a.glb --engine cpu --directions 8 --target texture
  bake GearboxAssy a.glb --engine cpu --directions 16
  bake 2CylinderEngine a.glb --engine cpu --directions 16 --quantity thickness
* bake engine.glb a.glb --engine gl --directions 8 --resolution 256
  bake engine.glb a.glb --engine gl --directions 16 --resolution 1024
* extract engine.glb a --size 640x360 : --points {}.ply
  extract engine.glb a --size 1920x1080 : --points {}.ply
  extract engine.glb a --size 2560x1440 --as deep : --npz {}.npz
  extract engine.glb a --size 1280x720 --as deep : -o {}.##.png
  extract engine.glb a --size 1920x1080 : -o {}.##.exr
  extract engine.glb a --size 1920x1080 : -o {}.png --layer 0
  extract engine.glb a --size 1920x1080 --layout single-part : --npz {}.npz --dense 4
  extract engine.glb a --size 1280x720 --channels all : --points {}.ply --layer 0
  extract engine.glb a --size 1280x720 --channels id : --depth-complexity {}.exr --points {}.ply --npz {}.npz
  extract coincident.glb a --size 320x180 : --depth-complexity {}.png
  extract glasses.glb a --size 1280x720 --as deep : --npz {}.npz --points {}.ply
"""

# The memory limits of the runs, in MB.
LIMITS = (300, 600, 1000) if ALL else (300, 600)
LIMITED = """
* render coincident.glb a.exr --size 320x180
  render engine.glb a.exr --size 640x360
* render engine.glb a.exr --size 1600x1200
  render engine.glb a.exr --size 3840x2160
  render engine.glb a.exr --size 1280x720 --samples 8
  render engine.glb a.exr --size 1920x1080 --method dual --as composite
  render engine.glb a.png --size 1280x720 --shadows --shadow-size 4096
  render glasses.glb a.png --size 1920x1080
  render plant.glb a.html --size 1280x720
  render DamagedHelmet a.png --size 1920x1080
  rays engine.glb a.npz --engine cpu --axes --resolution 2048
  rays engine.glb a.npz --engine gl --axes --resolution 1024
  bake engine.glb a.glb --engine cpu --directions 16
  bake engine.glb a.glb --engine gl --directions 8 --resolution 1024
  bake DamagedHelmet a.exr --engine cpu --directions 8 --size 2048
  bake DamagedHelmet a.glb --engine cpu --directions 8 --size 1024 --target texture
  extract engine.glb a --size 3840x2160 --as deep : -o {}.##.png
  extract engine.glb a --size 3840x2160 : --points {}.ply --npz {}.npz
"""


def jobs(table):
    """Returns the jobs of a table whose scenes exist, as lists of words without the output's folder."""
    found = []
    for line in table.strip("\n").splitlines():
        if not line.startswith("*") and not ALL:
            continue
        verb, scene, output, *more = shlex.split(line.lstrip("* "))
        folder = ASSETS / scene
        files = [SCENES / scene] if scene.endswith(".glb") else sorted(folder.glob("*/*.gl*"))
        if files and files[0].exists():
            found.append((line.lstrip("* "), verb, files[0], output, more))
        else:
            print(f"left out, as there is no such model: {line.lstrip()}")
    return found


@functools.cache
def rendered(scene, words):
    """Returns the layered file that an extract job reads: the scene rendered with these words."""
    file = pathlib.Path(RENDERED.name) / f"{len(list(pathlib.Path(RENDERED.name).iterdir()))}.exr"
    subprocess.run([PEELER, "render", scene, "-o", file, "--quiet", *words], check=True)
    return file


def commandOf(job, folder):
    """Returns the words of a job's command line."""
    _, verb, scene, output, words = job
    if ":" not in words:
        return [verb, scene, "-o", folder / output, *words]
    colon = words.index(":")
    file = rendered(scene, tuple(words[:colon]))
    return [verb, file, *(word.replace("{}", str(folder / output)) for word in words[colon + 1 :])]


def run(job, folder, *more, **how):
    """Runs a job that prints its results as JSON."""
    command = [PEELER, *commandOf(job, folder), *more]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("SLURM_", "CUE_"))}
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False, **how)


def last(result):
    """Returns the result of the last picture of a sequence, or of the only picture."""
    return result["frames"][-1] if "frames" in result else result


class Forecasts(unittest.TestCase):
    def test_hold(self):
        print(f"{'before':>8} {'in it':>8} {'peak':>8}  MB, times the peak")
        errors, ratios = [], []
        for job in jobs(JOBS):
            with tempfile.TemporaryDirectory() as name:
                folder = pathlib.Path(name)
                before = run(job, folder, "--dry-run")
                self.assertEqual(before.returncode, 0, before.stderr)
                self.assertIn("of memory", before.stderr)
                self.assertEqual(list(folder.iterdir()), [])
                done = run(job, folder, "--json", "--quiet")
                self.assertEqual(done.returncode, 0, done.stderr)
            told = json.loads(before.stdout)["forecastMemory"]
            result = last(json.loads(done.stdout))
            peak = result["peakMemory"]
            ratio = told / peak
            ratios.append(ratio)
            row = f"{told / 1e6:8.0f} {result['forecastMemory'] / 1e6:8.0f} {peak / 1e6:8.0f}  {ratio:.2f}  {job[0]}"
            print(row, flush=True)
            if not peak <= told <= MOST * peak or not peak <= result["forecastMemory"] <= MOST * peak:
                errors.append(row)
        ratios.sort()
        if ratios:
            middle = ratios[len(ratios) // 2]
            print(f"{len(ratios)} jobs: forecast/peak {ratios[0]:.2f} to {ratios[-1]:.2f}, median {middle:.2f}")
        if errors:
            self.fail("\n" + "\n".join(errors))


class Cgroup:
    """A child of our own cgroup with this memory limit in bytes. The context manager removes it at the end."""

    def __init__(self, limit):
        self.limit = limit
        self.folder = None

    @staticmethod
    def parents():
        """Yields our own memory cgroup, for either version of cgroups: its folder, the name of the file with the limit,
        and the name of the file with the limit including swap."""
        for line in pathlib.Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines():
            _, controllers, group = line.split(":", 2)
            if "memory" in controllers.split(","):
                folder = pathlib.Path("/sys/fs/cgroup/memory" + group)
                yield folder, "memory.limit_in_bytes", "memory.memsw.limit_in_bytes", None
            elif not controllers:
                yield pathlib.Path("/sys/fs/cgroup" + group), "memory.max", "memory.swap.max", "0"

    def __enter__(self):
        for parent, limit, with_swap, swap in self.parents():
            folder = parent / f"peeler-test-{os.getpid()}"
            try:
                folder.mkdir()
            except OSError:
                continue
            self.folder = folder
            try:
                (folder / limit).write_text(str(self.limit), encoding="ascii")
            except OSError:
                self.__exit__()
                continue
            with contextlib.suppress(OSError):  # fails if swap accounting is off
                (folder / with_swap).write_text(swap or str(self.limit), encoding="ascii")
            return self
        raise unittest.SkipTest("no cgroup that limits memory may be made here (root, and a writable controller)")

    def __exit__(self, *_):
        if self.folder:
            self.folder.rmdir()
        self.folder = None

    def enter(self):
        """Moves the calling process into the group."""
        (self.folder / "cgroup.procs").write_text(str(os.getpid()), encoding="ascii")

    def kills(self):
        """Returns the number of processes in the group that the kernel's OOM killer has killed."""
        for name in ("memory.events", "memory.oom_control"):
            with contextlib.suppress(OSError):
                for line in (self.folder / name).read_text(encoding="ascii").splitlines():
                    if line.startswith("oom_kill "):
                        return int(line.split()[1])
        return 0


class Limits(unittest.TestCase):
    def test_kill_nothing(self):
        with Cgroup(LIMITS[0] * 10**6):
            pass  # if this fails, the whole test is skipped
        print(f"{'limit':>5} {'exit':>4} {'peak':>5}  MB")
        errors = []
        codes = set()
        for job in jobs(LIMITED):
            for limit in LIMITS:
                row = self.limited(job, limit, codes)
                print(row, flush=True)
                if "  wrong: " in row:
                    errors.append(row)
        if errors:
            self.fail("\n" + "\n".join(errors))
        self.assertEqual(codes, {0, 33}, "some jobs are to fit, and some are not")

    def limited(self, job, limit, codes):
        """Runs a job in a cgroup, and returns its row for the table."""
        with tempfile.TemporaryDirectory() as name, Cgroup(limit * 10**6) as group:
            folder = pathlib.Path(name)
            ran = run(job, folder, "--json", "--quiet", "--progress", "json", preexec_fn=group.enter)
            told = [json.loads(line) for line in ran.stderr.splitlines() if line.startswith("{")]
            files = list(folder.iterdir())
            kills = group.kills()
        codes.add(ran.returncode)
        peak = last(json.loads(ran.stdout))["peakMemory"] / 1e6 if ran.returncode == 0 else 0
        row = f"{limit:5} {ran.returncode:4} {peak:5.0f}  {job[0]}"
        faults = []
        if ran.returncode not in (0, 33):
            faults.append(f"exit code {ran.returncode}")
        if kills:
            faults.append(f"{kills} killed")
        if ran.returncode == 33:
            if files:
                faults.append(f"it left {files[0].name}")
            if "give at least" not in ran.stderr and "raise that limit" not in ran.stderr:
                faults.append("no hint")
            # A job must be refused during planning, before the first band; for a composite, planning is most of the
            # work.
            if any(line["progress"] > 0.8 for line in told):
                faults.append("it was refused late")
        return row + ("  wrong: " + ", ".join(faults) if faults else "")


if __name__ == "__main__":
    unittest.main()
