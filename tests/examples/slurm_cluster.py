# SPDX-License-Identifier: Apache-2.0
"""A Slurm cluster of one node, with Debian's slurmctld, slurmd and munge, in its own folder.

Start it inside own_machine.run(), which ends its remaining processes."""

import os
import re
import shutil
import subprocess
import time

from own_machine import ADDRESS

PROGRAMS = ("slurmctld", "slurmd", "munged", "sbatch", "scontrol", "scancel", "squeue")

# Timeout in seconds; a requeued job takes about ten seconds.
ENDLESS = 200

# cred_expire: the time that a requeued job waits for its old credential to expire (Slurm's minimum: 5 s).
# config_overrides allows more CPUs than the machine has.
CONFIGURATION = """\
ClusterName=test
SlurmctldHost={host}({address})
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
SchedulerParameters=sched_interval=1,sched_min_interval=0,bf_interval=1
MinJobAge=600
KillWait=5
MailProg=/bin/true
ReturnToService=2
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
NodeName={host} NodeAddr={address} CPUs=4 RealMemory=4096
PartitionName=all Nodes=ALL Default=YES DefMemPerCPU=1024 MaxTime=60 State=UP
"""


def missing_programs():
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    return [program for program in PROGRAMS if not shutil.which(program, path=path)]


class Cluster:
    def __init__(self, folder):
        """`folder` must be empty. Returns when the node accepts jobs."""
        self.folder = folder
        for name in ("state", "spool"):
            os.mkdir(f"{folder}/{name}")
        with open(f"{folder}/munge.key", "wb", opener=lambda p, f: os.open(p, f, 0o600)) as key:
            key.write(os.urandom(1024))
        with open(f"{folder}/slurm.conf", "w", encoding="ascii") as configuration:
            configuration.write(
                CONFIGURATION.format(folder=folder, host=os.uname().nodename, address=ADDRESS)
            )
        own = [name for name in os.environ if not name.startswith(("SLURM", "SBATCH"))]
        self.environment = {name: os.environ[name] for name in own}
        self.environment["PATH"] += ":/usr/sbin:/sbin"
        self.environment["SLURM_CONF"] = f"{folder}/slurm.conf"
        files = [f"--{name}-file={folder}/munge.{name}" for name in ("key", "pid", "seed", "log")]
        self.daemons = [
            self._start("munged", "--foreground", f"--socket={folder}/munge.socket", *files),
            self._start("slurmctld", "-D"),
            self._start("slurmd", "-D"),
        ]
        states = ("sinfo", "--noheader", "--format=%T")
        self.wait_until(lambda: "idle" in self.ask(*states, check=False))

    def _start(self, *command):
        with open(f"{self.folder}/{command[0]}.out", "wb") as out:
            return subprocess.Popen(command, env=self.environment, stdout=out, stderr=out)

    def wait_until(self, condition):
        end = time.monotonic() + ENDLESS
        while not condition():
            if time.monotonic() > end:
                raise TimeoutError(f"after {ENDLESS} s:\n{self.state()}")
            time.sleep(0.1)

    def ask(self, *command, check=True, **options):
        """Returns the output of a Slurm command, or of a script that calls Slurm commands."""
        done = subprocess.run(
            command,
            env={**self.environment, **options.pop("environment", {})},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            check=False,
            **options,
        )
        if check and done.returncode != 0:
            raise RuntimeError(f"{command} ended with {done.returncode}: {done.stderr}")
        return done.stdout

    def tasks(self, job):
        """Returns the fields that scontrol reports for every task of a job; for the job itself if it is not an
        array."""
        text = self.ask("scontrol", "show", "job", "--oneliner", job)
        return [dict(re.findall(r"(\w+)=(\S*)", line)) for line in text.splitlines()]

    def wait_for(self, job):
        """Waits until all tasks of a job have ended, and returns them."""
        waiting = ("squeue", "--noheader", f"--jobs={job}")
        self.wait_until(lambda: not self.ask(*waiting, check=False).strip())
        return self.tasks(job)

    def state(self):
        """Returns a text about the cluster's state, for failure reports."""
        text = self.ask("squeue", check=False) + self.ask("sinfo", check=False)
        for name in sorted(os.listdir(self.folder)):
            if name.endswith((".log", ".out")):
                with open(f"{self.folder}/{name}", encoding="utf-8", errors="replace") as log:
                    text += f"--- {name}\n" + "".join(log.readlines()[-15:])
        return text

    def stop(self):
        for daemon in reversed(self.daemons):
            daemon.terminate()
            try:
                daemon.wait(5)
            except subprocess.TimeoutExpired:
                daemon.kill()
