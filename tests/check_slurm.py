#!/usr/bin/env python3
"""The scripts of examples/cluster in a Slurm of one node, which the test starts for itself: the bytes of one process."""

import os
import pathlib
import re
import shutil
import socket
import subprocess
import time
import unittest

from check_cluster import FILM, FRAMES, LARGE, MISSING, PICTURES, ClusterCase
from check_cluster_fog import PAIRS, FogCase

SCRIPTS = pathlib.Path(os.environ["NEBEL_SOURCE"]) / "examples" / "cluster"

CONFIGURATION = """ClusterName=nebel
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/none
CredType=cred/none
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=10000
NodeName={host} NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP OverSubscribe=FORCE:4
"""


def find_missing():
    """Why there can be no Slurm here; None where there can."""
    if os.geteuid() != 0:
        return "a Slurm of one's own needs root"
    if "CI" not in os.environ and not all(map(shutil.which, ("slurmctld", "slurmd", "sbatch"))):
        return "Slurm is missing; Debian has it in slurm-wlm"
    return None


def find_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


@unittest.skipIf(find_missing(), find_missing())
class SlurmCase(ClusterCase):
    def setUp(self):
        super().setUp()
        slurm = self.folder / "slurm"
        for name in ("state", "spool"):
            (slurm / name).mkdir(parents=True)
        configuration = slurm / "slurm.conf"
        configuration.write_text(CONFIGURATION.format(host=socket.gethostname().split(".")[0], ports=find_ports(2), folder=slurm))
        self.environment = {**os.environ, "SLURM_CONF": str(configuration), "NEBEL": os.environ["NEBEL"]}
        for name in ("slurmctld", "slurmd"):
            with open(slurm / f"{name}.out", "w", encoding="utf-8") as output:
                daemon = subprocess.Popen([name, "-D", "-f", configuration], stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                                          env=self.environment)
            self.addCleanup(daemon.wait, 30)
            self.addCleanup(daemon.terminate)
        self.wait_until_idle()

    def wait_until_idle(self):
        for _ in range(100):
            seen = subprocess.run(["sinfo", "-h", "-o", "%T"], env=self.environment, capture_output=True, text=True)
            if seen.stdout.strip() == "idle":
                return
            time.sleep(0.2)
        logs = "".join(path.read_text() for path in sorted((self.folder / "slurm").glob("*.log")))
        self.fail(f"Slurm does not start: {seen.stdout}{seen.stderr}{logs}")

    def submit(self, name, script, options, kind, **environment):
        """Waits for the job; (whether it has done all, what its tasks said)."""
        folder = self.folder_of(name)
        logs = self.folder / f"logs-{time.time_ns()}"
        logs.mkdir()
        words = ["sbatch", "--wait", "-o", f"{logs}/%A_%a.log", "--cpus-per-task=1", *options, str(SCRIPTS / script),
                 *self.words(kind)]
        done = subprocess.run(words, cwd=folder, env={**self.environment, **environment}, capture_output=True, text=True, timeout=120)
        seen = "".join(path.read_text() for path in sorted(logs.iterdir()))
        return done.returncode == 0, done.stderr + seen

    def contents_of_files(self, name):
        return {path.name: path.read_bytes() for path in (self.folder / name).iterdir() if path.is_file()}


class SlurmTest(SlurmCase):
    def test_array(self):
        for kind in [PICTURES] + ([FILM] if self.has_films else []):
            expected = self.expected(kind)
            good, seen = self.submit("a-" + kind[0], "array.sbatch", ["--array=0-1"], kind, SHARDS="3")
            self.assertTrue(good, seen)
            self.assertNotEqual(self.contents_of_files("a-" + kind[0]), expected)
            good, seen = self.submit("a-" + kind[0], "array.sbatch", ["--array=2"], kind, SHARDS="3")
            self.assertTrue(good, seen)
            self.assertEqual(self.contents("a-" + kind[0]), expected)
        good, seen = self.submit("a-" + PICTURES[0], "array.sbatch", ["--array=0-1"], PICTURES)
        self.assertTrue(good, seen)
        self.assertEqual(seen.count(f"{FRAMES // 2} pictures, {FRAMES // 2} of them there already"), 2, seen)

    @unittest.skipIf(MISSING, MISSING)
    def test_mpi(self):
        expected = self.expected(LARGE)
        good, seen = self.submit("m", "mpi.sbatch", ["--ntasks-per-node=2"], LARGE)
        self.assertTrue(good, seen)
        self.assertEqual(self.contents("m"), expected)
        self.assertEqual(seen.count("7 bands"), 1, "two processes of one job")
        (self.folder / "m" / "large.png").unlink()
        (self.folder / "triangle.obj").unlink()
        good, seen = self.submit("m", "mpi.sbatch", ["--ntasks-per-node=2"], LARGE)
        self.assertFalse(good, "what fails is told")
        self.assertIn("triangle.obj", seen)


class FogSlurmTest(FogCase, SlurmCase):
    def test_array(self):
        expected = self.expected(PAIRS)
        good, seen = self.submit("a", "array.sbatch", ["--array=0-2"], PAIRS)
        self.assertTrue(good, seen)
        self.assertEqual(self.contents("a"), expected)
        (self.folder / "a/q_2.png").unlink()
        good, seen = self.submit("a", "array.sbatch", ["--array=0-2"], PAIRS)
        self.assertTrue(good, seen)
        self.assertEqual(sum(map(int, re.findall(r"(\d+) of them there already", seen))), PAIRS[2] - 1, seen)
        self.assertEqual(self.contents("a"), expected)

    @unittest.skipIf(MISSING, MISSING)
    def test_mpi(self):
        expected = self.expected(PAIRS)
        (self.folder / "depth/3.pfm").rename(self.folder / "gone.pfm")
        good, seen = self.submit("m", "mpi.sbatch", ["--ntasks-per-node=2"], PAIRS)
        self.assertFalse(good, "what fails is told")
        self.assertEqual(seen.count(f"{PAIRS[2] - 1} pictures, 1 failed"), 1, seen)
        (self.folder / "gone.pfm").rename(self.folder / "depth/3.pfm")
        good, seen = self.submit("m", "mpi.sbatch", ["--ntasks-per-node=2"], PAIRS)
        self.assertTrue(good, seen)
        self.assertIn(f"{PAIRS[2] - 1} of them there already", seen)
        self.assertEqual(self.contents("m"), expected)


if __name__ == "__main__":
    unittest.main()
