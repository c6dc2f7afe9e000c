#!/usr/bin/env python3
"""Uses `nebel view` as people do: pictures, mouse and keys, windows of all sizes, a driver that is lost."""

import os
import pathlib
import re
import struct
import subprocess
import time
import unittest

from check_cli import FOG, nebel
from view_case import ROUNDING, WAIT, Manager, Viewer, ViewTest


class PicturesTest(ViewTest):
    def test_the_picture_is_that_of_render(self):
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "560x420"))
        viewer = Viewer(self)
        picture = viewer.take_picture()
        self.assertTrue(self.same(picture, self.folder / "render.png", ROUNDING))
        compared = nebel("compare", picture, self.folder / "render.png").out
        self.assertLess(float(re.search(r"RMSE: (\S+)", compared)[1]), 1e-4, "bytes are rounded in the same pattern")
        viewer.end()

    def test_screenshot_of_the_window(self):
        done = nebel("view", self.scene, "--size", "560x420", "--screenshot", "window.png", cwd=self.folder,
                     env={"DISPLAY": self.screen.name})
        self.assert_done(done)
        self.assertEqual(done.err, "")
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "560x420"))
        self.assertFalse(self.same(self.folder / "window.png", self.folder / "render.png", ROUNDING))

    def test_what_goes_wrong_at_the_start(self):
        self.assert_failed(nebel("view", self.scene, env={"DISPLAY": ""}), "no screen", "nebel render")
        self.assert_failed(nebel("view", self.scene, env={"DISPLAY": self.screen.name, "MESA_GL_VERSION_OVERRIDE": "2.1"}),
                           "no window with OpenGL 3.3 core", "the driver has OpenGL 2.1")
        self.assert_failed(nebel("view", "none.json", env={"DISPLAY": self.screen.name}), "none.json")
        self.assert_misused(nebel("view", self.scene, "--size", "5x5"), "--size", "64 to 8192")


class CameraTest(ViewTest):
    def test_mouse_keys_and_home(self):
        viewer = Viewer(self)
        first = viewer.take_picture()
        viewer.drag(400, 300, 450, 280)
        turned = viewer.take_picture()
        self.assertFalse(self.same(first, turned, ROUNDING), "a drag turns")
        viewer.key("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), ROUNDING), "Home brings the camera back")
        ways = {"pan": lambda: viewer.drag(400, 300, 450, 280, 2), "look": lambda: viewer.drag(400, 300, 450, 280, 3),
                "wheel": lambda: viewer.xdotool("mousemove", "--window", viewer.window, 400, 300, "click", 4),
                "fly": lambda: viewer.xdotool("keydown", "w", "sleep", 0.2, "keyup", "w")}
        for name, act in ways.items():
            with self.subTest(name):
                act()
                viewer.settle()
                self.assertFalse(self.same(first, viewer.take_picture(), ROUNDING))
                viewer.press("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), ROUNDING))
        viewer.end()

    def test_the_window_changes_its_size(self):
        viewer = Viewer(self)
        viewer.take_picture()
        viewer.xdotool("windowsize", "--sync", viewer.window, 300, 220)
        viewer.settle()
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "300x220"))
        self.assertTrue(self.same(viewer.take_picture(), self.folder / "render.png", ROUNDING))
        viewer.xdotool("windowsize", "--sync", viewer.window, 1, 1)
        time.sleep(0.3)
        viewer.xdotool("windowsize", "--sync", viewer.window, 300, 220)
        viewer.settle()
        self.assertTrue(self.same(viewer.take_picture(), self.folder / "render.png", ROUNDING), "after one pixel")
        viewer.end()

    def test_a_minimised_window_rests(self):
        manager = Manager(self.screen)
        self.addCleanup(manager.close)
        viewer = Viewer(self)
        viewer.take_picture()
        manager.minimise(viewer.window)
        time.sleep(0.5)
        self.write_scene("scene.json", [{**FOG, "extinction": 0.3}])
        before = viewer.busy_seconds()
        time.sleep(1)
        self.assertLess(viewer.busy_seconds() - before, 0.2)
        again = f"view: read {self.scene} again"
        viewer.say(again, lambda: manager.restore(viewer.window))
        viewer.find_window()
        self.assertTrue(self.same(viewer.take_picture(), self.draw("render.png"), ROUNDING))
        viewer.end()


class DriverTest(ViewTest):
    def build(self):
        library = self.folder / "lost_context.so"
        source = pathlib.Path(__file__).with_name("lost_context.c")
        subprocess.run([os.environ.get("CC", "cc"), "-shared", "-fPIC", "-o", library, source, "-lepoxy"], check=True)
        return library

    def test_a_lost_context_comes_back_once(self):
        switch = self.folder / "lose"
        env = {"LD_PRELOAD": str(self.build()), "NEBEL_LOSE_CONTEXT": str(switch),
               "ASAN_OPTIONS": "detect_leaks=0:verify_asan_link_order=0"}
        viewer = Viewer(self, env=env)
        viewer.press("fog[0].visibility", 0.2)
        changed = viewer.take_picture()
        viewer.say("driver was reset; the window has been opened again", switch.touch)
        viewer.find_window()
        self.assertTrue(self.same(viewer.take_picture(), changed, ROUNDING), "what was changed is still there")
        switch.touch()
        self.assertEqual(viewer.process.wait(WAIT), 1)
        self.assertIn("reset twice", viewer.log.read_text())


class SizeTest(ViewTest):
    def test_controls_are_as_large_as_wanted(self):
        viewer = Viewer(self)
        small = viewer.place("Save")
        viewer.end()
        for wanted, dpi, words in ((2, 96, ["--ui-scale", 2]), (2, 192, []), (1.5, 144, []), (1, 192, ["--ui-scale", 1])):
            with self.subTest(dpi=dpi, words=words):
                self.screen.set_dpi(dpi)
                viewer = Viewer(self, *words)
                large = viewer.place("Save")
                self.assertAlmostEqual(large[3] / small[3], wanted, delta=0.1 * wanted)
                self.assertAlmostEqual(large[2] / small[2], wanted, delta=0.1 * wanted)
                picture = viewer.take_picture().read_bytes()
                self.assertEqual(struct.unpack(">II", picture[16:24]), (560, 420), "a pixel of the picture is one of the screen")
                viewer.end()


class CompareTest(ViewTest):
    def test_both_renderers_draw_the_same(self):
        black = self.write_scene("black.json", [])
        self.assert_done(nebel("render", black, "-o", "black.png", "--size", "560x420", cwd=self.folder))
        black = self.folder / "black.png"
        viewer = Viewer(self)
        for plane in (1, 2, 3, 4):
            with self.subTest(plane=plane):
                viewer.key(plane)
                drawn = viewer.take_picture()
                self.assertFalse(self.same(drawn, black, 0.02))
                viewer.key("c")
                split = viewer.take_picture()
                self.assertTrue(self.same(split, drawn, 0.05), "one sample and a line are the difference")
                self.assertFalse(self.same(split, drawn, 0.0001))
                viewer.key("c")
                self.assertTrue(self.same(viewer.take_picture(), black, 0.03), "sixteen times the difference")
                viewer.key("c")
                traced = viewer.take_picture()
                self.assertTrue(self.same(traced, drawn, 0.05), "one sample is the difference")
                self.assertFalse(self.same(traced, drawn, 0.0001))
                viewer.key("c")
        viewer.end()


if __name__ == "__main__":
    unittest.main()
