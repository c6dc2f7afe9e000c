#!/usr/bin/env python3
"""Changes scenes in `nebel view` as people do: controls, files that change on the disk, saving."""

import json
import math
import re
import time
import unittest

from check_cli import FOG, nebel
from view_case import LEAVING, ROUNDING, Viewer, ViewTest


# The same program of OpenGL draws both: where light is at the edge of a byte the driver may round it otherwise. One byte in twenty is
# sqrt(0.05) / 255 in the mean square; the light does not matter.
ROUNDING_TOGETHER = 0.001

# A tall window with controls of half the size, which are all seen: drawing takes a quarter of the time.
TALL = "200x450"
SMALL_CONTROLS = ("--ui-scale", 0.5)

# Where a surface cuts a ball, a disc is there as a whole or not at all. In its middle particles of this absorption hide nearly all:
# from nothing to half of that is a quarter of the range at least, in the sRGB of a PNG.
HALF_A_DISC = 0.05


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

    def test_changes_are_not_left_without_a_word(self):
        viewer = Viewer(self)
        before = self.scene.read_text()
        viewer.press("fog[0].visibility", 0.2)
        viewer.say(LEAVING, lambda: viewer.key("ctrl+q"))
        viewer.take_picture()
        viewer.press("fog[0].visibility", 0.4)
        viewer.say(LEAVING, lambda: viewer.key("ctrl+q"))
        viewer.key("ctrl+q")
        self.assertEqual(viewer.process.wait(60), 0)
        self.assertEqual(self.scene.read_text(), before)

    def test_messages_hide_no_controls(self):
        viewer = Viewer(self, "--size", "480x420")
        viewer.say("scene.json:1:", lambda: self.scene.write_text("{"))
        top = viewer.place("OK")[1]
        viewer.settle()
        lines = [line.split(" ", 4) for line in viewer.read_controls()[0].splitlines()]
        others = [int(line[1]) + int(line[3]) for line in lines if line[4] != "OK" and not line[4].startswith("(")]
        self.assertGreater(len(others), 9)
        self.assertLess(max(others), top)
        viewer.press("OK")
        viewer.end()

    def test_the_list_of_keys_hides_no_messages(self):
        viewer = Viewer(self, "--size", "320x180")
        viewer.key("F1")
        viewer.say("scene.json:1:", lambda: self.scene.write_text("{"))
        for start, end in ((None, None), ((160, 8), (160, 170))):
            if start is not None:
                viewer.drag(*start, *end)
            x, y, width, height = viewer.place("(keys)")
            self.assertTrue(0 <= x and 0 <= y and x + width <= 320, (x, y, width))
            self.assertLessEqual(y + height, viewer.place("(notice)")[1])
            self.assertGreater(height, 60)
        viewer.press("OK")
        viewer.end()

    def test_what_has_not_changed_is_not_written(self):
        viewer = Viewer(self)
        before = self.scene.stat().st_mtime_ns
        viewer.say("view: nothing to save", lambda: viewer.key("ctrl+s"))
        self.assertEqual(self.scene.stat().st_mtime_ns, before)
        self.assertEqual(viewer.said("view: saved"), 0)
        viewer.end()

    def test_why_nothing_is_saved(self):
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        good = self.scene.read_text()
        viewer.say("scene.json:1:", lambda: self.scene.write_text("{"))
        viewer.say("view: nothing is saved", lambda: viewer.key("ctrl+s"))
        self.assertEqual(viewer.said("scene.json:1:"), 2, "and why is said again")
        self.assertEqual(self.scene.read_text(), "{")
        viewer.say(f"view: read {self.scene} again", lambda: self.scene.write_text(good + " "))
        self.scene.unlink()
        viewer.say("view: nothing is saved", lambda: viewer.key("ctrl+s"))
        viewer.press("fog[0].visibility", 0.2)
        viewer.say("view: nothing is saved", lambda: viewer.key("ctrl+s"))
        self.assertEqual(viewer.said("No such file"), 2)
        self.assertFalse(self.scene.exists())
        self.scene.write_text(good)
        viewer.say(f"view: saved {self.scene}", lambda: viewer.press("Save mine into it"))
        viewer.end()

    def test_small_numbers_keep_their_digits(self):
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        for colour, typed in enumerate(("2.996e-05", "1.2345e-05", "1.5e-05")):
            viewer.type("fog[0].extinction", typed, 0.1 + 0.2 * colour)
        self.assertEqual(viewer.save()["fog"][0]["extinction"], [2.996e-05, 1.2345e-05, 1.5e-05])
        viewer.end()

    def test_the_file_changes(self):
        viewer = Viewer(self)
        first = viewer.take_picture()
        viewer.drag(200, 150, 225, 140)
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
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
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
        self.assert_done(self.render(name, "--device", "gl", "--size", TALL, *words))
        return self.folder / name

    def test_parts_planes_and_what_has_no_number(self):
        planes = [[1, 0, 0, 2], [-1, 0, 0, 2], [0, 1, 0, 2], [0, -1, 0, 2], [0, 0, 1, 2], [0, 0, -1, 2]]
        shape = {"type": "union", "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 2},
                                             {"type": "convex", "planes": planes}]}
        self.scene = self.write_scene("scene.json", [{"shape": shape, "visibility": 8, "cutoff": 90, "source": 0.5}])
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
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
        for share in (0.1, 0.3, 0.5):
            viewer.type("fog[0].extinction", "0", share)
        fog = viewer.save()["fog"][0]
        self.assertNotIn("cutoff", fog)
        self.assertNotIn("visibility", fog)
        self.assertEqual(fog["extinction"], 0)
        for is_now, wanted in zip(fog["shape"]["shapes"][0]["transform"]["rotation"], [0, 0.5 ** 0.5, 0, 0.5 ** 0.5]):
            self.assertAlmostEqual(is_now, wanted)
        viewer.end()

    def test_shapes_and_densities_become_others(self):
        """With numbers of their own, so that the file can be read again."""
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        for name in ("half space", "ellipsoid", "cylinder", "capsule", "cone"):
            viewer.choose("fog[0].shape", name)
            self.assertEqual(viewer.save()["fog"][0]["shape"]["type"], name.replace(" ", "_"))
        for name, parts in (("convex", "planes"), ("union", "shapes"), ("intersection", "shapes")):
            viewer.press("fog[0].shape")
            x, y, _, height = viewer.place("fog[0].shape: cone")
            viewer.xdotool("mousemove", "--window", viewer.window, x + 9, y + height // 2, "click", "--repeat", 9, 5)
            viewer.press(f"fog[0].shape: {name}")
            shape = viewer.save()["fog"][0]["shape"]
            self.assertEqual((shape["type"], len(shape[parts])), (name, 6 if parts == "planes" else 2))
        viewer.choose("fog[0].shape", "sphere")
        for name in ("height", "linear", "radial", "gaussian", "soft edge"):
            viewer.choose("fog[0].density", name)
            self.assertEqual(viewer.save()["fog"][0]["density"]["type"], name.replace(" ", "_"))
        viewer.press("Add a volume")
        fog = viewer.save()["fog"]
        self.assertEqual([volume["shape"]["type"] for volume in fog], ["sphere", "box"])
        for low, high in zip(fog[1]["shape"]["min"], fog[1]["shape"]["max"]):
            self.assertAlmostEqual(low, -high, msg="around the origin, where the camera looks")
        self.assert_done(nebel("info", self.scene))
        viewer.end()

    def test_planes_and_parts_come_and_go(self):
        parts = [{"type": "sphere", "center": [0, 0, 0], "radius": 2}, {"type": "convex", "planes": [[1, 0, 0, 2], [0, 1, 0, 2]]}]
        self.scene = self.write_scene("scene.json", [{**FOG, "shape": {"type": "union", "shapes": parts}}])
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.press("fog[0].parts[0].open")
        viewer.press("fog[0].parts[1].Add a plane")
        viewer.press("fog[0].parts[1].planes[0].x")
        self.assertEqual(viewer.save()["fog"][0]["shape"]["shapes"][1]["planes"], [[0, 1, 0, 2], [0, -1, 0, 3]])
        viewer.press("fog[0].parts[1].open")
        viewer.press("fog[0].Add a part")
        viewer.press("fog[0].parts[0].open")
        viewer.press("fog[0].parts[0].Remove this part")
        shapes = viewer.save()["fog"][0]["shape"]["shapes"]
        self.assertEqual([shape["type"] for shape in shapes], ["convex", "convex"])
        self.assertEqual(shapes[0], shapes[1])
        viewer.end()

    def test_nebulae_cells_and_the_files_of_a_scene(self):
        cell = {"name": "room", "shape": {"type": "box", "min": [-2, -2, -2], "max": [-1, 2, 2]}, "density": 0.5, "color": 0.2}
        nebula = {"name": "dust", "shape": {"type": "sphere", "center": [0, 0, -3], "radius": 2}, "count": 12,
                  "radius_range": [0.8, 1.2], "absorption": 3, "emission": 0.5}
        self.scene = self.write_scene("scene.json", [FOG], models=[{"file": "triangle.obj"}], nebula=[nebula],
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]}, max_opacity=0.4, ambient=1,
                                      sun={"direction": [0, 0, 1], "irradiance": 3}, cells={"cells": [cell]})
        viewer = Viewer(self, "--size", "200x370", *SMALL_CONTROLS)
        viewer.type("samples", "1")
        balls = viewer.take_picture()
        self.assertTrue(self.same(balls, self.draw_small("balls.png"), ROUNDING), "the limit of all fog counts, too")
        viewer.choose("particles", "five-tap discs")
        taps = self.draw_small("taps.png", "--method", "five-tap")
        self.assertTrue(self.same(viewer.take_picture(), taps, ROUNDING_TOGETHER))
        self.assertGreater(self.largest_difference(balls, taps), HALF_A_DISC)
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
        self.assert_done(self.render(name, "--device", "gl", "--size", "200x370", "--samples", 1, *words))
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


class KeysTest(ViewTest):
    """Fog that moves."""

    def draw_at(self, name, frame):
        self.assert_done(self.render(name, "--device", "gl", "--size", TALL, "--samples", 1, "--frame", frame))
        return self.folder / name

    def test_keys_come_change_and_go(self):
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.type("samples", "1")
        viewer.press("fog[0].keys")
        viewer.press("fog[0].Add a key here")
        viewer.press("Time")
        viewer.type("frame", "24")
        viewer.type("fog[0].visibility", "5")
        key = viewer.save()["fog"][0]["keys"][1]
        self.assertEqual((key.keys(), key["frame"]), ({"frame", "extinction"}, 24))
        self.assertAlmostEqual(key["extinction"], 0.59915, places=4)
        self.assertTrue(self.same(viewer.take_picture(), self.draw_at("24.png", 24), ROUNDING_TOGETHER))
        viewer.type("frame", "12")
        self.assertTrue(self.same(viewer.take_picture(), self.draw_at("12.png", 12), ROUNDING_TOGETHER))
        viewer.press("fog[0].keys[0].Go")
        viewer.type("fog[0].keys[1].##frame", "30")
        self.assertEqual([key["frame"] for key in viewer.save()["fog"][0]["keys"]], [0, 30])
        viewer.press("fog[0].keys[1].x")
        viewer.press("fog[0].keys[0].x")
        self.assertEqual(viewer.save()["fog"], [FOG])
        viewer.press("Undo")
        viewer.press("Undo")
        self.assertEqual([key["frame"] for key in viewer.save()["fog"][0]["keys"]], [0, 30])
        viewer.end()

    def test_keys_of_the_camera(self):
        self.scene = self.write_scene("scene.json", [FOG], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        before = self.scene.read_text()
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.type("samples", "1")
        viewer.press("fog[0].open")
        viewer.press("Camera")
        viewer.press("camera[0].Add a key here")
        viewer.press("Time")
        viewer.type("frame", "24")
        viewer.type("eye", "2", 0.1)
        viewer.press("camera[0].Add a key here")
        keys = viewer.save()["camera"]["keys"]
        self.assertEqual([(key["frame"], key["position"]) for key in keys], [(0, [0, 0, 6]), (24, [2, 0, 6])])
        viewer.type("frame", "12")
        self.assertTrue(self.same(viewer.take_picture(), self.draw_at("12.png", 12), ROUNDING_TOGETHER))
        viewer.press("camera[0].keys[1].Go")
        viewer.type("eye", "3", 0.1)
        viewer.press("camera[0].Change the key here")
        viewer.type("camera[0].keys[1].##frame", "30")
        keys = viewer.save()["camera"]["keys"]
        self.assertEqual([(key["frame"], key["position"]) for key in keys], [(0, [0, 0, 6]), (30, [3, 0, 6])])
        viewer.press("camera[0].keys[1].x")
        viewer.press("camera[0].keys[0].x")
        viewer.save()
        self.assertEqual(json.loads(self.scene.read_text()), json.loads(before))
        viewer.press("Undo")
        viewer.press("Undo")
        self.assertEqual(viewer.save()["camera"]["keys"], keys)
        viewer.end()

    def test_noise_has_other_numbers(self):
        noise = {"type": "noise", "size": [24, 24, 8], "cells": [4, 4, 2]}
        fog = {"shape": {"type": "box", "min": [-3, -3, -2], "max": [3, 3, 0]}, "extinction": 0.6, "source": 0.8, "density": noise}
        self.scene = self.write_scene("scene.json", [fog], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.type("samples", "1")
        first = viewer.take_picture()
        wanted = {"cells": [6, 4, 2], "size": [32, 24, 8], "octaves": 2, "gain": 0.75, "coverage": 0.5, "edge": [0.25, 0, 0], "seed": 5,
                  "velocity": [0.5, 0, 0], "evolution": 0.25}
        for name, text in (("cells", "6"), ("voxels", "32"), ("octaves", "2"), ("gain", "0.75"), ("coverage", "0.5"),
                           ("soft faces", "0.25"), ("noise seed", "5"), ("velocity", "0.5"), ("evolution", "0.25")):
            viewer.type(f"fog[0].{name}", text, 0.1)
        picture = viewer.take_picture()
        self.assertFalse(self.same(picture, first, 0.02))
        self.assertEqual(viewer.save()["fog"], [{**fog, "density": {**noise, **wanted}}])
        self.assertTrue(self.same(picture, self.draw_at("0.png", 0), ROUNDING_TOGETHER))
        viewer.key("period")
        viewer.settle()
        self.assertTrue(self.same(viewer.take_picture(), self.draw_at("1.png", 1), ROUNDING_TOGETHER), "still noise now moves")
        viewer.key("ctrl+z")
        self.assertEqual(viewer.save()["fog"][0]["density"]["evolution"], 0)
        viewer.end()

    def test_time_goes_on(self):
        fog = {**FOG, "keys": [{"frame": 0, "extinction": 0.001}, {"frame": 100000}]}
        self.scene = self.write_scene("scene.json", [fog], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        before = self.scene.read_text()
        viewer = Viewer(self)
        viewer.type("frame", "40000")
        first = viewer.take_picture()
        viewer.press("Play")
        viewer.press("Stop")
        self.assertTrue(self.same(viewer.take_picture(), first, 0.01), "a few frames of a hundred thousand")
        viewer.type("frame", "90000")
        self.assertFalse(self.same(viewer.take_picture(), first, 0.01))
        self.assertEqual(self.scene.read_text(), before)
        viewer.end()


class SceneTest(ViewTest):
    """What stands around the fog."""

    def draw_like(self, name, *words):
        self.assert_done(self.render(name, "--size", TALL, "--samples", 1, *words))
        return self.folder / name

    def open(self, *words):
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS, *words)
        viewer.type("samples", "1")
        viewer.press("fog[0].open")
        return viewer

    def test_models_move_and_go(self):
        viewer = self.open()
        viewer.press("models[0].open")
        viewer.type("models[0].position", "1.5", 0.1)
        viewer.press("models[0].one colour", 0.05)
        self.assertEqual(viewer.save()["models"], [{"file": "triangle.obj", "position": [1.5, 0, 0], "color": 0}])
        self.assertTrue(self.same(viewer.take_picture(), self.draw_like("moved.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.press("models[0].Remove")
        none = viewer.take_picture()
        viewer.key("ctrl+z")
        self.assertFalse(self.same(viewer.take_picture(), none, ROUNDING))
        viewer.key("ctrl+y")
        self.assertEqual(viewer.save()["models"], [])
        self.assertTrue(self.same(viewer.take_picture(), self.draw_like("none.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.end()

    def test_lights_shine_elsewhere(self):
        lights = [{"type": "point", "position": [0, 1, 1], "intensity": [4, 2, 1]},
                 {"type": "spot", "name": "stage", "position": [2, 2, 2], "intensity": 9, "direction": [-1, -1, -1], "outer_angle": 40}]
        fog = {"shape": {"type": "box", "min": [-3, -3, -3], "max": [3, 3, 3]}, "extinction": 0.2, "albedo": 0.9}
        self.scene = self.write_scene("scene.json", [fog], lights=lights, models=[{"file": "triangle.obj"}],
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        viewer = self.open("--size", TALL, *SMALL_CONTROLS)
        first = viewer.take_picture()
        viewer.press("lights[0].open")
        viewer.type("lights[0].strength", "8")
        viewer.type("lights[0].radius", "0.5")
        viewer.type("lights[0].position", "1.5", 0.1)
        viewer.press("lights[0].open")
        viewer.press("lights[1].open")
        viewer.type("lights[1].inner angle", "70")
        viewer.type("lights[1].height", "30")
        drawn = viewer.take_picture()
        self.assertFalse(self.same(drawn, first, 0.01))
        viewer.key("c")
        viewer.key("c")
        viewer.key("c")
        by_cpu = viewer.take_picture()
        saved = viewer.save()["lights"]
        self.assertEqual(saved[0], {**lights[0], "position": [1.5, 1, 1], "intensity": [8, 4, 2], "radius": 0.5})
        self.assertEqual((saved[1]["inner_angle"], saved[1]["name"]), (40, "stage"), "no further than the outer one")
        self.assertAlmostEqual(saved[1]["direction"][1], math.sin(math.radians(30)), 12)
        self.assertTrue(self.same(drawn, self.draw_like("gl.png", "--device", "gl", "--size", TALL), ROUNDING_TOGETHER))
        self.assertTrue(self.same(by_cpu, self.draw_like("cpu.png", "--size", TALL), ROUNDING_TOGETHER))
        viewer.key("ctrl+z")
        viewer.settle()
        viewer.say(LEAVING, lambda: viewer.key("ctrl+q"))
        viewer.end()

    def test_sun_camera_and_classic_fog(self):
        before = json.loads(self.scene.read_text())
        viewer = self.open()
        viewer.press("Light")
        viewer.press("Add a sun")
        viewer.press("Camera")
        viewer.choose("projection", "orthographic")
        viewer.type("view height", "5")
        viewer.press("save the camera, too", 0.05)
        saved = viewer.save()
        self.assertEqual(saved["sun"], {"direction": [0.36, 0.8, 0.48], "irradiance": 3})
        self.assertEqual((saved["camera"]["projection"], saved["camera"]["view_height"]), ("orthographic", 5))
        self.assertTrue(self.same(viewer.take_picture(), self.draw_like("sun.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.choose("projection", "panorama")
        self.assertEqual(viewer.save()["camera"]["projection"], "panorama")
        self.assertTrue(self.same(viewer.take_picture(), self.draw_like("panorama.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.choose("projection", "perspective")
        viewer.press("save the camera, too", 0.05)
        viewer.press("Remove the sun")
        viewer.press("Light")
        viewer.press("Camera")
        viewer.press("Classic fog")
        viewer.press("classic[0].Add")
        viewer.type("classic[0].end", "12")
        viewer.choose("method", "linear")
        saved = viewer.save()
        self.assertNotIn("sun", saved)
        self.assertEqual((saved["classic"]["start"], saved["classic"]["end"]), (0, 12))
        drawn = viewer.take_picture()
        self.scene.write_text(json.dumps({**saved, "camera": before["camera"]}))
        self.assertTrue(self.same(drawn, self.draw_like("linear.png", "--method", "linear"), ROUNDING_TOGETHER))
        viewer.end()

    def test_a_sky_changes(self):
        sky = {"type": "gradient", "zenith": [0.1, 0.2, 0.8], "horizon": [0.9, 0.5, 0.3], "ground": [0, 0, 0]}
        fog = {"shape": FOG["shape"], "extinction": 0.1, "albedo": 0.9}
        self.scene = self.write_scene("scene.json", [fog], models=[{"file": "triangle.obj"}], ambient=sky)
        scene = json.loads(self.scene.read_text())
        self.scene.write_text(json.dumps({**scene, "background": "ambient"}))
        viewer = self.open()
        viewer.press("Light")
        first = viewer.take_picture()
        viewer.type("horizon", "3", 0.1)
        self.assertEqual(viewer.save()["ambient"]["horizon"], [3, 0.5, 0.3])
        redder = viewer.take_picture()
        self.assertFalse(self.same(first, redder, ROUNDING_TOGETHER))
        self.assertTrue(self.same(redder, self.draw_like("redder.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.end()

    def test_a_preset_fills_in_what_a_fog_is(self):
        self.scene = self.write_scene("scene.json", [{**FOG, "source": 0.5}], ambient=1)
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.type("samples", "1")
        before = viewer.take_picture()
        viewer.choose("fog[0].preset", "heavy_advection")
        fog = viewer.save()["fog"][0]
        self.assertEqual(fog["albedo"], [0.9999942, 0.9999992, 0.9999995])
        self.assertEqual(fog["phase"], {"type": "droplets", "diameter": 40})
        self.assertEqual(fog["extinction"], 0.0287482)
        self.assertNotIn("source", fog)
        drawn = viewer.take_picture()
        self.scene.write_text(json.dumps({"nebel": 1, "fog": [{"shape": FOG["shape"], "preset": "heavy_advection"}], "ambient": 1}))
        self.assertTrue(self.same(drawn, self.draw_like("preset.png"), ROUNDING_TOGETHER))
        self.assertFalse(self.same(drawn, before, ROUNDING_TOGETHER))
        viewer.end()

    def test_contrast_phase_and_colours(self):
        nebula = {"shape": {"type": "sphere", "center": [0, 0, -3], "radius": 2}, "count": 3, "emission": 5, "radius_range": [0.8, 1]}
        self.scene = self.write_scene("scene.json", [{**FOG, "albedo": 0.5, "source": None}], nebula=[nebula], ambient=1)
        scene = json.loads(self.scene.read_text())
        del scene["fog"][0]["source"]
        self.scene.write_text(json.dumps(scene))
        viewer = Viewer(self, "--size", TALL, *SMALL_CONTROLS)
        viewer.type("samples", "1")
        viewer.type("fog[0].contrast", "0.02")
        viewer.choose("fog[0].phase", "Henyey-Greenstein")
        viewer.type("fog[0].g", "0.75")
        fog = viewer.save()["fog"][0]
        self.assertEqual(fog["phase"], {"type": "henyey_greenstein", "g": 0.75})
        self.assertEqual(fog["contrast"], 0.02)
        self.assertAlmostEqual(fog["visibility"], 29.957, places=3)
        viewer.press("fog[0].open")
        dark = viewer.take_picture()
        viewer.press("Light")
        viewer.press("Add a sun")
        viewer.save()
        self.assertTrue(self.same(viewer.take_picture(), self.draw_like("sunlit.png"), ROUNDING_TOGETHER))
        viewer.press("Remove the sun")
        viewer.press("Light")
        self.assertTrue(self.same(viewer.take_picture(), dark, ROUNDING_TOGETHER))
        viewer.press("nebula[0].open")
        first = viewer.take_picture()
        viewer.press("nebula[0].Add a colour")
        viewer.type("nebula[0].colors[0].colours", "0", 0.1)
        self.assertEqual(viewer.save()["nebula"], [{**nebula, "colors": [[0, 1, 1]]}])
        self.assertFalse(self.same(viewer.take_picture(), first, ROUNDING_TOGETHER))
        viewer.end()

    def test_points_of_a_nebula(self):
        (self.folder / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\np 1 2 3\n")
        nebula = {"points": {"file": "points.obj"}, "radius_range": [0.4, 0.5], "emission": 1}
        self.scene = self.write_scene("scene.json", [FOG], nebula=[nebula], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        viewer = self.open()
        viewer.press("nebula[0].open")
        viewer.press("nebula[0].transform")
        viewer.type("nebula[0].position", "1", 0.1)
        viewer.type("nebula[0].rotation", "90", 0.5)
        moved = viewer.take_picture()
        self.assertEqual(viewer.save()["nebula"][0]["points"]["position"], [1, 0, 0])
        self.assertTrue(self.same(moved, self.draw_like("moved.png", "--device", "gl"), ROUNDING_TOGETHER))
        viewer.end()


if __name__ == "__main__":
    unittest.main()
