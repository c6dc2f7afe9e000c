#!/usr/bin/env python3
"""Uses `nebel view` as people do: pictures, mouse and keys, windows of all sizes, a driver that is lost."""

import math
import os
import pathlib
import re
import signal
import struct
import subprocess
import time
import unittest

from check_cli import FOG, nebel
from view_case import LEAVING, ROUNDING, WAIT, Manager, Viewer, ViewTest


FULL = ("--size", "560x420")


class PicturesTest(ViewTest):
    def test_the_picture_is_that_of_render(self):
        self.assert_done(self.render("render.png", "--device", "gl", *FULL))
        viewer = Viewer(self, *FULL)
        picture = viewer.take_picture()
        self.assertTrue(self.same(picture, self.folder / "render.png", ROUNDING))
        compared = nebel("compare", picture, self.folder / "render.png").out
        self.assertLess(float(re.search(r"RMSE: (\S+)", compared)[1]), 1e-4, "bytes are rounded in the same pattern")
        viewer.end()

    def test_picture_and_list_need_a_file_each(self):
        done = nebel("view", self.scene, "--screenshot", "one.png", "--widgets", "./one.png", cwd=self.folder)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("need a file each", done.err)

    def test_screenshot_of_the_window(self):
        done = nebel("view", self.scene, *FULL, "--screenshot", "window.png", cwd=self.folder,
                     env={"DISPLAY": self.screen.name})
        self.assert_done(done)
        self.assertEqual(done.err, "")
        self.assert_done(self.render("render.png", "--device", "gl", *FULL))
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
        viewer.drag(200, 150, 225, 140)
        turned = viewer.take_picture()
        self.assertFalse(self.same(first, turned, ROUNDING), "a drag turns")
        viewer.key("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), ROUNDING), "Home brings the camera back")
        ways = {"pan": lambda: viewer.drag(200, 150, 225, 140, 2), "look": lambda: viewer.drag(200, 150, 225, 140, 3),
                "wheel": lambda: viewer.xdotool("mousemove", "--window", viewer.window, 200, 150, "click", 4),
                "fly": lambda: viewer.xdotool("keydown", "w", "sleep", 0.2, "keyup", "w")}
        for name, act in ways.items():
            with self.subTest(name):
                act()
                viewer.settle()
                self.assertFalse(self.same(first, viewer.take_picture(), ROUNDING))
                viewer.press("Home")
        self.assertTrue(self.same(first, viewer.take_picture(), ROUNDING))
        viewer.end()

    def test_a_slow_turn_loses_no_events(self):
        """The wheel goes as far back as forth, while the viewer can take nothing."""
        viewer = Viewer(self)
        first = viewer.take_picture()
        viewer.xdotool("mousemove", "--window", viewer.window, 250, 150)
        viewer.settle()
        for buttons in ((4,), (5,), (5, 4)):
            viewer.process.send_signal(signal.SIGSTOP)
            for button in buttons:
                viewer.xdotool("click", "--repeat", 50, "--delay", 2, button)
            viewer.process.send_signal(signal.SIGCONT)
            viewer.settle()
            self.assertEqual(self.same(first, viewer.take_picture(), ROUNDING), buttons != (4,))
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
        viewer = Viewer(self, *FULL)
        small = viewer.place("Save")
        viewer.end()
        for wanted, dpi, words in ((2, 96, ["--ui-scale", 2]), (2, 192, []), (1.5, 144, []), (1, 192, ["--ui-scale", 1])):
            with self.subTest(dpi=dpi, words=words):
                self.screen.set_dpi(dpi)
                viewer = Viewer(self, *FULL, *words)
                large = viewer.place("Save")
                self.assertAlmostEqual(large[3] / small[3], wanted, delta=0.1 * wanted)
                self.assertAlmostEqual(large[2] / small[2], wanted, delta=0.1 * wanted)
                picture = viewer.take_picture().read_bytes()
                self.assertEqual(struct.unpack(">II", picture[16:24]), (560, 420), "a pixel of the picture is one of the screen")
                viewer.end()


    def test_narrow_windows_show_the_picture(self):
        """All of it but for the button, which is in the corner; Tab brings the controls, room does so, too."""
        self.assert_done(self.render("render.png", "--device", "gl", "--size", "256x144"))
        words = ("--size", "256x144", "--ui-scale", 1)
        self.assert_done(nebel("view", self.scene, *words, "--screenshot", "window.png", cwd=self.folder,
                               env={"DISPLAY": self.screen.name}))
        viewer = Viewer(self, *words)
        for shown in (False, True, False):
            viewer.key("Tab")
            viewer.settle()
            self.assertEqual(viewer.shows_controls(), shown)
        viewer.process.send_signal(signal.SIGSTOP)
        viewer.xdotool("key", "--delay", 50, "Tab", "Tab")
        viewer.process.send_signal(signal.SIGCONT)
        viewer.settle()
        self.assertFalse(viewer.shows_controls(), "there and back in one slow turn")
        x, y, width, height = viewer.place("Controls")
        share = (x + width) * (y + height) / (256 * 144)
        self.assertLess(share, 0.1)
        self.assertTrue(self.same(self.folder / "window.png", self.folder / "render.png", share ** 0.5), "the rest is the picture")
        viewer.xdotool("windowsize", "--sync", viewer.window, 600, 300)
        viewer.settle()
        self.assertTrue(viewer.shows_controls())
        viewer.xdotool("windowsize", "--sync", viewer.window, 256, 144)
        viewer.settle()
        self.assertFalse(viewer.shows_controls())
        viewer.end()


class CompareTest(ViewTest):
    def test_both_renderers_draw_the_same(self):
        black = self.write_scene("black.json", [])
        self.assert_done(nebel("render", black, "-o", "black.png", *FULL, cwd=self.folder))
        black = self.folder / "black.png"
        viewer = Viewer(self, *FULL)
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


# Planets, and noise in other fog, are slow to draw: few pixels, and controls of half the size so that they are seen.
SMALL = ["--size", "100x250", "--ui-scale", 0.5]

# Of what either renderer draws: a byte of each, and one for tables of the air in floats.
BOTH_DRAW = 2.5 / 255


NOISE = {"shape": {"type": "box", "min": [-3, -3, -2], "max": [3, 3, 0]}, "extinction": 0.6, "source": [0.9, 0.8, 0.7],
         "density": {"type": "noise", "size": [24, 24, 8], "cells": [4, 4, 2], "velocity": [0.2, 0, 0], "evolution": 0.1}}
EYE = {"position": [0, 0, 6], "look_at": [0, 0, 0]}


class FilmTest(ViewTest):
    """Frame k in the window is frame k of a film."""

    def open(self, fog, camera=EYE, **more):
        self.scene = self.write_scene("scene.json", fog, camera=camera, **more)
        viewer = Viewer(self, *SMALL)
        viewer.type("samples", "1")
        return viewer

    def assert_frame(self, viewer, frame, device, most=ROUNDING):
        name = f"film-{device}-{frame}.png"
        self.assert_done(self.render(name, *SMALL[:2], "--samples", 1, "--frame", frame, "--device", device))
        picture = viewer.take_picture()
        self.assertTrue(self.same(picture, self.folder / name, most), f"frame {frame}")
        return picture


class ClockTest(FilmTest):
    def test_all_that_moves_is_where_the_film_has_it(self):
        keys = [{"frame": 0}, {"frame": 12, "extinction": 0}]
        path = [{"frame": 0}, {"frame": 16, "position": [3, 1, 6]}]
        viewer = self.open([NOISE, {**FOG, "keys": keys}], camera={**EYE, "keys": path}, background=1)
        before = self.scene.read_text()
        first = viewer.take_picture()
        viewer.type("frame", "7")
        self.assertFalse(self.same(self.assert_frame(viewer, 7, "gl"), first, 0.02))
        for key in ("period", "period", "comma"):
            viewer.key(key)
            viewer.settle()
        viewer.press(">")
        self.assert_frame(viewer, 9, "gl")
        self.assertEqual(self.scene.read_text(), before)
        viewer.end()
        self.assertEqual(viewer.said(LEAVING), 0, "time is no change")

    def test_noise_goes_on_and_is_saved_without_its_time(self):
        viewer = self.open([NOISE])
        first = viewer.take_picture()

        def goes_on():
            viewer.key("space")
            viewer.settle()
            viewer.key("space")
            return not self.same(viewer.take_picture(), first, 0.02)

        viewer.wait(goes_on, "other wisps")
        viewer.type("frame", "300")
        viewer.press("fog[0].visibility", 0.4)
        saved = viewer.save()
        self.assertEqual({**saved["fog"][0], "extinction": 0.6}, NOISE)
        self.assert_frame(viewer, 300, "gl")
        viewer.key("ctrl+z")
        viewer.settle()
        viewer.say(LEAVING, lambda: viewer.key("ctrl+q"))
        viewer.end()


class PlanetTest(FilmTest):
    """No edges are seen, which renderers may place differently."""

    def test_the_air_of_a_planet_and_its_sun(self):
        sun = {"direction": [0.3, 0.6, 0.4], "irradiance": 4, "keys": [{"frame": 0}, {"frame": 20, "direction": [1, 0.1, 0]}]}
        fog = {"shape": {"type": "box", "min": [-500, 0, -900], "max": [500, 800, -100]}, "extinction": 0.001, "albedo": 0.9}
        camera = {"position": [0, 30, 0], "look_at": [0, 60, -100], "vertical_fov": 25}
        viewer = self.open([fog], camera=camera, sun=sun, planet={"model": "physical", "preset": "earth"})
        viewer.press("fog[0].visibility", 0.4)
        saved = viewer.save()
        self.assertNotEqual(saved["fog"][0]["extinction"], 0.001)
        self.assertEqual(saved["sun"], sun)
        noon = self.assert_frame(viewer, 0, "cpu", BOTH_DRAW)
        viewer.type("frame", "18")
        self.assertFalse(self.same(self.assert_frame(viewer, 18, "cpu", BOTH_DRAW), noon, 0.02), "another sky")
        self.assertNotIn("--device", viewer.log.read_text())
        viewer.end()

    def test_another_sun_lights_the_air_at_once(self):
        """As a file that has it, before it is saved."""
        sun = {"direction": [0, 0.6, 0.8], "irradiance": 4}
        fog = {"shape": {"type": "box", "min": [-500, 0, -900], "max": [500, 800, -100]}, "extinction": 0.001, "albedo": 0.9}
        scene = {"camera": {"position": [0, 30, 0], "look_at": [0, 60, -100], "vertical_fov": 25},
                 "planet": {"model": "physical", "preset": "earth"}}
        viewer = self.open([fog], sun=sun, **scene)
        viewer.press("fog[0].open")
        first = viewer.take_picture()
        viewer.press("Light")
        viewer.type("sun height", "4")
        lit = viewer.take_picture()
        self.assertFalse(self.same(lit, first, 0.05))
        saved = viewer.save()["sun"]["direction"]
        self.assertLess(abs(saved[1] - math.sin(math.radians(4))), 1e-9)
        self.assert_frame(viewer, 0, "gl", BOTH_DRAW)
        self.assertTrue(self.same(lit, self.folder / "film-gl-0.png", BOTH_DRAW))
        viewer.key("ctrl+z")
        self.assertTrue(self.same(viewer.take_picture(), first, ROUNDING))
        viewer.end()

    def test_air_of_a_planet_has_other_numbers(self):
        """The picture is that of a file that has them, before it is saved; what has not changed stays as it stands there."""
        sun = {"direction": [0, 0.2, 0.8], "irradiance": 4}
        scene = {"camera": {"position": [0, 30, 0], "look_at": [0, 60, -100], "vertical_fov": 25},
                 "planet": {"model": "physical", "preset": "earth"}}
        viewer = self.open([], sun=sun, **scene)
        before = self.scene.read_text()
        first = viewer.take_picture()
        viewer.press("Planet")
        viewer.press("planet[0].components[1].open")
        viewer.type("planet[0].components[1].density", "0.1", 0.1)
        hazy = viewer.take_picture()
        self.assertFalse(self.same(hazy, first, 0.02))
        viewer.type("planet[0].ground albedo", "0.75", 0.1)
        changed = viewer.take_picture()
        planet = viewer.save()["planet"]
        self.assertEqual(planet.keys(), {"model", "preset", "ground_albedo", "components"})
        self.assertEqual(planet["ground_albedo"][0], 0.75)
        self.assertEqual([air["type"] for air in planet["components"]], ["exponential", "exponential", "tent"])
        self.assertGreater(planet["components"][1]["scattering"], 1e-5)
        self.assert_frame(viewer, 0, "gl", BOTH_DRAW)
        self.assertTrue(self.same(changed, self.folder / "film-gl-0.png", BOTH_DRAW))
        for _ in range(2):
            viewer.key("ctrl+z")
            viewer.settle()
        self.assertTrue(self.same(viewer.take_picture(), first, ROUNDING))
        self.assertNotEqual(self.scene.read_text(), before)
        viewer.say(LEAVING, lambda: viewer.key("ctrl+q"))
        viewer.end()

    def test_clouds_have_other_numbers(self):
        """Those that cannot be are undone, and the window says why."""
        planet = {"model": "physical", "preset": "earth", "clouds": [{}]}
        camera = {"position": [0, 30, 0], "look_at": [0, 80, -100], "vertical_fov": 25}
        viewer = self.open([], camera=camera, sun={"direction": [0, 1, 0.2], "irradiance": 4}, planet=planet)
        first = viewer.take_picture()
        viewer.press("Planet")
        viewer.press("planet[0].clouds[0].open")
        viewer.say("top: is 500 m; must be above the base, 900 m", lambda: viewer.type("planet[0].clouds[0].top", "500"))
        viewer.type("planet[0].clouds[0].coverage", "0.9")
        self.assertFalse(self.same(viewer.take_picture(), first, 0.05))
        self.assertEqual(viewer.save()["planet"], {**planet, "clouds": [{"coverage": 0.9}]})
        self.assert_frame(viewer, 0, "cpu", BOTH_DRAW)
        viewer.end()

    def test_fog_stands_in_the_shadow_of_clouds(self):
        """Which the wind has moved by the next frame."""
        sun = {"direction": [0, 1, 0.2], "irradiance": 4}
        fog = {"shape": {"type": "box", "min": [-500, 0, -900], "max": [500, 800, -100]}, "extinction": 0.002, "albedo": 0.9}
        planet = {"model": "physical", "preset": "earth", "clouds": [{"wind": [500, 0]}]}
        camera = {"position": [0, 30, 0], "look_at": [0, 40, -100], "vertical_fov": 25}
        viewer = self.open([fog], camera=camera, sun=sun, planet=planet, ambient=0)
        first = self.assert_frame(viewer, 0, "cpu", BOTH_DRAW)
        viewer.type("frame", "9")
        self.assertFalse(self.same(self.assert_frame(viewer, 9, "cpu", BOTH_DRAW), first, 0.02), "another shadow")
        self.assert_frame(viewer, 9, "gl", BOTH_DRAW)
        viewer.end()

    def test_a_textured_planet_turns(self):
        camera = {"position": [0, 0, 0], "look_at": [0, 0, -1], "vertical_fov": 25}
        planet = {"model": "textured", "center": [0, 0, -500], "radius": 300, "rotation_period": 400, "clouds": [{"height": 10, "rotation_period": -300}]}
        viewer = self.open([], camera=camera, planet=planet, sun={"direction": [1, 1, 1], "irradiance": 4})
        first = self.assert_frame(viewer, 0, "cpu", BOTH_DRAW)
        viewer.type("frame", "150")
        self.assertFalse(self.same(self.assert_frame(viewer, 150, "cpu", BOTH_DRAW), first, 0.1))
        self.assert_frame(viewer, 150, "gl")
        self.assertNotIn("--device", viewer.log.read_text())
        viewer.press("Time")
        viewer.press("Planet")
        viewer.type("planet[0].rotation period", "300")
        viewer.type("planet[0].air brightness", "0")
        viewer.press("planet[0].clouds[0].open")
        viewer.type("planet[0].clouds[0].gain", "1.5")
        changed = viewer.take_picture()
        wanted = {**planet, "rotation_period": 300, "atmosphere": {"brightness": 0}, "clouds": [{**planet["clouds"][0], "gain": 1.5}]}
        self.assertEqual(viewer.save()["planet"], wanted)
        self.assert_frame(viewer, 150, "gl")
        self.assertTrue(self.same(changed, self.folder / "film-gl-150.png", ROUNDING))
        viewer.end()


if __name__ == "__main__":
    unittest.main()
