# SPDX-License-Identifier: Apache-2.0
"""Tests the module in a host process: it changes no state of the host, and survives forks, threads, interrupts and the
loss of its worker."""

import asyncio
import contextlib
import locale
import multiprocessing
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
import unittest
import warnings

from module import BUILD, SCENES, ModuleTest, np, peeler, scene, threads

OPEN = set(os.listdir("/proc/self/fd"))  # descriptors inherited from the caller of the tests
LARGE = {"size": (2400, 1600), "samples": 16}
LATEST = 0.3  # the maximum time from Ctrl-C to KeyboardInterrupt, in seconds


def files():
    """Returns {descriptor: its target}."""
    found = {}
    for name in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            target = os.readlink(f"/proc/self/fd/{name}")
            if not target.endswith("/fd"):  # not the descriptor of this listing itself
                found[int(name)] = target
    return found


def lines(path):
    with open(path, encoding="utf-8", errors="surrogateescape") as file:
        return file.readlines()


def state():
    """Returns all state whose change a host could notice."""
    return {
        "environment": (dict(os.environ), lines("/proc/self/environ")),
        "folder": os.getcwd(),
        "locale": locale.setlocale(locale.LC_ALL),
        "handlers": [signal.getsignal(s) for s in signal.valid_signals()],
        "mask": signal.pthread_sigmask(signal.SIG_BLOCK, ()),
        "umask": [line for line in lines("/proc/self/status") if line.startswith("Umask")],
        "files": files(),
        "warnings": list(warnings.filters),
    }


def worker_processes():
    """Returns the process of this process's worker, then those of the worker's jobs."""
    first = peeler._worker._get()._process.pid
    return [first, *map(int, lines(f"/proc/{first}/task/{first}/children")[0].split())]


def is_at_work():
    worker = peeler._worker._worker
    return worker is not None and bool(worker._answers)


class Sending:
    """A thread that acts shortly after a call has submitted its job."""

    def __init__(self, act, after=0.15):
        self.act, self.after, self.at = act, after, None

    def _run(self):
        end = time.monotonic() + 20
        while not is_at_work() and time.monotonic() < end:
            time.sleep(0.002)
        time.sleep(self.after)
        self.at = time.monotonic()
        self.act()

    def __enter__(self):
        self.thread = threading.Thread(target=self._run)
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.thread.join()


def fragments(_=None):
    with peeler.Renderer() as r:
        return len(r.layers(scene("panes"), size=(48, 27)))


class DataSet:
    """A replacement for the data set of a torch DataLoader, which is indexed, pickled or forked."""

    def __init__(self):
        self.scene, self.r = scene("panes"), peeler.Renderer()
        self.mesh = peeler.Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])

    def __len__(self):
        return 24

    def __getitem__(self, i):
        shown = (self.scene, self.mesh)[i % 2]
        return os.getpid(), len(self.r.layers(shown, size=(32, 18), eye=(0.1 * i, 0, 3)).z)


def item(work):
    return work[0][work[1]]


def load(dataset, indices, results):
    """Loads items as a process of a DataLoader does."""
    results.put([(i, dataset[i]) for i in indices])


class Host(ModuleTest):
    def setUp(self):
        super().setUp()
        self.panes = scene("panes")
        self.expected = len(self.r.layers(self.panes, size=(48, 27)))

    def assert_usable(self):
        self.assertEqual(len(self.r.layers(self.panes, size=(48, 27))), self.expected)

    def calls(self, exr, **large):
        """Returns {name: call} for every function that does work. With `large`, the pictures take long to render."""
        image = peeler.read(exr)
        engine, glb = scene("engine"), SCENES / "engine.glb"
        out = lambda name: self.folder / name
        return {
            "render": lambda: peeler.render(glb, output=out("r.exr"), **large),
            "rays": lambda: peeler.rays(glb, output=out("r.npz"), directions=40, resolution=64, engine="cpu"),
            "check": lambda: peeler.check(glb),
            "bake": lambda: peeler.bake(glb, output=out("b.glb"), directions=16, resolution=32),
            "flatten": lambda: peeler.flatten(exr, output=out("f.png")),
            "extract": lambda: peeler.extract(exr, npz=out("e.npz"), points=out("e.ply")),
            "merge": lambda: peeler.merge(exr, output=out("m.exr")),
            "convert": lambda: peeler.convert(exr, output=out("c.exr"), as_="deep"),
            "view": lambda: peeler.view(exr, output=out("v.png"), eye=(0.5, 0.4, 0.7)),
            "sheet": lambda: peeler.sheet(exr, output=out("s.png")),
            "masks": lambda: peeler.masks(glb, output=out("masks"), size=(160, 90)),
            "compare": lambda: peeler.compare(exr, exr),
            "info": lambda: peeler.info(exr),
            "verify": lambda: peeler.verify(exr),
            "devices": peeler.devices,
            "layers": lambda: self.r.layers(engine, **large),
            "composite": lambda: self.r.composite(engine, **large),
            "Renderer.rays": lambda: self.r.rays(engine, directions=40, resolution=64),
            "read": lambda: peeler.read(exr),
            "Image.flatten": image.flatten,
            "Image.save": lambda: image.save(out("i.exr")),
            "Scene": lambda: peeler.Scene(glb),
        }

    def picture(self):
        exr = self.folder / "a.exr"
        peeler.render(SCENES / "engine.glb", output=exr, size=(160, 90))
        return exr

    def test_nothing_of_it_changes(self):
        calls = self.calls(self.picture(), size=(64, 36))
        for name, call in calls.items():
            before = state()
            result = call()
            after = state()
            del result
            for key, value in before.items():
                self.assertEqual(after[key], value, f"{name}: {key}")
        inherited = [fd for fd in files() if str(fd) not in OPEN and os.get_inheritable(fd)]
        self.assertEqual(inherited, [])

    def test_the_worker_is_the_only_thing_that_stays(self):
        code = """if True:
            import os, sys, threading
            before = set(os.listdir("/proc/self/fd"))
            import peeler
            assert len(os.listdir("/proc/self/task")) == 1
            import subprocess
            children = lambda: open(f"/proc/self/task/{os.getpid()}/children").read().split()
            assert not children(), "importing starts nothing"
            with peeler.Renderer() as r:
                r.layers(peeler.Scene(sys.argv[1]), size=(8, 8))
                assert len(children()) == 1
            assert not children()
            for name in set(os.listdir("/proc/self/fd")) - before:
                target = os.path.realpath(f"/proc/self/fd/{name}")
                assert "/peeler-python-" in target or not os.path.exists(target), target  # the folder of its arrays
            peeler.devices()
            print(children()[0])
        """
        done = self.python(code, SCENES / "panes.glb")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertFalse(os.path.exists(f"/proc/{done.stdout.strip()}"), "the worker ends with its process")

    def python(self, code, *arguments, **environment):
        return subprocess.run(
            [sys.executable, "-B", "-c", code, *map(str, arguments)],
            env=os.environ | {"PYTHONPATH": str(BUILD / "python"), **environment},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def seconds_after_interrupt(self, call):
        """Interrupts repeated calls; returns how many seconds later they end."""
        for _ in range(2):
            with Sending(lambda: os.kill(os.getpid(), signal.SIGINT), 0.05) as sent:
                try:
                    while sent.at is None or time.monotonic() < sent.at + 10 * LATEST:
                        call()
                except KeyboardInterrupt:
                    return time.monotonic() - sent.at
            print("an interrupt arrived in a destructor, where Python drops it; so there is another")
        return self.fail("no interrupt arrives")

    def test_ctrl_c_during_every_verb(self):
        calls, late = self.calls(self.picture(), **LARGE), []
        for name, call in calls.items():
            with self.subTest(name):
                late.append(self.seconds_after_interrupt(call))
                self.assertLess(late[-1], LATEST, name)
                self.assertFalse(is_at_work(), name)
        self.assert_usable()
        print(f"{len(late)} calls ended {max(late):.3f} s after Ctrl-C at the latest")

    def test_a_worker_that_is_killed_is_an_error(self):
        engine = scene("engine")
        for which in (0, -1):  # the worker itself, the process of the job
            victim = worker_processes()[which]
            with Sending(lambda: os.kill(victim, signal.SIGKILL)):
                error = self.assert_error("internal", self.r.layers, engine, **LARGE)
            self.assertIn("signal 9 (Killed)", error.what)
            self.assert_usable()
        with Sending(lambda: os.kill(worker_processes()[0], signal.SIGTERM)):
            self.assert_error("internal", peeler.render, SCENES / "engine.glb", output=self.folder / "x.exr", **LARGE)
        self.assertEqual(list(self.folder.iterdir()), [])
        self.assert_usable()

    def test_a_program_that_is_none(self):
        code = "import peeler\ntry:\n    peeler.devices()\nexcept peeler.Error as error:\n    print(error.kind, error.where)"
        for program in ("/nowhere/peeler", "/bin/true", "/bin/cat"):
            done = self.python(code, PEELER=program)
            self.assertEqual(done.stdout.split(), ["usage", program], done.stderr)

    def test_forks(self):
        def child(work):
            process = os.fork()
            if process == 0:
                code = 1
                try:
                    code = 0 if work() == self.expected else 2
                finally:
                    os._exit(code)
            return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])

        render = lambda: len(self.r.layers(self.panes, size=(48, 27)))
        self.assertEqual(child(render), 0)  # with the existing Renderer
        self.assertEqual(child(fragments), 0)
        results = []
        rendering = threading.Thread(target=lambda: results.append(self.r.layers(scene("engine"), size=(800, 600))))
        rendering.start()
        while not is_at_work():
            time.sleep(0.001)
        self.assertEqual(child(render), 0)  # during a render
        rendering.join()
        self.assertEqual(len(results), 1)
        mesh = peeler.Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
        of_mesh = len(self.r.layers(mesh, size=(48, 27)))
        self.assertEqual(child(lambda: len(self.r.layers(mesh, size=(48, 27))) - of_mesh + self.expected), 0)
        self.assertEqual(len(self.r.layers(mesh, size=(48, 27))), of_mesh)  # the mesh's file still exists
        self.assert_usable()

    def test_processes_of_every_kind(self):
        for kind in ("fork", "spawn", "forkserver"):
            with multiprocessing.get_context(kind).Pool(2) as pool:
                self.assertEqual(pool.map(fragments, range(3)), [self.expected] * 3, kind)

    def test_a_data_loader(self):
        """Loads in eight processes, as torch.utils.data.DataLoader does."""
        dataset = DataSet()
        here = [dataset[i][1] for i in range(len(dataset))]
        for kind in ("fork", "spawn"):
            context = multiprocessing.get_context(kind)
            results = context.SimpleQueue()
            loaders = [
                context.Process(target=load, args=(dataset, range(i, len(dataset), 8), results)) for i in range(8)
            ]
            for loader in loaders:
                loader.start()
            found = sum((results.get() for _ in loaders), [])
            for loader in loaders:
                loader.join()
                self.assertEqual(loader.exitcode, 0)
            self.assertEqual([count for _, (_, count) in sorted(found)], here, kind)
            self.assertEqual(len({process for _, (process, _) in found}), 8, kind)

    def test_pickles(self):
        again = pickle.loads(pickle.dumps((self.panes, self.r)))
        self.assertEqual(len(again[1].layers(again[0], size=(48, 27))), self.expected)
        self.assertEqual(again[0].nodes, self.panes.nodes)

    def test_threads(self):
        found = queue.SimpleQueue()
        each = [threading.Thread(target=lambda: found.put(fragments())) for _ in range(6)]
        for thread in each:
            thread.start()
        for thread in each:
            thread.join()
        self.assertEqual([found.get() for _ in each], [self.expected] * 6)

    def test_asyncio(self):
        async def work():
            ticks = 0
            task = asyncio.create_task(peeler.aio(self.r.layers, scene("engine"), size=(800, 600)))
            both = asyncio.gather(task, peeler.aio(peeler.info, SCENES / "panes.glb"))
            while not both.done():
                await asyncio.sleep(0.01)
                ticks += 1
            image, info = await both
            self.assertGreater(ticks, 3)
            self.assertEqual((image.shape, info["kind"]), ((600, 800), "scene"))
            with self.assertRaises(peeler.Error):
                await peeler.aio(peeler.info, "missing.glb")
            task = asyncio.create_task(peeler.aio(self.r.layers, scene("engine"), **LARGE))
            while not is_at_work():
                await asyncio.sleep(0.01)
            start = time.monotonic()
            task.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await task
            while is_at_work():  # until the job has stopped
                await asyncio.sleep(0.01)
            self.assertLess(time.monotonic() - start, LATEST)

        asyncio.run(work())
        self.assert_usable()

    def test_names_are_of_the_folder_of_the_call(self):
        before = os.getcwd()
        self.addCleanup(os.chdir, before)
        os.chdir(self.folder)
        peeler.render(SCENES / "panes.glb", output="here.exr", size=8)
        self.assertTrue((self.folder / "here.exr").is_file())
        image = peeler.read("here.exr")
        os.chdir("/")
        image.save(self.folder / "again.exr")
        self.assertTrue(peeler.compare(self.folder / "here.exr", self.folder / "again.exr")["identical"])

    def test_shared_memory_is_given_back(self):
        image = self.r.layers(scene("engine"), size=(960, 540))
        mesh = peeler.Scene.from_arrays(np.zeros((3, 3)))
        folders = list(peeler._arrays._folders.values())
        modes = [os.stat(folder).st_mode & 0o777 for folder in folders]
        self.assertEqual(modes, [0o700] * len(folders))
        left = [name for folder in folders for name in os.listdir(folder)]
        self.assertEqual(len(left), 1, left)  # the file of the mesh
        del mesh
        self.assertEqual([name for folder in folders for name in os.listdir(folder)], [])
        self.assertGreater(float(image.z.sum()), 0)

    def test_what_a_killed_process_leaves_is_removed(self):
        code = """if True:
            import os, peeler
            mesh = peeler.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
            print(os.path.dirname(os.path.dirname(mesh._path)), flush=True)
            if os.environ["HOW"] == "killed":
                os.kill(os.getpid(), 9)
        """
        left = self.python(code, HOW="killed").stdout.strip()
        self.assertEqual(len(os.listdir(left)), 1)
        self.python(code, HOW="new")
        self.assertTrue(os.path.isdir(left), "it may be somebody's who has just begun")
        os.utime(left, (time.time() - 1000, time.time() - 1000))
        mine = list(peeler._arrays._folders.values())
        for folder in mine:
            os.utime(folder, (time.time() - 1000, time.time() - 1000))
        gone = self.python(code, HOW="old").stdout.strip()
        self.assertFalse(os.path.exists(left))
        self.assertFalse(os.path.exists(gone), "one that ends removes its own")
        for folder in mine:
            self.assertTrue(os.path.isdir(folder), "it is in use")

    def test_threads_that_stay(self):
        before = threads()
        for _ in range(3):
            self.assert_usable()
        self.assertEqual(threads(), before)


if __name__ == "__main__":
    unittest.main()
