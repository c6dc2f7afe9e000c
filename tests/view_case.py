"""`nebel view` as people use it, on a screen of its own: what the tests of it share.

They are left out, with a message, where there is no Xvfb, xdotool or viewer; an error where CI is set.
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
LEAVING = "view: changes are not saved"
PAUSE = 0.05  # s, between events, as a hand would leave

# What most tests open: all controls are seen, and drawing takes a quarter of the time that it takes in a window twice as wide.
SIZE = "280x210"
SMALL_WINDOW = ("--size", SIZE, "--ui-scale", 0.5)


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

    def set_dpi(self, dpi):
        """As xrdb does for desktops: programs that start then read it."""
        x = ctypes.CDLL("libX11.so.6")
        x.XOpenDisplay.restype = ctypes.c_void_p
        x.XDefaultRootWindow.restype = ctypes.c_ulong
        display = ctypes.c_void_p(x.XOpenDisplay(self.name.encode()))
        text = f"Xft.dpi:\t{dpi}\n".encode()
        resource_manager, string = 23, 31  # of Xatom.h
        root = ctypes.c_ulong(x.XDefaultRootWindow(display))
        x.XChangeProperty(display, root, ctypes.c_ulong(resource_manager), ctypes.c_ulong(string), 8, 0, text, len(text))
        x.XCloseDisplay(display)

    def close(self):
        self.server.terminate()
        self.server.wait(WAIT)


class Viewer:
    """A viewer that is used with mouse and keys; without words its window is a SMALL_WINDOW."""

    def __init__(self, case, *words, env=None):
        self.case = case
        self.controls = case.folder / "controls.txt"
        self.log = case.folder / "log.txt"
        self.environment = {**os.environ, "DISPLAY": case.screen.name, **(env or {})}
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [NEBEL, "view", str(case.scene), "--widgets", str(self.controls), *map(str, words or SMALL_WINDOW)],
                stderr=log, env=self.environment, cwd=case.folder)
        case.addCleanup(self.close)
        self.wait(self.controls.exists, "a window")
        self.find_window()
        if not self.shows_controls():
            self.press("Controls")

    def shows_controls(self):
        """Rather than the button that brings them."""
        found = []

        def find():
            found[:] = re.findall(" (Home|Controls)\n", self.read_controls()[0])
            return found

        self.wait(find, "the controls, or their button")
        return found[0] == "Home"

    def find_window(self):
        self.window = self.xdotool("search", "--sync", "--onlyvisible", "--name", "nebel$").split()[0]
        self.xdotool("windowfocus", "--sync", self.window)
        self.settle()

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
        """Once more where there are changes."""
        warned = self.said(LEAVING)
        self.key("ctrl+q")
        while self.process.poll() is None and self.said(LEAVING) == warned:
            time.sleep(0.02)
        if self.process.poll() is None:
            self.key("ctrl+q")
        self.case.assertEqual(self.process.wait(WAIT), 0, self.log.read_text())

    def key(self, name):
        self.xdotool("key", name)

    def drag(self, x, y, to_x, to_y, button=1):
        self.xdotool("mousemove", "--window", self.window, x, y, "mousedown", button, "sleep", PAUSE, "mousemove", "--window",
                     self.window, to_x, to_y, "sleep", PAUSE, "mouseup", button)
        self.settle()

    def said(self, text):
        return self.log.read_text().count(text)

    def say(self, text, act):
        """Does something, and waits until the viewer says so, which may move what lies below."""
        before = self.said(text)
        act()
        self.wait(lambda: self.said(text) > before, f"'{text}'")
        self.settle()

    def take_picture(self, key="F12"):
        """Once it is complete."""
        self.say("view: saved nebel-", lambda: self.key(key))
        return self.case.folder / re.findall(r"saved (nebel-\d+\.png)", self.log.read_text())[-1]

    def read_controls(self):
        """A whole list: the file is emptied and filled each time the window is drawn."""
        found = []

        def read():
            found[:] = re.findall(r"\A((?:.*\n)*)0 0 0 0 \(list (\d+)\)\n\Z", self.controls.read_text())
            return found

        self.wait(read, "a list of the controls")
        return found[0][0], int(found[0][1])

    def settle(self, times=5):
        """Waits until the window has been drawn five times: a press and its end take a turn each, what follows two more, and one
        may be under way."""
        first = self.read_controls()[1]
        self.wait(lambda: self.read_controls()[1] >= first + times, "another frame")

    def place(self, name):
        """Where a control is and stays: x, y, width, height. Messages come and go, and what lies below moves."""
        before, now = None, self.find(name)
        while now != before:
            self.settle(2)
            before, now = now, self.find(name)
        return now

    def find(self, name):
        found = []

        def find():
            lines = self.read_controls()[0].splitlines()
            found.extend(line[:-len(name) - 1] for line in lines if line.endswith(" " + name))
            return found

        self.wait(find, f"the control {name}")
        return [int(number) for number in found[0].split()]

    def press(self, name, share=0.5):
        x, y, width, height = self.place(name)
        self.xdotool("mousemove", "--window", self.window, int(x + share * width), y + height // 2, "sleep", PAUSE, "mousedown",
                     1, "sleep", PAUSE, "mouseup", 1)
        self.settle()

    def choose(self, name, word):
        self.press(name)
        self.press(f"{name}: {word}")

    def type(self, name, text, share=0.5):
        """Into a number, as Ctrl + click allows."""
        x, y, width, height = self.place(name)
        self.xdotool("mousemove", "--window", self.window, int(x + share * width), y + height // 2, "sleep", PAUSE, "keydown",
                     "ctrl", "mousedown", 1, "sleep", PAUSE, "mouseup", 1, "keyup", "ctrl")
        self.wait(lambda: "(typing)" in self.read_controls()[0], f"a cursor in {name}")
        self.xdotool("type", "--delay", 20, text)
        self.xdotool("key", "Return")
        self.wait(lambda: "(typing)" not in self.read_controls()[0], f"the end of {name}")
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
        self.assert_done(self.render(name, "--device", "gl", "--size", SIZE))
        return self.folder / name

    def largest_difference(self, a, b):
        return float(re.search(r"largest difference: (\S+)", nebel("compare", a, b).out)[1])

    def same(self, a, b, most):
        return nebel("compare", a, b, "--fail-above", most).returncode == 0
