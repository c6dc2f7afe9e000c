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
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "800x600x24", "-nolisten", "tcp"],
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
        """Where a control is: x, y, width, height."""
        found = []

        def find():
            found[:] = [line.split(" ", 4) for line in self.controls.read_text().splitlines() if line.endswith(" " + name)]
            return found and found[0][4] == name

        self.wait(find, f"the control {name}")
        return [int(number) for number in found[0][:4]]

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
        self.assertTrue(self.same(viewer.take_picture(), self.folder / "render.png", 0.002))
        viewer.end()

    def test_screenshot_of_the_window(self):
        done = nebel("view", self.scene, "--size", "560x420", "--screenshot", "window.png", cwd=self.folder,
                     env={"DISPLAY": self.screen.name})
        self.assert_done(done)
        self.assertEqual(done.err, "")
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "560x420"))
        self.assertFalse(self.same(self.folder / "window.png", self.folder / "render.png", 0.002))

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
        self.assertFalse(self.same(first, turned, 0.002), "a drag turns")
        viewer.key("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), 0.002), "Home brings the camera back")
        ways = {"pan": lambda: viewer.drag(400, 300, 450, 280, 2), "look": lambda: viewer.drag(400, 300, 450, 280, 3),
                "wheel": lambda: viewer.xdotool("mousemove", "--window", viewer.window, 400, 300, "click", 4, "sleep", 0.2),
                "fly": lambda: viewer.xdotool("keydown", "w", "sleep", 0.3, "keyup", "w", "sleep", 0.2)}
        for name, act in ways.items():
            with self.subTest(name):
                act()
                self.assertFalse(self.same(first, viewer.take_picture(), 0.002))
                viewer.press("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), 0.002))
        viewer.end()


if __name__ == "__main__":
    unittest.main()
