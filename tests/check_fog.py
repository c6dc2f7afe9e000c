#!/usr/bin/env python3
"""nebel fog: every format of depth, camera and picture against the formulas in double precision, and bad input."""

import json
import math
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy as np

import picture_files as files

NEBEL = os.environ["NEBEL"]
WIDTH, HEIGHT = 83, 47
DICE = np.random.default_rng(35)
AIRLIGHT = (0.8, 0.75, 0.9)
CAMERA = {"fx": 70.5, "fy": 71.5, "cx": 40.25, "cy": 22.75}
INTRINSICS = ("--intrinsics", "70.5,71.5,40.25,22.75")
BASELINE = 0.209313

# Rounding to bytes, and what the header of nebel_apply_fog_to_pixels says of sRGB.
TOLERANCE = 0.501


def decode(c):
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def encode(x):
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.maximum(x, 0) ** (1 / 2.4) - 0.055)


def stretch(camera=None):
    """Meters along the ray for one along the axis; pixel centers are whole numbers."""
    c = camera or CAMERA
    u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return np.sqrt(1 + ((u - c["cx"]) / c["fx"]) ** 2 + ((v - c["cy"]) / c["fy"]) ** 2)


def expected(picture, transmittance, airlight=AIRLIGHT, blend="linear", most=255):
    """In the picture's numbers, before rounding."""
    x, light, t = picture[..., :3] / most, np.asarray(airlight, float), transmittance[..., None]
    if blend == "srgb":
        return most * (x * t + light * (1 - t))
    return most * encode(decode(x) * t + decode(light) * (1 - t))


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nebel-fog-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.picture = DICE.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
        self.image = self.write("image.png", files.png(self.picture))
        self.out = self.folder / "out.png"

    def write(self, name, data):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    def npy(self, name, array):
        path = self.folder / name
        np.save(path, array)
        return path

    def fog(self, *words, **more):
        return subprocess.run([NEBEL, "fog", *map(str, words)], capture_output=True, text=True, timeout=60,
                              cwd=self.folder, **more)

    def assert_done(self, done):
        self.assertEqual(done.returncode, 0, done.stderr)

    def assert_error(self, done, status, *words):
        self.assertEqual(done.returncode, status, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def assert_bytes(self, path, wanted, tolerance):
        got = files.read_png(path.read_bytes())
        difference = got[..., :3] - wanted
        self.assertLess(np.abs(difference).max(), tolerance)
        clear = difference[np.abs(wanted - 255 * np.array(AIRLIGHT)) > 2]
        if np.unique(wanted).size > 1000:  # what is rounded leans to no side: 5 standard deviations
            self.assertLess(abs(clear.mean()), 0.01 + 1.5 / math.sqrt(clear.size))
        return got


# ---- depth --------------------------------------------------------------------------------------


def whole(low, high, *special):
    numbers = DICE.integers(low, high, (HEIGHT, WIDTH), np.uint16)
    numbers.flat[:len(special)] = special
    return numbers


class DepthTest(Case):
    """Each case gives the file, its name, the options, and the length of each ray: NaN unknown, infinite sky."""

    def check(self, data, name, options, length, blends=("linear",)):
        depth = data if isinstance(data, pathlib.Path) else self.write(name, data)
        for blend in blends:
            self.assert_done(self.fog(self.image, "--depth", depth, "-o", self.out, *options, "--visibility", 90,
                                      "--airlight", "0.8,0.75,0.9", "--blend", blend, "--invalid", "keep"))
            sight = np.where(np.isnan(length), 0, length)
            wanted = expected(self.picture, np.exp(math.log(0.05) / 90 * sight), blend=blend)
            got = self.assert_bytes(self.out, wanted, TOLERANCE)
            self.assertTrue((got[np.isnan(length)] == self.picture[np.isnan(length)]).all())

    def test_cityscapes(self):
        p = whole(0, 30000, 0, 1, 2, 65535)
        camera = {"extrinsic": {"baseline": BASELINE, "pitch": 0.03}, "intrinsic": {"fx": 70.5, "fy": 71.5, "u0": 40.25,
                                                                                 "v0": 22.75}}
        path = self.write("camera.json", json.dumps(camera))
        with np.errstate(divide="ignore", invalid="ignore"):
            z = BASELINE * 70.5 / ((p.astype(float) - 1) / 256)
        z[p == 0], z[p == 1] = np.nan, np.inf
        self.check(files.png(p), "d.png", ("--depth-format", "cityscapes", "--camera", path), z * stretch(),
                   ("linear", "srgb"))

    def test_kitti(self):
        p = whole(0, 20000, 0, 1, 65535)
        numbers = "70.5 0 40.25 4.5e+01 0 71.5 22.75 0 0 0 1 0"
        path = self.write("calib.txt", f"P0: {numbers}\nP1: {numbers}\nP2: {numbers}\nP3: {numbers}\nTr: 1 2\n")
        self.check(files.png(p), "d.png", ("--depth-format", "kitti", "--camera", path),
                   np.where(p == 0, np.nan, p / 256.0) * stretch())

    def test_tum(self):
        p = whole(0, 65535, 0, 65535)
        self.check(files.png(p), "d.png", ("--depth-format", "tum", *INTRINSICS),
                   np.where(p == 0, np.nan, p / 5000.0) * stretch())

    def test_scannet(self):
        p = whole(0, 65535, 0, 65535)
        path = self.write("camera.txt", "70.5 0 40.25 0\n0 71.5 22.75 0\n0 0 1 0\n0 0 0 1\n")
        self.check(files.png(p), "d.png", ("--depth-format", "scannet", "--camera", path),
                   np.where(p == 0, np.nan, p / 1000.0) * stretch())

    def test_vkitti(self):
        p = whole(0, 65535, 0, 65535, 65534)
        f = WIDTH / 2 / math.tan(math.radians(40))
        camera = {"fx": f, "fy": f, "cx": (WIDTH - 1) / 2, "cy": (HEIGHT - 1) / 2}
        length = np.where(p == 0, np.nan, np.where(p == 65535, np.inf, p / 100.0)) * stretch(camera)
        self.check(files.png(p), "d.png", ("--depth-format", "vkitti", "--hfov", 80), length)

    def test_carla(self):
        p = DICE.integers(0, 1 << 22, (HEIGHT, WIDTH))
        p.flat[:3] = (1 << 24) - 1, (1 << 24) - 2, 1
        rgb = np.stack([p & 255, p >> 8 & 255, p >> 16], axis=-1).astype(np.uint8)
        z = np.where(p == (1 << 24) - 1, np.inf, 1000 * p / ((1 << 24) - 1.0))
        z[p == 0] = np.nan
        options = ("--depth-format", "carla", *INTRINSICS)
        self.check(files.png(rgb), "d.png", options, z * stretch())
        opaque = np.concatenate([rgb, np.full((HEIGHT, WIDTH, 1), 255, np.uint8)], axis=-1)
        self.check(files.png(opaque), "d.png", options, z * stretch())

    def test_hypersim(self):
        length = DICE.uniform(0.5, 200, (HEIGHT, WIDTH)).astype(np.float32)
        length.flat[:3] = np.nan, np.inf, 0
        wanted = np.where(length == 0, np.nan, length.astype(float))
        self.check(self.npy("d.npy", length), "", ("--depth-format", "hypersim"), wanted)
        self.check(files.exr({"Y": length}), "d.exr", ("--depth-format", "hypersim"), wanted)

    def test_metric_files(self):
        z = DICE.uniform(0.5, 200, (HEIGHT, WIDTH)).astype(np.float32)
        z.flat[:6] = np.nan, np.inf, 0, -3, 1e10, 1e-3
        wanted = np.where((z > 0) & (z < 1e9), z.astype(float), np.where(z >= 1e9, np.inf, np.nan)) * stretch()
        other = {"R": np.ones_like(z), "Z": z, "A": np.zeros_like(z)}
        camera = self.write("c.yml", "%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
                            "   data: [ 70.5, 0., 40.25, 0.,\n     71.5, 22.75, 0., 0., 1. ]\ndist: 1\n")
        self.check(files.exr(other), "d.exr", ("--camera", camera), wanted)
        self.check(files.exr({"depth.Z": z}), "d.exr", INTRINSICS, wanted)
        self.check(files.exr({"left": z, "right": -z}), "d.exr", (*INTRINSICS, "--depth-channel", "left"), wanted)
        self.check(self.npy("d.npy", z.astype(float)), "", INTRINSICS, wanted)
        self.check(files.pfm(z), "d.pfm", INTRINSICS, wanted)
        self.check(files.pfm(z, big=True), "d.pfm", INTRINSICS, wanted)

    def test_metric_numbers(self):
        p = whole(0, 65535, 0, 65535)
        options = (*INTRINSICS, "--depth-scale", 0.002)
        wanted = np.where(p == 0, np.nan, p * 0.002)
        self.check(files.png(p), "d.png", options, wanted * stretch())
        self.check(self.npy("d.npy", p), "", options, wanted * stretch())
        self.check(files.png(p), "d.png", ("--depth-kind", "radial", "--depth-scale", 0.002), wanted)
        small = DICE.integers(0, 256, (HEIGHT, WIDTH), np.uint8)
        self.check(files.png(small), "d.png", (*INTRINSICS, "--depth-scale", 0.5),
                   np.where(small == 0, np.nan, small * 0.5) * stretch())

    def test_inverse_and_disparity(self):
        inverse = DICE.uniform(0.001, 1, (HEIGHT, WIDTH)).astype(np.float32)
        inverse.flat[:3] = 0, np.nan, -1
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.where(inverse >= 0, 1 / (inverse.astype(float) * 0.25), np.nan)
            self.check(files.pfm(inverse), "d.pfm", (*INTRINSICS, "--depth-kind", "inverse", "--depth-scale", 0.25),
                       z * stretch())
            z = np.where(inverse > 0, 0.5 * 70.5 / inverse.astype(float), np.nan)
        camera = self.write("c.txt", "70.5, 71.5, 40.25, 22.75, 0.5\n")
        self.check(files.pfm(inverse), "d.pfm", ("--camera", camera, "--depth-kind", "disparity"), z * stretch())


# ---- pictures, policies and light ---------------------------------------------------------------


class PictureTest(Case):
    def setUp(self):
        super().setUp()
        self.length = DICE.uniform(0.5, 120, (HEIGHT, WIDTH)).astype(np.float32)
        self.depth = self.write("d.pfm", files.pfm(self.length))
        self.common = ("--depth", self.depth, "--depth-kind", "radial", "--airlight", "0.8,0.75,0.9")
        self.transmittance = np.exp(-0.02 * self.length.astype(float))

    def test_sixteen_bits_and_alpha(self):
        for channels in (1, 2, 3, 4):
            for kind, most in ((np.uint8, 255), (np.uint16, 65535)):
                picture = DICE.integers(0, most + 1, (HEIGHT, WIDTH, channels)).astype(kind)
                image = self.write("p.png", files.png(picture))
                self.assert_done(self.fog(image, "-o", self.out, *self.common, "--extinction", 0.02))
                color = picture if channels > 2 else np.repeat(picture[..., :1], 3, axis=-1)
                wanted = expected(color, self.transmittance, most=most)
                got = files.read_png(self.out.read_bytes())
                self.assertEqual(got.dtype, kind)
                self.assertLess(np.abs(got[..., :3] - wanted).max(), TOLERANCE if most == 255 else 0.9)
                if channels % 2 == 0:
                    self.assertTrue((got[..., 3] == picture[..., -1]).all())

    def test_jpeg(self):
        image = self.write("p.jpg", files.GRAY_JPEG)
        depth = self.write("small.pfm", files.pfm(np.full((8, 16), 30, np.float32)))
        self.assert_done(self.fog(image, "-o", self.out, "--depth", depth, *self.common[2:], "--extinction", 0.02))
        picture = np.full((8, 16, 3), 128, np.uint8)
        picture[:, 8:] = 200
        self.assert_bytes(self.out, expected(picture, np.full((8, 16), math.exp(-0.6))), TOLERANCE)

    def test_light(self):
        planes = {n: DICE.uniform(0, 20, (HEIGHT, WIDTH)).astype(np.float32) for n in "RGBA"}
        image = self.write("p.exr", files.exr({**planes, "other": planes["R"]}))
        out = self.folder / "out.exr"
        self.assert_done(self.fog(image, "-o", out, "--depth", self.depth, "--depth-kind", "radial", "--extinction",
                                  0.02, "--airlight", "3,0.5,0"))
        got = files.read_exr(out.read_bytes())
        for name, light in zip("RGB", (3, 0.5, 0)):
            wanted = planes[name] * self.transmittance + light * (1 - self.transmittance)
            self.assertLess(np.abs(got[name] - wanted).max(), 20 * 3e-6)
        self.assertTrue((got["A"] == planes["A"]).all())

    def test_contrast_and_summary(self):
        done = self.fog(self.image, "-o", self.out, *self.common, "--visibility", 150, "--contrast", 0.02)
        self.assert_done(done)
        beta = -math.log(0.02) / 150
        self.assertIn(f"extinction {beta:.6g} per meter, airlight 0.800,0.750,0.900, blended in linear light", done.stderr)
        self.assert_bytes(self.out, expected(self.picture, np.exp(-beta * self.length)), TOLERANCE)

    def test_transmittance(self):
        png, exr = self.folder / "t.png", self.folder / "t.exr"
        for path in (png, exr):
            self.assert_done(self.fog(self.image, "-o", self.out, *self.common, "--extinction", 0.02, "--transmittance", path))
        got = files.read_png(png.read_bytes())[..., 0] / 65535
        self.assertLess(np.abs(got - self.transmittance).max(), 0.5 / 65535 + 3e-6)
        for plane in files.read_exr(exr.read_bytes()).values():
            self.assertLess(np.abs(plane - self.transmittance).max(), 3e-6)

    def fill(self, rows):
        """The larger of the nearest known to the left and right."""
        filled = rows.copy()
        for y, x in np.argwhere(np.isnan(rows)):
            known = np.flatnonzero(~np.isnan(rows[y]))
            ends = [known[known < x][-1:], known[known > x][:1]]
            values = [rows[y, i] for end in ends for i in end]
            filled[y, x] = max(values) if values else np.nan
        return filled

    def test_policies(self):
        length = self.length.astype(float)
        length[DICE.uniform(size=length.shape) < 0.3] = np.nan
        length[DICE.uniform(size=length.shape) < 0.1] = np.inf
        length[7:9], length[0] = np.nan, np.nan
        depth = self.write("d.pfm", files.pfm(length.astype(np.float32)))
        rows = self.fill(length)
        cases = {("inpaint", "far"): self.fill(rows.T).T, ("far", "far"): np.where(np.isnan(length), np.inf, length),
                 ("keep", "far"): np.where(np.isnan(length), 0, length)}
        filled = cases["inpaint", "far"]
        cases["inpaint", "keep"] = np.where(np.isinf(filled), 0, filled)
        cases["inpaint", "77"] = np.where(np.isinf(filled), 77, filled)
        for (invalid, sky), wanted in cases.items():
            self.assert_done(self.fog(self.image, "-o", self.out, *self.common, "--depth", depth, "--extinction", 0.02,
                                      "--invalid", invalid, "--sky", sky))
            self.assert_bytes(self.out, expected(self.picture, np.exp(-0.02 * wanted)), TOLERANCE)

    def dark_channel_light(self, picture):
        """By brute force, as the sources define it."""
        dark, reach = picture.min(axis=2), 7
        padded = np.pad(dark, reach, constant_values=np.iinfo(picture.dtype).max)
        windows = np.lib.stride_tricks.sliding_window_view(padded, (15, 15))
        least = windows.min(axis=(2, 3)).ravel()
        threshold = np.sort(least)[::-1][max(1, least.size // 1000) - 1]
        colors = picture.reshape(-1, 3)[least >= threshold]
        brightness = np.rint(colors @ (299, 587, 114) * 257 / 1000 if picture.dtype == np.uint8 else
                             colors @ (0.299, 0.587, 0.114))
        return colors[np.argsort(brightness, kind="stable")[(len(colors) - 1) // 2]]

    def test_estimated_airlight(self):
        for kind in (np.uint8, np.uint16):
            picture = DICE.integers(0, np.iinfo(kind).max // 2, (HEIGHT * 3, WIDTH * 2, 3)).astype(kind)
            picture[10:60, 20:90] += np.iinfo(kind).max // 2
            image = self.write("p.png", files.png(picture))
            depth = self.npy("far.npy", np.full(picture.shape[:2], np.inf, np.float32))
            self.assert_done(self.fog(image, "-o", self.out, "--depth", depth, "--depth-kind", "radial", "--visibility", 9))
            got = files.read_png(self.out.read_bytes())
            self.assertTrue((np.abs(got.astype(int) - self.dark_channel_light(picture).astype(int)) <= 1).all())

    def test_threads_give_the_same_bytes(self):
        results = set()
        for threads in (1, 2, 7):
            self.assert_done(self.fog(self.image, "-o", self.out, *self.common, "--extinction", 0.02, "-t", threads))
            results.add(self.out.read_bytes())
        self.assertEqual(len(results), 1)


# ---- scenes -------------------------------------------------------------------------------------


class SceneTest(Case):
    camera = {"position": [3, 2, 1], "look_at": [4, 2.2, 0.2], "vertical_fov": 50}

    def write_scene(self, fog, **more):
        return self.write("scene.json", json.dumps({"nebel": 1, "fog": fog, "camera": self.camera, **more}))

    def rays(self):
        position, target = np.array(self.camera["position"], float), np.array(self.camera["look_at"], float)
        ahead = (target - position) / np.linalg.norm(target - position)
        right = np.cross(ahead, (0, 1, 0))
        right /= np.linalg.norm(right)
        up = np.cross(right, ahead)
        u, v = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
        x, y = (u - CAMERA["cx"]) / CAMERA["fx"], (v - CAMERA["cy"]) / CAMERA["fy"]
        return position, ahead + x[..., None] * right - y[..., None] * up

    def test_fog_below_a_height_has_its_closed_form(self):
        z = DICE.uniform(0.5, 60, (HEIGHT, WIDTH)).astype(np.float32)
        z.flat[:4] = np.inf
        depth = self.npy("d.npy", z)
        extinction, source, top = np.array([0.03, 0.05, 0.08]), np.array([0.5, 0.6, 0.7]), 1.5
        scene = self.write_scene([{"shape": {"type": "half_space", "point": [0, top, 0], "normal": [0, 1, 0]},
                                   "extinction": list(extinction), "source": list(source)}])
        position, way = self.rays()
        with np.errstate(divide="ignore", invalid="ignore"):
            meets = (top - position[1]) / way[..., 1]
        inside = np.where(way[..., 1] < 0, np.maximum(0, z - meets), 0) * np.linalg.norm(way, axis=-1)
        t = np.exp(-extinction * inside[..., None])
        wanted = 255 * encode(decode(self.picture / 255) * t + source * (1 - t))
        self.assert_done(self.fog(self.image, "--depth", depth, *INTRINSICS, "--scene", scene, "-o", self.out,
                                  "--transmittance", "t.exr"))
        self.assert_bytes(self.out, wanted, TOLERANCE)
        planes = files.read_exr((self.folder / "t.exr").read_bytes())
        for name, wanted_plane in zip("RGB", np.moveaxis(t, -1, 0)):
            self.assertLess(np.abs(planes[name] - wanted_plane).max(), 1e-5)

    def test_noise_and_sunlight_are_the_same_for_any_threads(self):
        fog = [{"shape": {"type": "box", "min": [-20, 0, -20], "max": [30, 6, 20]}, "extinction": 0.1, "albedo": 0.9,
                "density": {"type": "noise", "size": [24, 8, 24], "cells": [3, 1, 3], "seed": 5}}]
        scene = self.write_scene(fog, sun={"direction": [0.3, 1, 0.2], "irradiance": 5})
        depth = self.npy("d.npy", np.full((HEIGHT, WIDTH), 25, np.float32))
        results = set()
        for threads in (1, 3):
            self.assert_done(self.fog(self.image, "--depth", depth, "--scene", scene, "-o", self.out, "-t", threads))
            results.add(self.out.read_bytes())
        self.assertEqual(len(results), 1)
        changed = files.read_png(self.out.read_bytes()).astype(int) - self.picture
        self.assertGreater(np.abs(changed).mean(), 5)

    def test_a_seed_gives_each_name_its_own_noise(self):
        fog = [{"shape": {"type": "box", "min": [-20, 0, -20], "max": [30, 6, 20]}, "extinction": 0.3, "source": 0.9,
                "density": {"type": "noise", "size": [24, 8, 24], "cells": [3, 1, 3], "seed": 5}}]
        scene = self.write_scene(fog)
        depth = self.npy("d.npy", np.full((HEIGHT, WIDTH), 25, np.float32))
        for name in ("a.png", "b.png", "sub/a.png", "sub/c.png"):
            self.write(name, files.png(self.picture))
        (self.folder / "out/sub").mkdir(parents=True)

        def results(*words):
            for image, out in (("*.png", "out/*.png"), ("sub/*.png", "out/sub/*.png")):
                self.assert_done(self.fog(image, "--depth", depth, "--scene", scene, "-o", out, *words))
            return [(self.folder / "out" / name).read_bytes() for name in ("a.png", "b.png", "sub/a.png", "sub/c.png")]

        self.image.unlink()
        same, first, again, second = results(), results("--seed", 1, "-t", 1), results("--seed", 1, "-t", 3), results("--seed", 2)
        self.assertEqual(len(set(same)), 1)
        self.assertEqual(len(set(first)), 3)
        self.assertEqual(first[0], first[2])
        self.assertEqual(first, again)
        self.assertEqual(len(set(same + first + second)), 7)

    def test_frames_of_a_scene(self):
        """At their keys camera and fog are what a scene that stands still has, and names give each picture its own frame."""
        shape = {"type": "half_space", "point": [0, 1.5, 0], "normal": [0, 1, 0]}
        keys = [{"frame": f, "position": [3, 2, 1 - f / 10], "look_at": [4, 2 + f / 20, 0.2]} for f in (0, 10, 20)]
        fog = {"shape": shape, "extinction": 0.02, "source": 0.6,
               "keys": [{"frame": 0}, {"frame": 10, "extinction": 0.05}, {"frame": 20, "extinction": 0.1}]}
        moving = self.write("moving.json", json.dumps({"nebel": 1, "fog": [fog], "camera": {"vertical_fov": 50, "keys": keys}}))
        depth = self.npy("d.npy", DICE.uniform(0.5, 60, (HEIGHT, WIDTH)).astype(np.float32))
        (self.folder / "film").mkdir()
        wanted = {}
        for key, extinction in zip(keys, (0.02, 0.05, 0.1)):
            still = self.write_scene([{"shape": shape, "extinction": extinction, "source": 0.6}],
                                     camera={"position": key["position"], "look_at": key["look_at"], "vertical_fov": 50})
            self.assert_done(self.fog(self.image, "--depth", depth, "--scene", still, "-o", "still.png"))
            wanted[key["frame"]] = files.read_png((self.folder / "still.png").read_bytes())
            self.assert_done(self.fog(self.image, "--depth", depth, "--scene", moving, "--frame", key["frame"], "-o", "one.png"))
            self.assertTrue((files.read_png((self.folder / "one.png").read_bytes()) == wanted[key["frame"]]).all())
            shutil.copy(self.image, self.folder / f"film/town_3_{key['frame']:06d}_left8bit.png")
        self.assertFalse((wanted[0] == wanted[10]).all())
        shutil.copy(self.image, self.folder / "film/town_none_left8bit.png")
        shutil.copy(self.image, self.folder / "film/town_1000001_left8bit.png")
        done = self.fog("film/*_left8bit.png", "--depth", depth, "--scene", moving, "--frame", "name", "-o", "out/*.png")
        self.assert_error(done, 1, "film/town_none_left8bit.png: --frame name: there is no number", "town_1000001", "3 pictures, 2 failed")
        for frame, picture in wanted.items():
            got = files.read_png((self.folder / f"out/town_3_{frame:06d}.png").read_bytes())
            self.assertTrue((got == picture).all(), frame)
        base = (self.image, "--depth", depth, "-o", self.out)
        for frame in ("names", "-1", "1.5", "1000001"):
            self.assert_error(self.fog(*base, "--scene", moving, "--frame", frame), 2, "--frame")
        self.assert_error(self.fog(*base, "--visibility", 9, "--frame", 1), 2, "needs --scene")
        sun = {"irradiance": 5, "direction": [0, 1, 0], "keys": [{"frame": 0, "direction": [0, 1, 0]}, {"frame": 9, "direction": [1, 1, 0]}]}
        sunny = self.write_scene([fog], sun=sun)
        self.assert_error(self.fog(*base, "--scene", sunny, "--frame", "name"), 1, "the sun has keys")
        self.assert_done(self.fog(*base, "--scene", sunny, "--frame", 5))

    def test_what_does_not_go_together(self):
        scene = self.write_scene([])
        base = (self.image, "--depth", self.npy("d.npy", np.ones((HEIGHT, WIDTH), np.float32)), "-o", self.out)
        for option, value in (("visibility", 9), ("extinction", 1), ("airlight", "1,1,1"), ("blend", "srgb")):
            self.assert_error(self.fog(*base, "--scene", scene, f"--{option}", value), 2, option, "beside --scene")
        self.assert_error(self.fog(*base, "--visibility", 9, "--seed", 1), 2, "needs --scene")
        self.camera = {**self.camera, "projection": "orthographic", "view_height": 3}
        del self.camera["vertical_fov"]
        self.assert_error(self.fog(*base, "--scene", self.write_scene([])), 1, "perspective")


# ---- many files ---------------------------------------------------------------------------------


class NamesTest(Case):
    def setUp(self):
        super().setUp()
        for town in ("aachen", "ulm"):
            (self.folder / "out" / town).mkdir(parents=True)
            for i in range(3):
                self.write(f"left/{town}/{i}_left.png", files.png(self.picture))
                self.write(f"depth/{town}/{i}_depth.pfm", files.pfm(np.full((HEIGHT, WIDTH), 10 + i, np.float32)))
        self.common = ("--depth-kind", "radial", "--extinction", 0.02, "--airlight", "0.8,0.75,0.9")

    def outputs(self):
        return sorted(str(p.relative_to(self.folder)) for p in (self.folder / "out").rglob("*") if p.is_file())

    def test_stars_in_folders_and_names(self):
        done = self.fog("left/*/*_left.png", "--depth", "depth/*/*_depth.pfm", "-o", "out/*/*_foggy.png", *self.common)
        self.assert_done(done)
        self.assertIn("6 pictures", done.stderr)
        self.assertEqual(self.outputs(), [f"out/{t}/{i}_foggy.png" for t in ("aachen", "ulm") for i in range(3)])
        for i in range(3):
            wanted = expected(self.picture, np.full((HEIGHT, WIDTH), math.exp(-0.02 * (10 + i))))
            self.assert_bytes(self.folder / f"out/ulm/{i}_foggy.png", wanted, TOLERANCE)

    def test_links_that_lead_to_nothing_are_errors_of_their_own(self):
        (self.folder / "left/ulm/9_left.png").symlink_to("../elsewhere/9.png")
        (self.folder / "left/ulm/folder_left.png").mkdir()
        done = self.fog("left/*/*_left.png", "--depth", "depth/ulm/0_depth.pfm", "-o", "out/*/*_foggy.png", *self.common)
        self.assert_error(done, 1, "cannot read the picture \"left/ulm/9_left.png\": No such file", "6 pictures, 1 failed")

    def test_folders_of_results_are_made(self):
        done = self.fog("left/*/*_left.png", "--depth", "depth/*/*_depth.pfm", "-o", "out/*/a/b/*.png", "--transmittance", "t/*/*.png",
                        *self.common)
        self.assert_done(done)
        self.assertEqual(self.outputs(), [f"out/{t}/a/b/{i}.png" for t in ("aachen", "ulm") for i in range(3)])
        self.assertEqual(len(list((self.folder / "t").glob("*/*.png"))), 6)

    def test_names_without_stars_give_their_stem(self):
        self.assert_done(self.fog("left/ulm/0_left.png", "left/ulm/2_left.png", "--depth", "depth/ulm/1_depth.pfm", "-o",
                                  "out/*.png", *self.common))
        self.assertEqual(self.outputs(), ["out/0_left.png", "out/2_left.png"])

    def test_threads_give_the_same_bytes(self):
        results = []
        for threads in (1, 4):
            self.assert_done(self.fog("left/*/*_left.png", "--depth", "depth/*/*_depth.pfm", "-o", "out/*/*.png",
                                      *self.common[:4], "-t", threads))
            results.append([(self.folder / name).read_bytes() for name in self.outputs()])
        self.assertEqual(len(results[0]), 6)
        self.assertEqual(results[0], results[1])

    def test_a_signal_leaves_whole_pictures(self):
        picture = np.tile(self.picture, (10, 10, 1))
        first = self.write("big/0.png", files.png(picture))
        for i in range(1, 60):
            os.link(first, self.folder / f"big/{i}.png")
        depth = self.npy("d.npy", np.full(picture.shape[:2], 20, np.float32))
        words = [NEBEL, "fog", "big/*.png", "--depth", str(depth), "-o", "out/*.png", *map(str, self.common), "-t", "2"]
        running = subprocess.Popen(words, cwd=self.folder, stderr=subprocess.PIPE, text=True)
        while not self.outputs() and running.poll() is None:
            time.sleep(0.01)
        running.send_signal(signal.SIGINT)
        self.assertIn("stopped", running.communicate(timeout=60)[1])
        self.assertEqual(running.returncode, -signal.SIGINT)
        self.assertLess(len(self.outputs()), 60)
        for name in self.outputs():
            self.assertEqual(files.read_png((self.folder / name).read_bytes()).shape, picture.shape)

    def test_a_fault_of_one_leaves_the_others(self):
        (self.folder / "depth/aachen/1_depth.pfm").unlink()
        self.write("left/aachen/2_left.png", b"\x89PNG\r\n\x1a\nno more")
        self.write("depth/ulm/0_depth.pfm", files.pfm(np.ones((HEIGHT, WIDTH + 1), np.float32)))
        done = self.fog("left/*/*_left.png", "--depth", "depth/*/*_depth.pfm", "-o", "out/*/*.png", *self.common, "-t", 3)
        self.assert_error(done, 1, "depth/aachen/1_depth.pfm\": No such file", "left/aachen/2_left.png: not a good PNG",
                          "left/ulm/0_left.png: the picture is 83 x 47 pixels, its depth \"depth/ulm/0_depth.pfm\" 84 x 47")
        self.assertEqual(self.outputs(), ["out/aachen/0.png", "out/ulm/1.png", "out/ulm/2.png"])

    def test_names_that_do_not_fit(self):
        base = ("left/*/*_left.png", *self.common)
        depth = ("--depth", "depth/*/*_depth.pfm")
        self.assert_error(self.fog(*base, *depth, "-o", "out/*.png"), 2, "--output", "1 stars", "have 2")
        self.assert_error(self.fog(*base, "--depth", "*.pfm", "-o", "out/*/*.png"), 2, "--depth")
        self.assert_error(self.fog(*base, *depth, "-o", "out/one.png"), 2, "written twice")
        self.assert_error(self.fog("right/*.png", *depth, "-o", "out/*/*.png", *self.common), 2, "--depth")
        self.assert_error(self.fog("left/*_right.png", "--depth", "a", "-o", "out/*.png", *self.common), 1,
                          "no file matches 'left/*_right.png'")
        self.assertEqual(self.outputs(), [])

    def test_results_that_are_one_file_by_two_names(self):
        (self.folder / "out/real").mkdir()
        (self.folder / "out/link").symlink_to("real")
        (self.folder / "out/real/other.png").symlink_to("one.png")
        call = ("left/ulm/1_left.png", "--depth", "depth/ulm/1_depth.pfm", *self.common)
        for one, two in (("out/one.png", "./out/one.png"), ("out/one.png", "out//one.png"), ("one.png", str(self.folder / "one.png")),
                         ("out/real/one.png", "out/link/one.png"), ("out/real/one.png", "out/link/../link/one.png"),
                         ("out/link/new/a/one.png", "out/real/new/./a/one.png"), ("out/real/n/one.png", "out/real/m/../n/one.png"),
                         ("out/real/one.png", "out/real/other.png")):
            with self.subTest(two):
                done = self.fog(*call, "-o", one, "--transmittance", two)
                self.assert_error(done, 2, "written twice", one, two)
        self.assertEqual(self.outputs(), [])
        self.assert_done(self.fog(*call, "-o", "out/link/a/one.png", "--transmittance", "out/real/b/one.png"))
        self.assert_done(self.fog(*call, "-o", "/dev/null", "--transmittance", "/dev/null"))

    def test_what_is_read_is_not_written(self):
        (self.folder / "link.png").symlink_to("left/ulm/1_left.png")
        depth = ("--depth", "depth/ulm/0_depth.pfm")
        before = (self.folder / "left/ulm/1_left.png").read_bytes()
        for out in ("left/ulm/1_left.png", "left/../left/ulm/1_left.png", "link.png"):
            self.assert_error(self.fog("left/ulm/*_left.png", *depth, "-o", out, *self.common), 2, "written twice")
            self.assert_error(self.fog("left/ulm/1_left.png", *depth, "-o", out, *self.common), 1, "is one of the files")
        self.assertEqual((self.folder / "left/ulm/1_left.png").read_bytes(), before)
        done = self.fog("left/ulm/*_left.png", *depth, "-o", "left/ulm/*_left.png", *self.common)
        self.assert_error(done, 1, "is one of the files")
        self.assertEqual(done.stderr.count("\n"), 1)

    def test_one_result_in_the_place_of_something_read_leaves_the_others(self):
        (self.folder / "out/1.png").symlink_to("../left/ulm/1_left.png")
        (self.folder / "t2.png").symlink_to("depth/ulm/0_depth.pfm")
        before = (self.folder / "left/ulm/1_left.png").read_bytes()
        done = self.fog("left/ulm/*_left.png", "--depth", "depth/ulm/*_depth.pfm", "-o", "out/*.png", "--transmittance", "t*.png",
                        *self.common)
        self.assert_error(done, 1, 'cannot write "out/1.png": it is one of the files that are read', 'cannot write "t2.png"')
        self.assertIn("1 picture, 2 failed", done.stderr)
        self.assertEqual((self.folder / "left/ulm/1_left.png").read_bytes(), before)
        self.assertEqual(self.outputs(), ["out/0.png", "out/1.png"])

    def test_a_full_disk_leaves_nothing_half(self):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))
        done = self.fog("left/ulm/*_left.png", "--depth", "depth/ulm/*_depth.pfm", "-o", "out/*.png", *self.common,
                        preexec_fn=limit)
        self.assert_error(done, 1, "cannot write \"out/0.png\"", "cannot write \"out/2.png\"")
        self.assertEqual(self.outputs(), [])


# ---- bad input ----------------------------------------------------------------------------------


class BadInputTest(Case):
    def refuse(self, data, name, options, *words, status=1):
        depth = data if isinstance(data, pathlib.Path) else self.write(name, data)
        done = self.fog(self.image, "--depth", depth, "-o", self.out, "--visibility", 50, *options)
        self.assert_error(done, status, *words)
        self.assertFalse(self.out.exists())
        self.assertFalse(any(".nebel" in p.name or p.name.endswith(".tmp") for p in self.folder.iterdir()))

    def test_depth(self):
        good = np.ones((HEIGHT, WIDTH), np.float32)
        npy = self.npy("good.npy", good).read_bytes()
        self.refuse(files.pfm(good[:-1]), "d.pfm", INTRINSICS, "83 x 46")
        self.refuse(files.pfm(good * np.nan), "d.pfm", INTRINSICS, "depth of no pixel is known")
        self.refuse(files.pfm(good), "d.pfm", (), "--camera, --intrinsics or --hfov")
        self.refuse(files.pfm(good), "d.pfm", (*INTRINSICS, "--depth-format", "kitti"), "floats", "kitti", "--depth-format")
        self.refuse(files.png(good.astype(np.uint8)), "d.png", (*INTRINSICS, "--depth-format", "tum"), "8 bits", "16 bits")
        self.refuse(files.png(good.astype(np.uint16)), "d.png", INTRINSICS, "--depth-scale")
        self.refuse(files.png(np.ones((HEIGHT, WIDTH, 3), np.uint8)), "d.png", INTRINSICS, "RGB of 8 bits",
                    "whole numbers of 16 bits, gray or floats or whole numbers of 8 bits, gray")
        self.refuse(files.png(good.astype(np.uint16)), "d.png", (*INTRINSICS, "--depth-format", "cityscapes"), "baseline")
        self.refuse(files.exr({"R": good, "G": good}), "d.exr", INTRINSICS, "which channel", " R G")
        self.refuse(files.exr({"Z": good}), "d.exr", (*INTRINSICS, "--depth-channel", "W"), "no channel W", " Z")
        self.refuse(b"\x89HDF\r\n\x1a\n" + bytes(99), "d.h5", INTRINSICS, "HDF5", "numpy.save")
        self.refuse(b"nonsense", "d.bin", INTRINSICS, "PNG, OpenEXR, NPY or PFM")
        self.refuse(files.pfm(good)[:-1], "d.pfm", INTRINSICS, "ends too early")
        self.refuse(npy[:-1], "d.npy", INTRINSICS, "ends too early")
        self.refuse(npy[:60], "d.npy", INTRINSICS, "header")
        self.refuse(b"Pf\n99999999 99999999\n-1\n", "d.pfm", INTRINSICS, "at most 2^28 pixels")
        for scale in (b"0", b"nan", b"inf", b"abc", b"--1", b"1,0"):  # its sign is the order of bytes
            self.refuse(files.pfm(good).replace(b"\n-1.0\n", b"\n" + scale + b"\n"), "d.pfm", INTRINSICS, "width, height and scale")
        self.refuse(files.pfm(good).replace(b"Pf", b"PF"), "d.pfm", INTRINSICS, "in color")
        self.refuse(self.npy("d.npy", np.asfortranarray(good)), "", INTRINSICS, "Fortran")
        self.refuse(self.npy("d.npy", good[..., None]), "", INTRINSICS, "two dimensions")
        self.refuse(self.npy("d.npy", good.astype(">f4")), "", INTRINSICS, "little endian")
        self.refuse(self.npy("d.npy", good.astype(np.int64)), "", INTRINSICS, "'<i8'")
        self.refuse(self.folder / "none.png", "", INTRINSICS, "No such file")
        os.mkfifo(self.folder / "pipe")
        self.refuse(self.folder / "pipe", "", INTRINSICS, "a device, a pipe or a socket")

    def test_cameras(self):
        depth = self.npy("d.npy", np.ones((HEIGHT, WIDTH), np.float32))
        city = '{"intrinsic": {"fx": %s, "fy": 1, "u0": 1, "v0": 1}, "extrinsic": {"baseline": 1}}'
        for text, word in (("nan 1 1 1", "not a camera"), ("1 2 3", "fx fy cx cy"), ("0 1 1 1", "focal"), ("-5 1 1 1", "focal"), ("1e-300 1 1 1", "focal"),
                           ("1e400 1 1 1", "focal"), ("1 1 inf 1", "not a camera"), ("", "fx fy cx cy"), ("\0", "no text"),
                           ("1 1 1 1 -2", "baseline"), (city % "0", "focal"), (city % '"7"', "intrinsic"),
                           (city % "NaN", "c.txt:1:"), ("P2: 1 2 3\n", "12 numbers"), ("camera_matrix:\n data: [1, 2", "9 numbers"),
                           ("1 2 3 4 5 6", "fx fy cx cy")):
            self.refuse(depth, "", ("--camera", self.write("c.txt", text)), word)
        for option, value in (("intrinsics", "nan,1,1,1"), ("intrinsics", "1,1,1"), ("intrinsics", "0,1,1,1"), ("intrinsics", "1,1e-300,1,1"),
                              ("intrinsics", "1,1,1,1,1"), ("hfov", "180"), ("hfov", "nan")):
            self.refuse(depth, "", (f"--{option}", value), option, status=2)
        self.refuse(depth, "", (*INTRINSICS, "--hfov", 50), "another way", status=2)

    def test_a_picture_that_is_too_wide_is_named(self):
        image = self.write("wide.png", files.png(np.zeros((1, 65537, 3), np.uint8)))
        depth = self.write("wide.pfm", files.pfm(np.ones((1, 65537), np.float32)))
        done = self.fog(image, "--depth", depth, *INTRINSICS, "--visibility", 9, "-o", self.out, "--airlight", "1,1,1")
        self.assert_error(done, 1, "wide.png: ", "width and height must be 1 to 65536")

    def test_pictures(self):
        depth = ("--depth", self.npy("d.npy", np.ones((8, 16), np.float32)), *INTRINSICS, "--visibility", 50)
        exr = files.exr({"R": np.ones((8, 16), np.float32)})
        for data, words in ((files.png(np.eye(8, 16, dtype=np.uint8), bits=1), ("less than 8 bits",)),
                            (files.CMYK_JPEG, ("RGB",)), (b"GIF89a", ("neither a PNG, a JPEG nor an OpenEXR",)),
                            (exr, ("no channels R, G and B",)), (files.png(np.ones((8, 16), np.uint8))[:60], ("PNG",)),
                            (files.GRAY_JPEG[:100], ("JPEG",)), (b"", ("neither",))):
            self.assert_error(self.fog(self.write("p", data), *depth, "-o", self.out), 1, "p: ", *words)
        self.write("p.exr", files.exr({n: np.ones((8, 16), np.float32) for n in "RGB"}))
        self.write("p.jpg", files.GRAY_JPEG)
        self.assert_error(self.fog("p.exr", *depth, "-o", self.out), 1, "becomes an .exr")
        self.assert_error(self.fog("p.jpg", *depth, "-o", "out.exr"), 1, "becomes a .png")
        self.assert_error(self.fog("p.exr", *depth, "-o", "out.exr", "--blend", "srgb"), 1, "floats are light")
        self.assert_error(self.fog("p.jpg", *depth, "-o", self.out, "--airlight", "2,1,1"), 1, "at most 1")
        self.assert_error(self.fog("p.jpg", *depth, "-o", "p.jpg/out.png"), 1, "cannot make the folder", "Not a directory")
        self.assertFalse(self.out.exists())

    def test_calls(self):
        base = (self.image, "--depth", self.image, "-o", self.out)
        for words, part in (((), "IMAGE"), ((self.image,), "--depth FILE"), (base, "--visibility M"),
                            ((*base[:3], "--visibility", 9), "--output FILE"), ((*base, "--visibility", 0), "visibility"),
                            ((*base, "--visibility", "nan"), "visibility"), ((*base, "--visibility", 9, "--extinction", 1), "says the same"),
                            ((*base, "--extinction", 1, "--contrast", 0.1), "needs --visibility"),
                            ((*base, "--visibility", 9, "--contrast", 1), "contrast"), ((*base, "--visibility", 9, "--sky", "up"), "sky"),
                            ((*base, "--visibility", 9, "--airlight", "1,2"), "airlight"),
                            ((*base, "--visibility", 9, "--depth-format", "kiti"), "kitti"),
                            ((*base, "--visibility", 9, "--depth-format", "kitti", "--depth-scale", 2), "metric alone"),
                            ((*base, "--visibility", 9, "--depth-format", "cityscapes", "--depth-kind", "planar"), "disparity"),
                            ((*base[:-1], "out.bmp", "--visibility", 9), ".png or .exr")):
            self.assert_error(self.fog(*words), 2, part)


if __name__ == "__main__":
    unittest.main()
