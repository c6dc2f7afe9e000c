#!/usr/bin/env python3
"""Uses `nebel view` as people do, on a screen of its own: pictures, mouse, keys, sliders, files that change.

Left out, with a message, where there is no Xvfb, xdotool or viewer; an error where CI is set.
"""

import json
import os
import re
import shutil
import subprocess
import time
import unittest

from check_cli import FOG, NEBEL, PictureCase, nebel

# As in check_gl_device.py.
os.environ["ASAN_OPTIONS"] = "detect_leaks=0"

ROUNDING = 0.004  # a byte: where light is at the edge of one
WAIT = 120  # s; software OpenGL on a busy machine


def find_missing():
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if "built without the viewer" in nebel("view", "none.json").err:
        missing.append("the viewer in this build")
    return ", ".join(missing)


class Screen:
    """An X server without a screen."""

    def __init__(self):
        read, write = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp",
                                        "-noreset"],
                                       pass_fds=[write], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.name = ":" + pipe.readline().strip()

    def close(self):
        self.server.terminate()
        self.server.wait(WAIT)


class Viewer:
    """A viewer that is used with mouse and keys."""

    def __init__(self, case, *words):
        self.case = case
        self.controls = case.folder / "controls.txt"
        self.log = case.folder / "log.txt"
        self.environment = {**os.environ, "DISPLAY": case.screen.name}
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [NEBEL, "view", str(case.scene), "--size", "560x420", "--controls", str(self.controls), *map(str, words)],
                stderr=log, env=self.environment, cwd=case.folder)
        case.addCleanup(self.close)
        self.wait(lambda: self.controls.exists() and "Home" in self.controls.read_text(), "a window")
        self.window = self.xdotool("search", "--sync", "--onlyvisible", "--name", "nebel$").split()[0]
        self.xdotool("windowfocus", "--sync", self.window, "sleep", 0.5)

    def xdotool(self, *words):
        return subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, stdout=subprocess.PIPE,
                              timeout=WAIT).stdout.decode()

    def wait(self, is_done, what):
        end = time.monotonic() + WAIT
        while not is_done():
            self.case.assertIsNone(self.process.poll(), f"the viewer has ended before {what}: {self.log.read_text()}")
            self.case.assertLess(time.monotonic(), end, f"{what} does not come: {self.log.read_text()}")
            time.sleep(0.02)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def end(self):
        self.key("ctrl+q")
        self.case.assertEqual(self.process.wait(WAIT), 0, self.log.read_text())

    def key(self, name):
        self.xdotool("key", name)

    def drag(self, x, y, to_x, to_y, button=1):
        self.xdotool("mousemove", "--window", self.window, x, y, "sleep", 0.2, "mousedown", button, "sleep", 0.2,
                     "mousemove", "--window", self.window, to_x, to_y, "sleep", 0.2, "mouseup", button, "sleep", 0.2)

    def said(self, text):
        return self.log.read_text().count(text)

    def say(self, text, act):
        """Does something, and waits until the viewer says so."""
        before = self.said(text)
        act()
        self.wait(lambda: self.said(text) > before, f"'{text}'")

    def take_picture(self, key="F12"):
        """Once it is complete."""
        self.say("view: saved nebel-", lambda: self.key(key))
        return self.case.folder / re.findall(r"saved (nebel-\d+\.png)", self.log.read_text())[-1]

    def place(self, name):
        """Where a control is: x, y, width, height; once it stays there."""
        found = []

        def find():
            found.append([line[:-len(name) - 1] for line in self.controls.read_text().splitlines()
                          if line.endswith(" " + name)])
            time.sleep(0.3)
            return len(found) > 1 and found[-1] and found[-1] == found[-2]

        self.wait(find, f"the control {name}")
        return [int(number) for number in found[-1][0].split()]

    def press(self, name, share=0.5):
        x, y, width, height = self.place(name)
        self.xdotool("mousemove", "--window", self.window, int(x + share * width), y + height // 2, "sleep", 0.2, "mousedown",
                     1, "sleep", 0.2, "mouseup", 1, "sleep", 0.2)


class ViewTest(PictureCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        missing = find_missing()
        if missing and os.environ.get("CI"):
            raise AssertionError(f"missing: {missing}; scripts/install_packages.sh test")
        if missing:
            raise unittest.SkipTest(f"nebel view is not tried; missing: {missing}")
        cls.screen = Screen()
        cls.addClassCleanup(cls.screen.close)

    def same(self, a, b, most):
        return nebel("compare", a, b, "--fail-above", most).returncode == 0


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
                "wheel": lambda: viewer.xdotool("mousemove", "--window", viewer.window, 400, 300, "click", 4, "sleep", 0.2),
                "fly": lambda: viewer.xdotool("keydown", "w", "sleep", 0.3, "keyup", "w", "sleep", 0.2)}
        for name, act in ways.items():
            with self.subTest(name):
                act()
                self.assertFalse(self.same(first, viewer.take_picture(), ROUNDING))
                viewer.press("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), ROUNDING))
        viewer.end()

    def test_the_window_changes_its_size(self):
        viewer = Viewer(self)
        viewer.take_picture()
        viewer.xdotool("windowsize", "--sync", viewer.window, 300, 220, "sleep", 0.3)
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "300x220"))
        self.assertTrue(self.same(viewer.take_picture(), self.folder / "render.png", ROUNDING))
        viewer.end()


class FogTest(ViewTest):
    def draw(self, name):
        self.assert_done(self.render(name, "--device", "gl", "--size", "560x420"))
        return self.folder / name

    def test_a_slider_changes_the_picture_and_the_file(self):
        self.scene.write_text(self.scene.read_text().replace('"fog"', '/* thin */ "fog"'))
        before = self.scene.read_text()
        first = self.draw("first.png")
        viewer = Viewer(self)
        viewer.press("fog[0].visibility", 0.2)
        changed = viewer.take_picture()
        self.assertFalse(self.same(first, changed, ROUNDING))
        self.assertEqual(self.scene.read_text(), before, "nothing is saved before it is asked for")
        viewer.say(f"view: saved {self.scene}", lambda: viewer.press("Save"))
        after = self.scene.read_text()
        number = re.search(r'"extinction": ([0-9.e-]+)', after)
        self.assertGreater(float(number[1]), 0.2)
        self.assertEqual(after.replace(number[0], '"extinction": 0.1'), before, "one number has changed, and nothing else")
        self.assertTrue(self.same(changed, self.draw("saved.png"), ROUNDING))
        viewer.end()

    def test_the_file_changes(self):
        viewer = Viewer(self)
        first = viewer.take_picture()
        viewer.drag(400, 300, 450, 280)
        turned = viewer.take_picture()
        again = f"view: read {self.scene} again"
        viewer.say(again, lambda: self.scene.write_text(self.scene.read_text() + " "))
        self.assertFalse(self.same(first, turned, ROUNDING))
        self.assertTrue(self.same(viewer.take_picture(), turned, ROUNDING), "the view stays where it is")
        viewer.say(again, lambda: self.write_scene("scene.json", [{**FOG, "extinction": 0.4}], background=[0.2, 0.4, 0.8]))
        self.assertTrue(self.same(viewer.take_picture(), self.draw("second.png"), ROUNDING))
        viewer.say("scene.json:1:", lambda: self.scene.write_text("{"))
        viewer.say(again, lambda: self.write_scene("scene.json", [FOG], ambient=1))
        viewer.press("fog[0].visibility", 0.2)
        mine = viewer.take_picture()
        count = viewer.said(again)
        self.write_scene("scene.json", [{**FOG, "extinction": 0.3}])
        time.sleep(1)
        self.assertTrue(self.same(viewer.take_picture(), mine, ROUNDING))
        self.assertEqual(viewer.said(again), count, "changes are not lost because the file has others")
        viewer.say(again, lambda: viewer.key("F5"))
        self.assertTrue(self.same(viewer.take_picture(), self.draw("third.png"), ROUNDING))
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
        viewer.end()


if __name__ == "__main__":
    unittest.main()
