# SPDX-License-Identifier: Apache-2.0
"""Tests peeler worker: jobs and results as lines, and the worker's state after a client, a job or a process has ended.

PEELER is the program. The short run sends a sample of the mutated lines; PEELER_TEST_ALL sends 100,000.
"""

import json
import os
import pathlib
import random
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import threading
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "examples" / "worker"))
from worker_client import JobError, Worker  # noqa: E402

PEELER = pathlib.Path(os.environ.get("PEELER", HERE.parent / "build/ci/peeler")).resolve()
SCENES = HERE.parent / "examples" / "scenes"
SCENE = SCENES / "coincident.glb"
LINES = 100_000 if "PEELER_TEST_ALL" in os.environ else 3_000
SMALL = {"size": "64x48"}
# A job that takes minutes on any machine. If a test waits until this job ends, the cancellation has failed.
LONG = {"size": "2048x2048", "samples": 256}


def children(pid):
    """Returns the child processes of `pid`."""
    found = []
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        found += [int(child) for child in (task / "children").read_text().split()]
    return found


def wait_until(done, seconds=60):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if done():
            return True
        time.sleep(0.01)
    return False


def is_alive(pid):
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


class WorkerTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def worker(self, *arguments):
        worker = Worker(*arguments, program=PEELER)
        self.addCleanup(worker.close)
        return worker

    def talk(self, text, *arguments):
        """Returns a worker's answers to a text, as lines of JSON."""
        run = subprocess.run([PEELER, "worker", *arguments], input=text, capture_output=True, timeout=600)
        self.assertEqual(run.returncode, 0, run.stderr)
        lines = run.stdout.split(b"\n")
        self.assertEqual(lines.pop(), b"")
        return [json.loads(line) for line in lines]

    def command(self, *arguments):
        subprocess.run([PEELER, *map(str, arguments)], check=True, capture_output=True)

    def output(self, name="out.exr"):
        return self.folder / name


class Jobs(WorkerTest):
    def test_the_first_line_says_the_protocol(self):
        (hello,) = self.talk(b"")
        self.assertEqual((hello["worker"], hello["jobs"]), (1, 1))
        version = subprocess.run([PEELER, "--version"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(["peeler", hello["version"]], version.split()[:2])

    def test_jobs_write_the_bytes_of_the_command_line(self):
        cases = {
            "a.exr": ("render", SCENE, {"size": "64x48", "channels": "normal,id"}),
            "b.png": ("render", SCENE, {"size": "64x48", "samples": 2}),
            "c.npz": ("rays", SCENE, {"direction": "0,0,1", "resolution": 16}),
            "d.exr": ("render", SCENES / "panes.glb" if (SCENES / "panes.glb").exists() else SCENE, SMALL),
            "e.glb": ("bake", SCENE, {"directions": 4, "resolution": 32}),
        }
        worker = self.worker()
        for again in ("", "again "):  # first from the file, then from the scene that is already open
            for name, (verb, scene, options) in cases.items():
                result = worker.run(verb, scene, "-o", self.output(again + name), **options)
                self.assertEqual(result["output"], str(self.output(again + name)))
                if not again:
                    words = [word for option in options.items() for word in (f"--{option[0]}", option[1])]
                    self.command(verb, scene, "-o", self.output("command " + name), "--quiet", *words)
                self.assertEqual(
                    self.output(again + name).read_bytes(), self.output("command " + name).read_bytes(), name
                )

    def test_a_changed_scene_is_read_again(self):
        worker, scene = self.worker(), self.output("scene.glb")
        pictures = set()
        for source in sorted(SCENES.glob("*.glb"))[:2]:
            shutil.copy(source, scene)
            worker.run("render", scene, "-o", self.output(), **SMALL)
            self.command("render", scene, "-o", self.output("command.exr"), "--size", "64x48")
            self.assertEqual(self.output().read_bytes(), self.output("command.exr").read_bytes())
            pictures.add(self.output().read_bytes())
        self.assertEqual(len(pictures), 2)

    def test_warnings_come_with_every_job_of_an_open_scene(self):
        scene = self.output("part.obj")
        scene.write_text("mtllib missing.mtl\nusemtl steel\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        lines = self.talk(
            b"".join(
                json.dumps({"id": i, "verb": "render", "args": [str(scene), "-o", str(self.output())], "options": SMALL}).encode()
                + b"\n"
                for i in range(2)
            )
        )
        self.assertEqual([line["exitCode"] for line in lines[1:]], [0, 0])
        self.assertTrue(lines[1]["warnings"])
        self.assertEqual(lines[1]["warnings"], lines[2]["warnings"])

    def test_failures_name_their_kind(self):
        worker = self.worker()
        for kind, code, args, options in (
            ("usage", 2, [SCENE, "-o", self.output()], {"size": "wide"}),
            ("usage", 2, [SCENE, "-o", "-"], {}),
            ("usage", 2, [SCENE, "-o", "-.exr"], {}),
            ("input", 3, [self.output("missing.glb"), "-o", self.output()], {}),
            ("output", 4, [SCENE, "-o", self.output("missing/out.exr")], {"no_mkdir": True}),
            ("memory", 33, [SCENE, "-o", self.output()], {"memory": "64M", "size": "8000x8000"}),
        ):
            with self.assertRaises(JobError) as raised:
                worker.run("render", *args, **options)
            error = raised.exception
            self.assertEqual((error.kind, error.line["exitCode"]), (kind, code), error)
            self.assertEqual(error.retry, kind == "memory")
        self.assertEqual(worker.run("render", SCENE, "-o", self.output(), **SMALL)["width"], 64)

    def test_verbs_that_run_jobs_are_refused(self):
        worker = self.worker()
        for verb in ("batch", "worker", "renderr"):
            with self.assertRaises(JobError) as raised:
                worker.run(verb, "x")
            self.assertEqual(raised.exception.kind, "usage")

    def test_progress_is_sent_where_it_is_asked_for(self):
        worker, shares = self.worker(), []
        worker.run("render", SCENE, "-o", self.output(), progress=shares.append, **SMALL)
        self.assertEqual(shares, sorted(shares))
        self.assertEqual(shares[-1], 1)

    def test_several_jobs_run_at_a_time(self):
        worker = self.worker("--jobs", "2")
        slow = worker.start("render", SCENE, "-o", self.output("slow.exr"), **LONG)
        result = worker.run("render", SCENE, "-o", self.output(), **SMALL)
        self.assertEqual(result["height"], 48)
        worker.cancel(slow)
        self.assertEqual(worker.wait(slow)["error"]["kind"], "cancelled")


class Lines(WorkerTest):
    def test_a_bad_line_gets_an_error_and_nothing_else(self):
        cases = [
            (b"bad", None),
            (b"[1, 2]", None),
            (b'{"id": 3}', 3),
            (b'{"id": 3, "verb": 7}', 3),
            (b'{"verb": "info", "args": ["x"]}', None),
            (b'{"id": [], "verb": "info"}', None),
            (b'{"id": 4, "verb": "info", "verb": "info"}', 4),
            (b'{"id": 5, "verb": "info", "more": 1}', 5),
            (b'{"id": 6, "verb": "info", "progress": 1}', 6),
            (b'{"id": 7, "verb": "info", "args": ["a\\u0000b"]}', 7),
            (b'{"cancel": 8, "id": 9}', 9),
            (b'{"cancel": {}}', None),
            (b"\xff\xfe{}", None),
            (b"{" * 100_000, None),
        ]
        lines = self.talk(b"".join(line + b"\n" for line, _ in cases))
        self.assertEqual(len(lines), 1 + len(cases))
        for (line, number), answer in zip(cases, lines[1:]):
            self.assertEqual((answer["id"], answer["error"]["kind"], answer["exitCode"]), (number, "usage", 2), line)

    def test_a_line_without_an_end_counts(self):
        lines = self.talk(b'\n  \n{"id": "last", "verb": "info", "args": ["' + str(SCENE).encode() + b'"]}')
        self.assertEqual([line["exitCode"] for line in lines[1:]], [0])
        self.assertEqual(lines[1]["id"], "last")

    def test_a_line_that_is_too_long_is_passed_over(self):
        lines = self.talk(b'{"id": "' + b"x" * (6 << 20) + b'"}\n{"id": 1, "verb": "infos"}\n')
        self.assertEqual([line["id"] for line in lines[1:]], [None, 1])

    def test_an_id_in_use_is_refused(self):
        job = json.dumps({"id": 1, "verb": "render", "args": [str(SCENE), "-o", str(self.output())], "options": SMALL})
        lines = self.talk(f"{job}\n{job}\n".encode())
        self.assertEqual([(line["id"], line["exitCode"]) for line in lines[1:]], [(None, 2), (1, 0)])

    def test_mutated_lines_never_end_it(self):
        seed = int(os.environ.get("PEELER_TEST_SEED", time.time()))
        print(f"seed {seed}", file=sys.stderr)
        chance = random.Random(seed)
        seeds = [
            {"id": 7, "verb": "render", "args": ["s.glb", "-o", "o.exr"], "options": {"size": "64x48", "shadows": True}},
            {"id": "a", "verb": "rays", "args": ["s.glb", "-o", "o.npz"], "options": {"direction": ["0,0,1", "1,0,0"]}},
            {"id": 1, "verb": "compare", "args": ["a.exr", "b.exr"], "progress": True},
            {"cancel": 7},
        ]
        texts = [json.dumps(text).encode() for text in seeds]
        words = [b'"', b"{", b"}", b"[", b"]", b",", b":", b"\\", b"\0", b"-", b"\xff", b"1e999", b"null", b"\\ud800", b"\t"]
        sent = []
        for _ in range(LINES):
            line = bytearray(chance.choice(texts))
            for _ in range(chance.randrange(1, 4)):
                at = chance.randrange(len(line) + 1)
                kind = chance.randrange(4)
                if kind == 0:
                    line[at : at + chance.randrange(8)] = b""
                elif kind == 1:
                    line[at:at] = chance.choice(words)
                elif kind == 2:
                    line[at : at + 1] = bytes([chance.randrange(256)])
                else:
                    line = line[:at]
            sent.append(bytes(line).replace(b"\n", b" "))
        lines = self.talk(b"".join(line + b"\n" for line in sent), "--jobs", "2")
        for line in lines[1:]:
            self.assertTrue("error" in line or "result" in line or line["exitCode"] in (0, 1), line)
        self.assertGreater(len(lines), LINES / 4)
        self.assertFalse([line for line in lines if line.get("error", {}).get("kind") in ("crash", "internal")])


class Ends(WorkerTest):
    def long(self, worker, name="long.exr"):
        """Starts a long job; returns its number and its process."""
        job = worker.start("render", SCENE, "-o", self.output(name), wants_progress=True, **LONG)
        worker._answers[job].get(timeout=600)  # waits until the job has begun
        (process,) = children(worker._process.pid)
        return job, process

    def test_a_cancelled_job_leaves_nothing(self):
        worker = self.worker()
        job, _ = self.long(worker)
        waiting = worker.start("render", SCENE, "-o", self.output("waiting.exr"), **LONG)
        for each in (waiting, job):
            worker.cancel(each)
            line = worker.wait(each)
            self.assertEqual((line["error"]["kind"], line["exitCode"], line["retry"]), ("cancelled", 130, False))
        self.assertEqual(list(self.folder.iterdir()), [])
        worker.cancel(job)  # the job has already ended
        self.assertEqual(worker.run("render", SCENE, "-o", self.output(), **SMALL)["width"], 64)

    def test_what_progress_raises_cancels(self):
        def stop(_):
            raise KeyboardInterrupt

        worker = self.worker()
        with self.assertRaises(KeyboardInterrupt):
            worker.run("render", SCENE, "-o", self.output("long.exr"), progress=stop, **LONG)
        self.assertEqual(worker.run("render", SCENE, "-o", self.output(), **SMALL)["width"], 64)
        self.assertEqual([path.name for path in self.folder.iterdir()], ["out.exr"])

    def test_a_job_whose_process_is_killed_is_worth_trying_again(self):
        worker = self.worker()
        job, process = self.long(worker)
        os.kill(process, signal.SIGKILL)
        line = worker.wait(job)
        self.assertEqual((line["error"]["kind"], line["exitCode"], line["retry"]), ("crash", 137, True))
        self.assertEqual(worker.run("render", SCENE, "-o", self.output(), **SMALL)["width"], 64)

    def test_a_client_that_goes_away_ends_it(self):
        worker = self.worker()
        _, process = self.long(worker)
        worker._process.stdout.close()
        worker._process.stdin.close()
        self.assertTrue(wait_until(lambda: worker._process.poll() is not None))
        self.assertTrue(wait_until(lambda: not is_alive(process)))
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_signals_end_it_and_its_jobs(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGKILL):
            worker = self.worker()
            _, process = self.long(worker)
            os.kill(worker._process.pid, number)
            code = worker._process.wait(60)
            self.assertEqual(code, -9 if number == signal.SIGKILL else 128 + number)
            self.assertTrue(wait_until(lambda: not is_alive(process)))
            self.assertEqual(list(self.folder.iterdir()), [])


class Sockets(WorkerTest):
    def listen(self, path):
        process = subprocess.Popen([PEELER, "worker", "--listen", path, "--jobs", "2"], stderr=subprocess.PIPE)
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        self.assertTrue(wait_until(lambda: path.exists() or process.poll() is not None))
        return process

    def test_clients_of_one_socket_have_ids_of_their_own(self):
        path = self.output("socket")
        process = self.listen(path)
        self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o600)
        clients = [Worker(listens=path) for _ in range(3)]
        results = {}

        def render(client, name):
            results[name] = client.run("render", SCENE, "-o", self.output(f"{name}.exr"), **SMALL)

        threads = [threading.Thread(target=render, args=(client, i)) for i, client in enumerate(clients)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual([results[i]["output"] for i in range(3)], [str(self.output(f"{i}.exr")) for i in range(3)])
        clients.pop().close()  # the other clients stay
        for client in clients:
            self.addCleanup(client.close)
        self.assertEqual(clients[0].run("info", SCENE)["kind"], "scene")
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(60), 143)
        self.assertFalse(path.exists())
        with self.assertRaises(ConnectionError):
            clients[0].run("info", SCENE)

    def test_a_client_that_leaves_takes_its_jobs_along(self):
        path = self.output("socket")
        process = self.listen(path)
        client = Worker(listens=path)
        client.start("render", SCENE, "-o", self.output("long.exr"), **LONG)
        self.assertTrue(wait_until(lambda: children(process.pid)))
        (job,) = children(process.pid)
        client.close()
        self.assertTrue(wait_until(lambda: not is_alive(job)))

    def test_a_socket_in_use_stays_and_a_stale_one_is_replaced(self):
        path = self.output("socket")
        self.listen(path)
        second = subprocess.run([PEELER, "worker", "--listen", path], capture_output=True, text=True)
        self.assertEqual(second.returncode, 4)
        self.assertIn("another worker is listening", second.stderr)
        stale = self.output("stale")
        bound = socket.socket(socket.AF_UNIX)
        bound.bind(str(stale))
        bound.close()
        self.listen(stale)
        self.assertTrue(wait_until(lambda: stat.S_IMODE(stale.stat().st_mode) == 0o600))
        Worker(listens=stale).close()

    def test_a_file_that_is_no_socket_stays(self):
        path = self.output("letter")
        path.write_text("dear")
        run = subprocess.run([PEELER, "worker", "--listen", path], capture_output=True, text=True)
        self.assertEqual(run.returncode, 4)
        self.assertEqual(path.read_text(), "dear")


if __name__ == "__main__":
    unittest.main()
