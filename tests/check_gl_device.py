#!/usr/bin/env python3
"""Checks `nebel render --device gl`: the call, its messages, and its pictures beside those of the CPU."""

import os
import re
import unittest

from check_cli import FOG, PictureCase, nebel

# The leak checker stops threads to look at them and at times falls over those of Mesa's rasterizer; the tests in C look for leaks.
os.environ["ASAN_OPTIONS"] = "detect_leaks=0"


class GlDeviceTest(PictureCase):
    def setUp(self):
        super().setUp()
        if "OpenGL: not in this build" in nebel("info").out:
            self.skipTest("built without OpenGL")

    def draw(self, output, *words, **more):
        return self.render(output, "--device", "gl", *words, **more)

    def test_the_driver_is_named(self):
        done = self.draw("a.png")
        self.assert_done(done)
        self.assertRegex(done.err, r"^nebel: note: --device gl: .+\nnebel: a\.png: 64 x 36, 4 samples, .*s\n$")
        driver = done.err.splitlines()[0].partition("--device gl: ")[2]
        self.assertIn(f"OpenGL: {driver}\n", nebel("info").out)
        self.assertEqual(self.draw("b.png", "--quiet").err, "")
        self.assertEqual((self.folder / "a.png").read_bytes(), (self.folder / "b.png").read_bytes())

    def test_a_terminal_is_told_what_takes_so_long(self):
        process, seen = self.run_on_terminal("a.png", "--device", "gl")
        self.assertEqual(process.returncode, 0, seen)
        self.assertRegex(seen, r"\rOpenGL: compiling shaders\.\.\.[^\n]*\r +\r")
        self.assertTrue(seen.splitlines()[-1].startswith("nebel: a.png: "), seen)
        self.assertNotIn("compiling", self.run_on_terminal("a.png", "--device", "gl", "--quiet")[1])
        self.assertNotIn("compiling", self.draw("a.png").err)

    def test_every_layer_is_that_of_the_cpu(self):
        self.assert_done(self.render("cpu.exr", "--aov", "--samples", 1))
        done = self.draw("gl.exr", "--aov", "--samples", 1)
        self.assert_done(done)
        self.assertIn("no channel error", done.err)
        layers = [f"{layer}.{c}" for layer in ("transmittance", "in_scattering") for c in "RGB"]
        for channel in ("R", "G", "B", *layers, "normal.Z"):
            same = nebel("compare", "cpu.exr", "gl.exr", "--channel", channel, "--fail-above", 1e-4, cwd=self.folder)
            self.assert_done(same)
        error = nebel("compare", "cpu.exr", "gl.exr", "--channel", "error", cwd=self.folder)
        self.assertNotEqual(error.returncode, 0)

    def test_frames(self):
        self.scene = self.write_scene("turn.json", [FOG], models=[{"file": "triangle.obj"}], background=1, camera={
            "position": [0, 0, 6], "look_at": [0, 0, 0], "turntable": {"frames": 8}})
        self.assert_done(self.draw("t%d.png", "--frames", "0-1"))
        self.assertNotEqual((self.folder / "t0.png").read_bytes(), (self.folder / "t1.png").read_bytes())

    def test_noise_drifts_as_on_the_cpu(self):
        wisps = {"shape": {"type": "box", "min": [-2, -1, -2], "max": [2, 1, 2]}, "extinction": 2, "source": [0.3, 0.5, 0.7],
                 "density": {"type": "noise", "size": [24, 12, 24], "cells": [4, 2, 4], "octaves": 2, "velocity": [0.3, 0, 0], "evolution": 0.2}}
        self.scene = self.write_scene("wisps.json", [wisps, FOG], models=[{"file": "triangle.obj"}], background=1,
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        words = ("--aov", "--samples", 1, "--frames", "0-2")
        self.assert_done(self.render("cpu%d.exr", *words))
        self.assert_done(self.draw("gl%d.exr", *words))
        for frame in range(3):
            for channel in ("transmittance.G", "in_scattering.B"):
                self.assert_done(nebel("compare", f"cpu{frame}.exr", f"gl{frame}.exr", "-c", channel, "--fail-above", 1e-4, cwd=self.folder))
        still = nebel("compare", "gl0.exr", "gl2.exr", "-c", "transmittance.G", "--fail-above", 1e-2, cwd=self.folder)
        self.assertEqual(still.returncode, 1)

    def test_particles(self):
        cloud = {"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 1}, "count": 50, "absorption": 1, "emission": 1}
        self.scene = self.write_scene("cloud.json", [FOG], nebula=[cloud], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.assert_done(self.render("cpu.exr", "--aov", "--samples", 1))
        self.assert_done(self.draw("gl.exr", "--aov", "--samples", 1))
        for channel, most in (("transmittance.G", 1e-4), ("in_scattering.G", 2e-3)):
            self.assert_done(nebel("compare", "cpu.exr", "gl.exr", "-c", channel, "--fail-above", most, cwd=self.folder))

    def test_fog_at_vertices(self):
        self.scene = self.write_scene("mist.json", [FOG], models=[{"file": "triangle.obj"}], background=1,
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        for method in ("exact", "vertex", "additive"):
            self.assert_done(self.draw(f"{method}.exr", "--aov", "--method", method))
        # Fog where there is no surface, and what it hides, are what these lack.
        for one, other, channel in (("exact", "vertex", "in_scattering.G"), ("vertex", "additive", "transmittance.G")):
            compared = nebel("compare", f"{one}.exr", f"{other}.exr", "-c", channel, "--fail-above", 1e-3, cwd=self.folder)
            self.assertEqual(compared.returncode, 1)
        self.assert_done(nebel("compare", "vertex.exr", "additive.exr", "-c", "in_scattering.G", "--fail-above", 0, cwd=self.folder))

    def test_fog_in_cells(self):
        room = {"shape": {"type": "box", "min": [-9, -9, -9], "max": [9, 9, 3]}, "density": 0.2, "color": [0.1, 0.5, 0.9]}
        self.scene = self.write_scene("cells.json", [FOG], models=[{"file": "triangle.obj"}], background=1, ambient=1,
                                      cells={"cells": [room]}, sun={"direction": [0, 0, 1], "irradiance": 1},
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.assert_done(self.draw("exact.exr", "--aov", "--samples", 1))
        for method in ("cells", "cells-pixel"):
            self.assert_same_as_cpu(method)
            for channel in ("G", "transmittance.G", "in_scattering.B"):
                self.assertEqual(nebel("compare", "exact.exr", "gl.exr", "-c", channel, "--fail-above", 1e-2, cwd=self.folder).returncode, 1)

    def test_walls_hide_fog_at_pixels(self):
        rooms = [{"shape": {"type": "box", "min": [-9, -9, -9 + 10 * i], "max": [9, 9, 1 + 10 * i]}, "density": 0.2, "color": [i, 0.5, 0.9],
                  "name": f"room{i}"} for i in range(2)]
        door = {"cells": ["room0", "room1"], "polygon": [[-0.4, -0.4, 1], [0.4, -0.4, 1], [0.4, 0.4, 1], [-0.4, 0.4, 1]]}
        for projection in ({}, {"projection": "panorama"}, {"projection": "orthographic", "view_height": 3}):
            self.scene = self.write_scene("door.json", [], models=[{"file": "triangle.obj"}], ambient=1,
                                          cells={"cells": rooms, "portals": [door]},
                                          camera={"position": [0, 0, 3], "look_at": [0, 0, 0], **projection})
            self.assert_same_as_cpu("cells-pixel")
        self.assert_done(self.draw("vertex.exr", "--aov", "--samples", 1, "--method", "cells"))
        self.assertEqual(nebel("compare", "vertex.exr", "gl.exr", "-c", "transmittance.G", "--fail-above", 1e-2, cwd=self.folder).returncode, 1)

    # All that is drawn in between is in floats of 32 bits.
    def assert_same_as_cpu(self, method, *words, **more):
        self.assert_done(self.render("cpu.exr", "--aov", "--samples", 1, "--method", method, *words))
        drawn = self.draw("gl.exr", "--aov", "--samples", 1, "--method", method, *words, **more)
        self.assert_done(drawn)
        for channel, most in (("R", 1e-5), ("transmittance.G", 1e-5), ("in_scattering.B", 1e-5)):
            self.assert_done(nebel("compare", "cpu.exr", "gl.exr", "-c", channel, "--fail-above", most, cwd=self.folder))
        return drawn.err

    def write_classic(self, classic, **more):
        camera = {"position": [0.4, 0.3, 3], "look_at": [0, 0, 0], **more}
        self.scene = self.write_scene("classic.json", [FOG], models=[{"file": "triangle.obj"}], background=1, ambient=1,
                                      classic=classic, camera=camera, sun={"direction": [0, 0, 1], "irradiance": 1})

    def test_fog_factors(self):
        for projection in ({}, {"projection": "panorama"}, {"projection": "orthographic", "view_height": 3}):
            for coordinate in ("plane", "radial"):
                for stage in ("vertex", "pixel"):
                    self.write_classic({"start": 2.5, "end": 4, "density": 0.2, "color": [0.9, 0.5, 0.1], "coordinate": coordinate,
                                        "stage": stage}, **projection)
                    for method in ("linear", "exp", "exp2"):
                        self.assert_same_as_cpu(method)
        self.scene = self.write_scene("bare.json", [FOG])
        for device in ("cpu", "gl"):
            for method in ("exp", "fog-coord", "alpha"):
                self.assert_failed(self.render("a.png", "--method", method, "--device", device), "classic", f"--method {method}")
            self.assert_failed(self.render("a.png", "--method", "d3d9", "--device", device), '"d3d9"', "--method d3d9")

    def test_what_hardware_is_given(self):
        curves = ({}, {"curve": "linear"}, {"curve": "exp2"}, {"table": [0, 0.1, 0.6, 1]})
        for projection in ({}, {"projection": "panorama"}, {"projection": "orthographic", "view_height": 3}):
            for curve in curves if not projection else curves[:2]:
                self.write_classic({"color": [0.9, 0.5, 0.1], **curve}, **projection)
                for method in ("fog-coord", "two-pass", "alpha"):
                    self.assert_same_as_cpu(method)
            for stage in ("vertex", "pixel"):
                self.write_classic({"color": [0.9, 0.5, 0.1], "coordinate": "user", "start": 10, "end": 90, "density": 0.04,
                                    "stage": stage}, **projection)
                for method in ("linear", "exp", "exp2"):
                    self.assert_same_as_cpu(method)

    def test_the_fixed_pipeline_or_shaders(self):
        """Both draw the same; which one it is is said."""
        core = {"MESA_GL_VERSION_OVERRIDE": "3.3FC"}
        for curve in ({}, {"curve": "exp2"}):
            self.write_classic({"color": [0.9, 0.5, 0.1], **curve})
            for method in ("fog-coord", "two-pass", "alpha"):
                said = self.assert_same_as_cpu(method)
                self.assertIn("Compatibility Profile", said)
                self.assertNotIn("shaders", said)
                said = self.assert_same_as_cpu(method, env=core)
                self.assertNotIn("Compatibility Profile", said)
                self.assertIn(f"--method {method} is drawn by shaders, not by the fixed pipeline, because the driver has no", said)
        self.write_classic({"color": 1}, projection="panorama")
        self.assertIn("drawn by shaders", self.draw("a.png", "--method", "alpha").err)

    def test_samples_of_the_fixed_pipeline(self):
        self.write_classic({"color": [0.9, 0.5, 0.1]})
        self.assert_done(self.draw("four.exr", "--aov", "--samples", 3, "--method", "fog-coord"))
        self.assert_done(self.render("cpu.exr", "--aov", "--samples", 4, "--method", "fog-coord"))
        self.assert_done(self.draw("one.exr", "--aov", "--samples", 1, "--method", "fog-coord"))
        # Edges are smooth; the places of samples are others than the CPU's.
        for channel in ("G", "transmittance.G", "normal.Z"):
            far = [float(re.search(r"RMSE: (\S+)", nebel("compare", "cpu.exr", f"{name}.exr", "-c", channel, cwd=self.folder).out)[1])
                   for name in ("one", "four")]
            self.assertLess(far[1], 0.6 * far[0], channel)

    def test_direct3d_states(self):
        numbers = {"fog_start": 2.5, "fog_end": 4, "fog_density": 0.2, "fog_color": [0.9, 0.5, 0.1]}
        states = ({}, {"fog_table_mode": "linear"}, {"fog_table_mode": "exp2"}, {"fog_vertex_mode": "exp"},
                  {"fog_vertex_mode": "linear", "range_fog_enable": True}, {"fog_vertex_mode": "exp", "fog_table_mode": "exp"})
        for projection in ({}, {"projection": "panorama"}, {"projection": "orthographic", "view_height": 3}):
            for state in states if not projection else states[:4]:
                self.write_classic({"d3d9": {**numbers, **state}}, **projection)
                self.assert_same_as_cpu("d3d9")

    def test_tessellation(self):
        box = {"shape": {"type": "box", "min": [-9, -0.5, -9], "max": [9, 0.5, 9]}, "extinction": 0.3, "source": 1}
        self.scene = self.write_scene("box.json", [box], models=[{"file": "triangle.obj"}], background=1, ambient=1,
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.assert_done(self.draw("coarse.exr", "--samples", 1, "--method", "vertex"))
        for method in ("vertex", "additive"):
            self.assert_same_as_cpu(method, "--tessellate", 0.004)
        self.assertIn("triangles became", self.draw("gl.exr", "--samples", 1, "--method", "vertex", "--tessellate", 0.004).err)
        self.assertEqual(nebel("compare", "coarse.exr", "gl.exr", "--fail-above", 1e-3, cwd=self.folder).returncode, 1)

    def test_what_is_of_the_cpu_alone(self):
        for words in (("--threads", 2), ("--isa", "scalar"), ("--tolerance", 0.1)):
            self.assert_misused(self.draw("a.png", *words), words[0], "--device cpu")
        self.assertNotIn("a.png", self.files())

    def test_other_cameras(self):
        camera = {"position": [0.3, 0.2, 1.5], "look_at": [0, 0, 0]}
        for projection, more in (("panorama", {}), ("orthographic", {"view_height": 3})):
            self.scene = self.write_scene("round.json", [FOG], models=[{"file": "triangle.obj"}], background=1,
                                          camera={**camera, "projection": projection, **more})
            for method in ("exact", "vertex"):
                self.assert_done(self.render("cpu.exr", "--aov", "--samples", 1, "--method", method))
                self.assert_done(self.draw("gl.exr", "--aov", "--samples", 1, "--method", method))
                for channel in ("transmittance.R", "in_scattering.B", "normal.Z"):
                    self.assert_done(nebel("compare", "cpu.exr", "gl.exr", "-c", channel, "--fail-above", 1e-4, cwd=self.folder))

    def test_without_a_driver(self):
        nothing = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
        self.assert_failed(self.draw("a.png", env=nothing), "--device gl", "install", "--device cpu")
        self.assertIn("OpenGL: none: ", nebel("info", env=nothing).out)
        self.assertNotIn("a.png", self.files())

    def test_with_a_driver_that_is_too_old(self):
        old = {"MESA_GL_VERSION_OVERRIDE": "2.1", "MESA_GLES_VERSION_OVERRIDE": "2.0"}
        self.assert_failed(self.draw("a.png", env=old), "OpenGL 3.3", "update", "--device cpu")

    def test_opengl_es_says_why(self):
        for version in ("3.0", "3.2"):
            done = self.draw("a.png", env={"MESA_GL_VERSION_OVERRIDE": "2.1", "MESA_GLES_VERSION_OVERRIDE": version})
            self.assert_done(done)
            self.assertIn("OpenGL ES, because the driver has no OpenGL 3.3 core", done.err)

    def test_no_warning_of_what_dims_alone(self):
        cloud = {"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 1}, "count": 200, "radius_range": [0.5, 1], "absorption": 1,
                 "emission": [1, 2, 3], "colors": [[1, 0, 0], [0, 0, 1]]}
        self.scene = self.write_scene("cloud.json", [], nebula=[cloud], models=[{"file": "triangle.obj"}],
                                      sun={"direction": [0, 0, 1], "irradiance": 1}, camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        done = self.draw("a.png")
        self.assert_done(done)
        self.assertNotIn("mixed", done.err)


if __name__ == "__main__":
    unittest.main()
