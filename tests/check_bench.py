#!/usr/bin/env python3
"""nebel bench runs, and writes figures that programs can read. Whether they are good is no question here."""

import json
import math
import os
import pathlib
import subprocess
import tempfile
import unittest

NEBEL = os.environ["NEBEL"]


def bench(*words):
    return subprocess.run([NEBEL, "bench", *map(str, words)], capture_output=True, text=True, timeout=500)


class BenchTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="nebel-check-")
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name) / "figures.json"

    def test_every_group_gives_figures(self):
        done = bench("--quick", "--json", self.file)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        report = json.loads(self.file.read_text())
        self.assertTrue(report["quick"])
        for key in ("nebel", "processor", "compiler"):
            self.assertTrue(report[key])
        self.assertGreaterEqual(len({figure["group"] for figure in report["figures"]}), 5)
        for figure in report["figures"]:
            self.check_figure(figure, done.stdout)

    def check_figure(self, figure, table):
        self.assertIn(figure["group"], table)
        self.assertIn(figure["name"], table)
        self.assertGreaterEqual(figure["value"], 0)
        self.assertNotIn("met", figure, "a quick run judges nothing")
        if "floor" in figure:
            self.assertGreater(figure["floor"]["value"], 0)
            self.assertTrue(math.isclose(figure["ratio"], figure["value"] / figure["floor"]["value"], rel_tol=1e-4))

    def test_one_group_alone(self):
        done = bench("--quick", "--group", "segments", "--json", self.file)
        self.assertEqual(done.returncode, 0, done.stderr)
        units = {figure["unit"] for figure in json.loads(self.file.read_text())["figures"]}
        self.assertEqual(units, {"M segments/s", "GB/s"})

    def test_opengl_gives_figures(self):
        done = bench("--quick", "--device", "gl", "--json", self.file)
        if "built without OpenGL" in done.stderr:
            self.skipTest("built without OpenGL")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(done.stderr, "")
        figures = json.loads(self.file.read_text())["figures"]
        self.assertGreaterEqual(len(figures), 10)
        for figure in figures:
            self.assertIn(figure["name"], done.stdout)
            self.assertTrue(math.isfinite(figure["value"]))

    def test_particles_in_opengl_are_judged_by_sprites(self):
        done = bench("--quick", "--device", "gl", "--group", "particles", "--json", self.file)
        if "built without OpenGL" in done.stderr:
            self.skipTest("built without OpenGL")
        self.assertEqual(done.returncode, 0, done.stderr)
        figures = json.loads(self.file.read_text())["figures"]
        floors = [figure["floor"]["name"] for figure in figures if "floor" in figure]
        self.assertEqual(floors, 2 * ["additive sprites", "additive sprites without a surface"])

    def test_planets_in_opengl_are_judged_by_a_copy(self):
        done = bench("--quick", "--device", "gl", "--group", "planet", "--json", self.file)
        if "built without OpenGL" in done.stderr:
            self.skipTest("built without OpenGL")
        self.assertEqual(done.returncode, 0, done.stderr)
        figures = json.loads(self.file.read_text())["figures"]
        floors = [figure["floor"]["name"] for figure in figures if not figure["group"].startswith("Published")]
        self.assertEqual(floors, 4 * ["a copy of the picture"])
        self.assertGreater(len(figures), 4)  # what others have published

    def test_wrong_calls(self):
        for words in (["--group", "nothing"], ["scene.json"], ["--fast"], ["--device", "none"],
                      ["--device", "gl", "--group", "segments"]):
            done = bench(*words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertEqual(done.stdout, "")

    def test_a_file_that_cannot_be_written_is_known_before_the_work(self):
        done = bench("--json", self.file.parent / "none" / "figures.json")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stdout, "")
        self.assertIn("figures.json", done.stderr)


if __name__ == "__main__":
    unittest.main()
