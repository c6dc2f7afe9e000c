#!/usr/bin/env python3
"""OpenVDB files: the same fog as the NanoVDB file that OpenVDB's own tool makes of them, and what is refused; in builds
without OpenVDB the message that says so."""

import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import unittest

NEBEL = os.environ["NEBEL"]
HAS_OPENVDB = "no OpenVDB" not in subprocess.run([NEBEL, "info"], capture_output=True, text=True, check=True).stdout


def rays():
    """Lines through and past a box from (0, 0, 0) to (1, 2, 3)."""
    dice = random.Random(4)
    pairs = ([[dice.uniform(-1, 4) for _ in range(3)], [dice.uniform(0, 3) for _ in range(3)]] for _ in range(300))
    lines = (a + [y - x for x, y in zip(a, b)] + [10] for a, b in pairs)
    return "".join(" ".join(map(repr, line)) + "\n" for line in lines)


class Vdb(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nebel-vdb-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def trace(self, name, **more):
        scene = self.folder / "scene.json"
        density = {"type": "grid", "file": name, **more}
        scene.write_text(json.dumps({"nebel": 1, "fog": [{
            "shape": {"type": "box", "min": [0, 0, 0], "max": [1, 2, 3]}, "extinction": 2, "source": 1, "density": density}]}))
        return subprocess.run([NEBEL, "trace", str(scene)], input=rays(), capture_output=True, text=True, timeout=120)

    def assert_refused(self, name, *words, **more):
        done = self.trace(name, **more)
        self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
        for word in words + (name, "fog[0].density.file"):
            self.assertIn(word, done.stderr)

    @unittest.skipIf(HAS_OPENVDB, "this build has OpenVDB")
    def test_builds_without_it_say_what_to_do(self):
        (self.folder / "a.vdb").write_bytes(b"any")
        self.assert_refused("a.vdb", ".vdb", "-DNEBEL_OPENVDB=ON", "libopenvdb-dev", "vdb_tool -read in.vdb -write out.nvdb")


@unittest.skipUnless(HAS_OPENVDB, "this build has no OpenVDB")
class Files(Vdb):
    def make(self, *words):
        subprocess.run(["vdb_tool", *words], cwd=self.folder, check=True, capture_output=True, timeout=120)

    def setUp(self):
        super().setUp()
        if shutil.which("vdb_tool") is None:
            self.assertNotIn("CI", os.environ, "vdb_tool is missing")
            self.skipTest("vdb_tool is missing; Debian has it in libopenvdb-tools")
        self.make("-sphere", "dim=20", "-ls2fog", "name=ball", "-write", "ball.vdb")

    def test_it_is_the_fog_of_the_nanovdb_file(self):
        self.make("-read", "ball.vdb", "-write", "ball.nvdb")
        vdb, nvdb = self.trace("ball.vdb"), self.trace("ball.nvdb")
        self.assertEqual(nvdb.returncode, 0, nvdb.stderr)
        self.assertEqual(vdb.stdout, nvdb.stdout, vdb.stderr)
        self.assertGreater(len(set(vdb.stdout.split("\n"))), 100)
        self.assertEqual(self.trace("ball.vdb", filter="nearest").stdout, self.trace("ball.nvdb", filter="nearest").stdout)

    def test_grids_have_names(self):
        listing = subprocess.run([NEBEL, "info"], capture_output=True, check=True)
        self.assertIn(b"OpenVDB 1", listing.stdout)
        self.assertEqual(self.trace("ball.vdb", grid="ball").stdout, self.trace("ball.vdb").stdout)
        self.assert_refused("ball.vdb", "holds no grid of the name smoke", grid="smoke")

    def test_level_sets_are_no_fog(self):
        self.make("-sphere", "dim=20", "-write", "distance.vdb")
        self.assert_refused("distance.vdb", "is a level set", "-ls2fog")

    def test_vectors_are_no_fog(self):
        self.make("-sphere", "dim=20", "-grad", "-write", "slope.vdb")
        self.assert_refused("slope.vdb", "holds no grid of float or double")
        self.assert_refused("slope.vdb", "its voxels are of the type vec3s", grid="grad_sphere")

    def test_damaged_files_are_refused(self):
        whole = (self.folder / "ball.vdb").read_bytes()
        (self.folder / "text.vdb").write_bytes(b"hello")
        self.assert_refused("text.vdb", "OpenVDB cannot read it")
        for size in (0, 30, 900, len(whole) // 2):
            (self.folder / "short.vdb").write_bytes(whole[:size])
            self.assert_refused("short.vdb")
        self.assert_refused("none.vdb")


if __name__ == "__main__":
    sys.exit(unittest.main())
