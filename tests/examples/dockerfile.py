# SPDX-License-Identifier: Apache-2.0
"""Builds Dockerfiles without Docker: each stage in its own Debian root, with chroot.

Supports only the instructions that examples/Dockerfile uses, and rejects all others."""

import concurrent.futures
import glob
import os
import shlex
import shutil
import subprocess

MOUNTED = ("proc", "dev", "sys")
KNOWN = ("WORKDIR", "ENV", "COPY", "RUN", "ENTRYPOINT")
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"


class Failed(Exception):
    pass


def instructions(file):
    """Returns [(line number, instruction, text of the instruction)]."""
    found, text, start = [], "", 0
    with open(file, encoding="utf-8") as lines:
        for number, line in enumerate(lines, 1):
            if line.lstrip().startswith("#") or not (line.strip() or text):
                continue
            start = start or number
            text += line.rstrip("\n")
            if text.endswith("\\"):
                text = text[:-1]
                continue
            name, _, rest = text.strip().partition(" ")
            found.append((start, name.upper(), rest.strip()))
            text, start = "", 0
    return found


def plans(file):
    """Returns [(name of a stage, [(where, instruction, its text)])]. Raises Failed for unknown instructions."""
    found = []
    for number, name, text in instructions(file):
        where = f"line {number}: {name} {text}"
        if name == "FROM":
            image, *alias = text.split()
            if image != "debian:12" or (alias and alias[0].upper() != "AS"):
                raise Failed(where)
            found.append((alias[1] if alias else str(len(found)), []))
        elif name in KNOWN and found:
            found[-1][1].append((where, name, text))
        else:
            raise Failed(where)
    return found


def copied(text):
    """Returns the source stage (None if there is none), the sources and the target."""
    *sources, target = text.split()
    stage = sources.pop(0)[7:] if sources[0].startswith("--from=") else None
    return stage, sources, target


def copy(pattern, to, target):
    """Copies a folder's contents into the target, or a file into it if the target ends with a slash. `to` is the
    target's path outside the root. Returns False if nothing matches the pattern."""
    found = glob.glob(pattern)
    for source in found:
        if os.path.isdir(source):
            shutil.copytree(source, to, dirs_exist_ok=True)
            continue
        file = os.path.join(to, os.path.basename(source)) if target.endswith("/") else to
        os.makedirs(os.path.dirname(file), exist_ok=True)
        shutil.copy(source, file)
    return bool(found)


class Stage:
    """A stage's root folder, and the state that its instructions leave for later ones."""

    def __init__(self, base, root):
        subprocess.run(["cp", "-a", base, root], check=True)
        self.root, self.folder = root, "/"
        self.variables = {"PATH": PATH, "HOME": "/root"}
        shutil.copy("/etc/resolv.conf", root + "/etc/resolv.conf")
        for name in MOUNTED:
            subprocess.run(["mount", "--rbind", f"/{name}", f"{root}/{name}"], check=True)

    def run(self, command, user=None, **options):
        """Runs `command` in this root. The result's stdout contains standard output and standard error."""
        words = [
            "chroot",
            *([f"--userspec={user}"] if user else []),
            self.root,
            "/bin/sh",
            "-c",
            f'cd {shlex.quote(self.folder)} && exec "$@"',
            "sh",
            *command,
        ]
        proxies = {name: os.environ[name] for name in os.environ if name.lower().endswith("_proxy")}
        return subprocess.run(
            words,
            env={**self.variables, **proxies},
            text=True,
            check=False,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            **options,
        )

    def path(self, name):
        """Returns the path outside the root for a path in the Dockerfile."""
        return self.root + os.path.normpath(os.path.join(self.folder, name))


class Builder:
    def __init__(self, base, context, scratch, replace=None):
        """`base` is the root for FROM debian:12. replace(stage, command) is called before each RUN; it returns True if
        it has run a replacement for the command."""
        self.base, self.context, self.scratch = base, context, scratch
        self.replace = replace or (lambda stage, command: False)
        self.stages = {}  # from a name to its future Stage
        self.entrypoint = None

    def build(self, file):
        """Returns the last stage. Raises Failed. Builds stages concurrently; a stage that copies from another waits for
        it."""
        stages = plans(file)
        with concurrent.futures.ThreadPoolExecutor(len(stages)) as threads:
            for name, plan in stages:
                self.stages[name] = threads.submit(self._make, name, plan)
            return [stage.result() for stage in self.stages.values()][-1]

    def _make(self, stage_name, plan):
        stage = Stage(self.base, f"{self.scratch}/{stage_name}")
        for where, name, text in plan:
            if name == "WORKDIR":
                stage.folder = os.path.normpath(os.path.join(stage.folder, text))
                os.makedirs(stage.path("."), exist_ok=True)
            elif name == "ENV":
                key, _, value = text.partition("=")
                stage.variables[key] = value
            elif name == "COPY":
                self._copy(stage, text, where)
            elif name == "RUN":
                if self.replace(stage, text):
                    continue
                done = stage.run(["/bin/sh", "-c", text])
                if done.returncode != 0:
                    raise Failed(f"{where}\n{done.stdout[-3000:]}")
            elif name == "ENTRYPOINT":
                self.entrypoint = [word.strip(' "') for word in text.strip("[]").split(",")]
        return stage

    def _copy(self, stage, text, where):
        origin_stage, sources, target = copied(text)
        origin = self.stages[origin_stage].result().root if origin_stage else self.context
        for pattern in sources:
            if not copy(f"{origin}/{pattern.lstrip('/')}", stage.path(target), target):
                raise Failed(f"{where}: no {pattern}")
