#!/usr/bin/env python3
"""Uses `nebel view` as people do, on a screen of its own: pictures, mouse, keys, sliders, files that change.

Left out, with a message, where there is no Xvfb, xdotool or viewer; an error where CI is set.
"""

import ctypes
import json
import os
import pathlib
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
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", "800x1000x24", "-nolisten", "tcp",
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

    def __init__(self, case, *words, env=None):
        self.case = case
        self.controls = case.folder / "controls.txt"
        self.log = case.folder / "log.txt"
        self.environment = {**os.environ, "DISPLAY": case.screen.name, **(env or {})}
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [NEBEL, "view", str(case.scene), "--size", "560x420", "--controls", str(self.controls), *map(str, words)],
                stderr=log, env=self.environment, cwd=case.folder)
        case.addCleanup(self.close)
        self.wait(lambda: self.controls.exists() and "Home" in self.controls.read_text(), "a window")
        self.find_window()

    def find_window(self):
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

    def settle(self):
        """Waits until the window has been drawn five times: a press and its end take a turn each, what follows two more, and one
        may be under way. Each time the list is emptied and filled."""
        for _ in range(10):
            before = self.controls.stat().st_mtime_ns
            self.wait(lambda: self.controls.stat().st_mtime_ns != before, "another frame")

    def place(self, name):
        """Where a control is: x, y, width, height."""
        found = []

        def find():
            lines = self.controls.read_text().splitlines()
            found.extend(line[:-len(name) - 1] for line in lines if line.endswith(" " + name))
            return found

        self.wait(find, f"the control {name}")
        return [int(number) for number in found[0].split()]

    def press(self, name, share=0.5):
        x, y, width, height = self.place(name)
        self.xdotool("mousemove", "--window", self.window, int(x + share * width), y + height // 2, "sleep", 0.1, "mousedown",
                     1, "sleep", 0.1, "mouseup", 1)
        self.settle()

    def choose(self, name, word):
        self.press(name)
        self.press(f"{name}: {word}")

    def type(self, name, text, share=0.5):
        """Into a number, as Ctrl + click allows."""
        x, y, width, height = self.place(name)
        self.xdotool("mousemove", "--window", self.window, int(x + share * width), y + height // 2, "sleep", 0.2, "keydown",
                     "ctrl", "mousedown", 1, "sleep", 0.2, "mouseup", 1, "keyup", "ctrl")
        self.wait(lambda: "(typing)" in self.controls.read_text(), f"a cursor in {name}")
        self.xdotool("type", "--delay", 50, text)
        self.xdotool("key", "Return")
        self.wait(lambda: re.match(r"(?!.*\(typing\))(?s:.*)Save", self.controls.read_text()), f"the end of {name}")
        self.settle()

    def save(self):
        self.say(f"view: saved {self.case.scene}", lambda: self.key("ctrl+s"))
        return json.loads(self.case.scene.read_text())

    def busy_seconds(self):
        """Of the processor, so far."""
        words = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


class Manager:
    """What a window manager does when a window is minimised."""

    def __init__(self, screen):
        self.x = ctypes.CDLL("libX11.so.6")
        self.x.XOpenDisplay.restype = ctypes.c_void_p
        self.x.XInternAtom.restype = ctypes.c_ulong
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(screen.name.encode()))
        self.state = ctypes.c_ulong(self.x.XInternAtom(self.display, b"WM_STATE", 0))

    def close(self):
        self.x.XCloseDisplay(self.display)

    def set_state(self, window, state, change):
        data = (ctypes.c_ulong * 2)(state, 0)
        self.x.XChangeProperty(self.display, ctypes.c_ulong(window), self.state, self.state, 32, 0, data, 2)
        change(self.display, ctypes.c_ulong(window))
        self.x.XSync(self.display, 0)

    def minimise(self, window):
        self.set_state(int(window), 3, self.x.XUnmapWindow)

    def restore(self, window):
        self.set_state(int(window), 1, self.x.XMapWindow)


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

    def draw(self, name):
        self.assert_done(self.render(name, "--device", "gl", "--size", "560x420"))
        return self.folder / name

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
        viewer.xdotool("windowsize", "--sync", viewer.window, 1, 1, "sleep", 0.5)
        viewer.xdotool("windowsize", "--sync", viewer.window, 300, 220, "sleep", 0.3)
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
        time.sleep(2)
        self.assertLess(viewer.busy_seconds() - before, 0.2)
        again = f"view: read {self.scene} again"
        viewer.say(again, lambda: manager.restore(viewer.window))
        viewer.find_window()
        self.assertTrue(self.same(viewer.take_picture(), self.draw("render.png"), ROUNDING))
        viewer.end()


class FogTest(ViewTest):

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


class EditTest(ViewTest):
    def test_volumes_come_go_and_come_back(self):
        viewer = Viewer(self, "--size", "400x900")
        first = self.scene.read_text()
        viewer.press("fog[0].Duplicate")
        viewer.press("fog[0].open")
        viewer.choose("fog[1].shape", "sphere")
        viewer.type("fog[1].radius", "2.5")
        viewer.type("fog[1].extinction", "0", 0.1)
        fog = viewer.save()["fog"]
        self.assertEqual(fog[0], json.loads(first)["fog"][0])
        self.assertEqual(fog[1]["shape"], {"type": "sphere", "center": [0, 0, 0], "radius": 2.5})
        self.assertEqual(fog[1]["extinction"], [0, 0.1, 0.1])
        self.assertTrue(self.same(viewer.take_picture(), self.draw_tall("second.png"), ROUNDING))
        viewer.press("fog[1].Remove")
        viewer.place("Undo")
        viewer.key("ctrl+z")
        viewer.press("Redo")
        self.assertEqual(viewer.save(), json.loads(first))
        self.assertTrue(self.same(viewer.take_picture(), self.draw_tall("first.png"), ROUNDING))
        viewer.end()

    def draw_tall(self, name, *words):
        self.assert_done(self.render(name, "--device", "gl", "--size", "400x900", *words))
        return self.folder / name

    def test_parts_planes_and_what_has_no_number(self):
        planes = [[1, 0, 0, 2], [-1, 0, 0, 2], [0, 1, 0, 2], [0, -1, 0, 2], [0, 0, 1, 2], [0, 0, -1, 2]]
        shape = {"type": "union", "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 2},
                                             {"type": "convex", "planes": planes}]}
        self.scene = self.write_scene("scene.json", [{"shape": shape, "visibility": 8, "cutoff": 90, "source": 0.5}])
        viewer = Viewer(self, "--size", "400x900")
        viewer.type("fog[0].parts[0].radius", "1.5")
        viewer.press("fog[0].parts[0].open")
        viewer.type("fog[0].parts[1].planes[1].distance", "3")
        viewer.type("fog[0].parts[1].planes[0].normal", "0.5", 0.7)
        fog = viewer.save()["fog"][0]
        planes[1][3] = 3
        planes[0][2] = 0.5
        self.assertEqual(fog["shape"]["shapes"], [{"type": "sphere", "center": [0, 0, 0], "radius": 1.5},
                                                  {"type": "convex", "planes": planes}])
        self.assertEqual(fog["visibility"], 8)
        viewer.press("fog[0].parts[1].open")
        viewer.press("fog[0].parts[0].open")
        viewer.press("fog[0].parts[0].transform")
        viewer.type("fog[0].parts[0].rotation", "90", 0.1)
        viewer.press("fog[0].parts[0].open")
        viewer.type("fog[0].cutoff", "0")
        for share in (0.1, 0.4, 0.7):
            viewer.type("fog[0].extinction", "0", share)
        fog = viewer.save()["fog"][0]
        self.assertNotIn("cutoff", fog)
        self.assertNotIn("visibility", fog)
        self.assertEqual(fog["extinction"], 0)
        for is_now, wanted in zip(fog["shape"]["shapes"][0]["transform"]["rotation"], [0, 0.5 ** 0.5, 0, 0.5 ** 0.5]):
            self.assertAlmostEqual(is_now, wanted)
        viewer.end()

    def test_nebulae_cells_and_the_files_of_a_scene(self):
        cell = {"name": "room", "shape": {"type": "box", "min": [-2, -2, -2], "max": [-1, 2, 2]}, "density": 0.5, "color": 0.2}
        nebula = {"name": "dust", "shape": {"type": "sphere", "center": [0, 0, -3], "radius": 2}, "count": 12,
                  "size": [0.8, 1.2], "absorption": 3, "emission": 0.5}
        self.scene = self.write_scene("scene.json", [FOG], models=[{"file": "triangle.obj"}], nebula=[nebula],
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]}, max_opacity=0.4, ambient=1,
                                      sun={"direction": [0, 0, 1], "irradiance": 3}, cells={"cells": [cell]})
        viewer = Viewer(self, "--size", "400x740")
        balls = viewer.take_picture()
        self.assertTrue(self.same(balls, self.draw_small("balls.png"), ROUNDING), "the limit of all fog counts, too")
        viewer.choose("particles", "five-tap discs")
        taps = self.draw_small("taps.png", "--method", "five-tap")
        self.assertTrue(self.same(viewer.take_picture(), taps, 0.0028))
        self.assertFalse(self.same(balls, taps, 0.0028))
        viewer.choose("particles", "fog: exact")
        exact = viewer.take_picture()
        self.assertFalse(self.same(exact, balls, ROUNDING))
        viewer.press("fog[0].open")
        viewer.press("nebula[0].open")
        viewer.type("nebula[0].seed", "5")
        self.assertFalse(self.same(viewer.take_picture(), exact, ROUNDING))
        viewer.press("nebula[0].open")
        viewer.press("cells[0].open")
        viewer.type("cells[0].density", "2")
        saved = viewer.save()
        self.assertEqual(saved["nebula"], [{**nebula, "seed": 5}])
        self.assertEqual(saved["cells"], {"cells": [{**cell, "density": 2}]})
        triangle = self.folder / "triangle.obj"
        viewer.say(f"view: read {self.scene} again", lambda: triangle.write_text(triangle.read_text().replace("0 2", "0 1")))
        viewer.choose("particles", "balls: fast")
        self.assertTrue(self.same(viewer.take_picture(), self.draw_small("small.png"), ROUNDING))
        viewer.end()

    def draw_small(self, name, *words):
        self.assert_done(self.render(name, "--device", "gl", "--size", "400x740", *words))
        return self.folder / name

    def test_a_file_that_somebody_else_has_changed(self):
        viewer = Viewer(self)
        viewer.type("fog[0].visibility", "9")
        theirs = json.loads(self.scene.read_text())
        theirs["ambient"] = 2
        self.scene.write_text(json.dumps(theirs))
        viewer.place("Save mine into it")
        self.assertEqual(json.loads(self.scene.read_text()), theirs, "nobody has been asked")
        viewer.say(f"view: saved {self.scene}", lambda: viewer.press("Save mine into it"))
        ours = json.loads(self.scene.read_text())
        self.assertEqual(ours["ambient"], 2)
        self.assertAlmostEqual(ours["fog"][0]["extinction"], 0.3329, places=3)
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
        large = Viewer(self, "--ui-scale", 2).place("Save")
        self.assertAlmostEqual(large[3] / small[3], 2, delta=0.2)
        self.assertAlmostEqual(large[2] / small[2], 2, delta=0.2)


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
