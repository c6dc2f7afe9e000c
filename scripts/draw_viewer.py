#!/usr/bin/env python3
"""Draws pictures of the window for docs/viewer.md, with its controls as people leave them.

    scripts/draw_viewer.py BUILD [FOLDER]

BUILD holds the program; Xvfb and xdotool are needed. Without FOLDER the pictures of docs/pictures are replaced.
"""

import json
import os
import pathlib
import shutil
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
if len(sys.argv) not in (2, 3):
    sys.exit(__doc__)
os.environ["NEBEL"] = str(pathlib.Path(sys.argv[1]).resolve() / "nebel")
os.environ["NEBEL_SOURCE"] = str(ROOT)
TARGET = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else ROOT / "docs/pictures").resolve()
sys.path.insert(0, str(ROOT / "tests"))

from view_case import Viewer, ViewTest  # noqa: E402

CUBE = """v -2 0 -2\nv 2 0 -2\nv 2 4 -2\nv -2 4 -2\nv -2 0 2\nv 2 0 2\nv 2 4 2\nv -2 4 2
f 5 6 7 8\nf 2 1 4 3\nf 6 2 3 7\nf 1 5 8 4\nf 8 7 3 4\nf 1 2 6 5\n"""

# The volume of docs/scene-file.md.
MIST = {"name": "rising mist", "shape": {"type": "world"}, "visibility": 30, "source": "#c8d0d8",
        "density": {"type": "height", "scale_height": 1},
        "keys": [{"frame": 0, "visibility": 200}, {"frame": 48, "density": {"scale_height": 6}},
                 {"frame": 96, "source": "#f0c8a0", "shape": {"transform": {"position": [10, 0, 0]}}}]}


class DrawViewer(ViewTest):
    def keep(self, viewer, name):
        viewer.xdotool("mousemove", "--window", viewer.window, 700, 500)  # no text beside the mouse
        viewer.settle()
        shutil.move(viewer.take_picture("shift+F12"), TARGET / name)
        viewer.end()

    def test_split(self):
        self.scene = ROOT / "examples/scenes/clearing.json"
        viewer = Viewer(self, "--size", "960x600")
        viewer.choose("drawn by", "CPU | OpenGL")
        self.keep(viewer, "viewer-split.png")

    def test_keys(self):
        (self.folder / "cube.obj").write_text(CUBE)
        self.scene = self.folder / "keys.json"
        self.scene.write_text(json.dumps({
            "nebel": 1, "camera": {"position": [9, 5, 16], "look_at": [-4, 2, 0], "vertical_fov": 48}, "background": [0.3, 0.4, 0.6],
            "sun": {"direction": [0.5, 0.7, 0.4], "irradiance": 2}, "ambient": 0.3,
            "models": [{"file": "cube.obj", "color": [0.6, 0.12, 0.1]}], "fog": [MIST]}))
        viewer = Viewer(self, "--size", "760x840", "--frame", 30)
        viewer.press("fog[0].transform")  # closed: there is room for the keys
        self.keep(viewer, "viewer-keys.png")

    def test_planet(self):
        self.scene = self.folder / "evening.json"
        self.scene.write_text(json.dumps({
            "nebel": 1, "camera": {"position": [0, 1200, 0], "look_at": [-35, 1200, -100], "vertical_fov": 60},
            "sun": {"direction": [-0.1, 0.06, -1], "irradiance": 20}, "planet": {"model": "physical", "preset": "earth"}, "fog": []}))
        viewer = Viewer(self, "--size", "960x600")
        viewer.press("Planet")
        viewer.press("planet[0].components[1].open")
        viewer.type("planet[0].components[1].density", "0.02", 0.1)
        self.keep(viewer, "viewer-planet.png")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
