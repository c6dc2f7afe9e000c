#!/usr/bin/env python3
"""What the program may not write over or wait for, that a full disk stops a film at once, and that Ctrl-C ends it while a scene is prepared."""

import json
import os
import pathlib
import resource
import signal
import struct
import subprocess
import sys
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True

import check_cli  # noqa: E402
from check_cli import FOG, NEBEL, nebel  # noqa: E402


class TargetTest(check_cli.PictureCase):
    def test_pictures_that_the_scene_reads_stay(self):
        self.assert_done(self.render("sky.exr", "--size", "64x32", "-q"))
        self.scene = self.write_scene("lit.json", [FOG], ambient={"type": "environment", "file": "sky.exr"})
        before = (self.folder / "sky.exr").read_bytes()
        for output, more in (("sky.exr", ()), ("./sky.exr", ("--device", "gl"))):
            self.assert_failed(self.render(output, *more), "cannot write", "the scene reads")
        (self.folder / "frame_3.exr").symlink_to("sky.exr")
        self.assert_failed(self.render("frame_%d.exr", "--frames", "0-5"), "frame_3.exr", "the scene reads")
        self.assertEqual((self.folder / "sky.exr").read_bytes(), before)
        self.assertFalse((self.folder / "frame_0.exr").exists())

    def test_what_a_model_reads_stays(self):
        """However it is spelled: files that a scene's models name in turn."""
        inner = self.folder / "inner"
        inner.mkdir()
        for name in ("skin.png", "bump.png"):
            self.assert_done(self.render(f"inner/{name}", "--size", "4x4", "-q"))
        (inner / "a.mtl").write_text("newmtl a\nmap_Kd skin.png\n")
        (inner / "a.obj").write_text("mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n")
        (inner / "b.png").write_bytes(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))  # a buffer, whatever its name
        (inner / "b.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
            "materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}], "textures": [{"source": 0}],
            "images": [{"uri": "bump%2epng"}], "buffers": [{"byteLength": 36, "uri": "b.png"}], "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]}]}))
        (self.folder / "hard.png").hardlink_to(inner / "skin.png")
        (self.folder / "soft.png").symlink_to("inner/skin.png")
        (self.folder / "inner.mtl.png").symlink_to("inner/a.mtl")
        self.scene = self.write_scene("textured.json", [FOG], models=[{"file": "inner/a.obj"}])
        for output in ("inner/skin.png", "inner/../inner//skin.png", "hard.png", "soft.png", "inner.mtl.png", inner / "skin.png"):
            self.assert_failed(self.render(output), "cannot write", "the scene reads")
        self.assert_done(self.render("inner/bump.png", "--size", "4x4", "-q"))
        self.scene = self.write_scene("textured.json", [FOG], nebula=[{"points": {"file": "inner/b.gltf"}, "absorption": 1, "radius_range": [0.1, 0.2]}])
        self.assert_failed(self.render("inner/b.png"), "cannot write", "the scene reads")
        self.scene = self.write_scene("textured.json", [FOG], models=[{"file": "inner/b.gltf"}])
        for output in ("inner/b.png", "inner/bump.png"):
            self.assert_failed(self.render(output, "--device", "cpu"), "cannot write", "the scene reads")

    def test_compared_pictures_stay(self):
        self.assert_done(self.render("a.png", "-q"))
        self.assert_done(self.render("b.png", "-q"))
        before = (self.folder / "b.png").read_bytes()
        self.assert_failed(nebel("compare", "a.png", "b.png", "-o", "b.png", cwd=self.folder), "one of the pictures")
        self.assertEqual((self.folder / "b.png").read_bytes(), before)

    def test_pipes_are_not_waited_for(self):
        os.mkfifo(self.folder / "pipe")
        self.assert_failed(nebel("compare", "pipe", "pipe", cwd=self.folder), "a pipe")
        density = {"type": "grid", "file": "pipe", "size": [1, 1, 1], "voxels": "float"}
        self.scene = self.write_scene("grid.json", [{**FOG, "density": density}])
        self.assert_failed(nebel("info", self.scene), "a pipe")

    def test_no_path_may_be_a_pipe_a_device_or_a_folder(self):
        os.mkfifo(self.folder / "pipe")
        first = self.scene
        os.mkfifo(self.folder / "pipe.png")
        os.mkfifo(self.folder / "pipe.webp")
        (self.folder / "folder").mkdir()
        (self.folder / "a.mtl").write_text("newmtl a\nmap_Kd pipe.png\n")
        (self.folder / "a.obj").write_text("mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")

        def sections(name):
            """What of a scene names a file."""
            grid = {"type": "grid", "file": name, "size": [1, 1, 1], "voxels": "float"}
            yield {"fog": [{**FOG, "density": grid}]}
            yield {"models": [{"file": name}]}
            yield {"models": [{"heightfield": {"file": name, "size": [1, 1], "height": 1}}]}
            yield {"nebula": [{"points": {"file": name}, "absorption": 1, "radius_range": [0.1, 0.1]}]}
            yield {"ambient": {"type": "environment", "file": name}}
            yield {"planet": {"model": "textured", "color_map": name}}

        for name, reason in (("pipe", "a pipe"), ("/dev/zero", "a device"), ("folder", "Is a directory")):
            self.assert_failed(nebel("info", name, cwd=self.folder), reason)
            self.assert_failed(nebel("compare", name, name, cwd=self.folder), reason)
            for number, section in enumerate(sections(name)):
                with self.subTest(name=name, section=number):
                    self.scene = self.write_scene("s.json", **{"fog": [FOG], **section})
                    self.assert_failed(nebel("render", self.scene, "-o", "a.png", cwd=self.folder), name)
        self.scene = self.write_scene("s.json", [FOG], models=[{"file": "a.obj"}])
        self.assertIn("pipe.png", nebel("info", self.scene).err)
        self.scene = first
        for output, more in (("pipe.png", ()), ("pipe.webp", ("--frames", "0-1"))):
            done = self.render(output, *more)
            if "without WebP" not in done.err:
                self.assert_failed(done, "a pipe")
        self.assert_failed(nebel("bench", "--quick", "--json", "pipe", cwd=self.folder), "a pipe")
        self.assert_failed(nebel("bench", "--quick", "--json", "/dev/full", cwd=self.folder), "a device")

    def test_a_film_without_room_is_not_begun(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

        start = time.monotonic()
        done = self.render("a.webp", "--frames", "0-100000", preexec_fn=limit)
        if "without WebP" in done.err:
            self.skipTest("no WebP")
        self.assert_failed(done, "a.webp", "File too large")
        self.assertLess(time.monotonic() - start, 20)
        self.assertEqual(self.files(), self.given)


class BudgetTest(check_cli.PictureCase):
    def test_pictures_count_before_the_work(self):
        for words in (("a.exr", "--aov", "--size", "8192x8192"), ("a.png", "--size", "4800x4800", "--memory", "256"),
                      ("a.png", "--size", "640x640", "--memory", "64", "--device", "gl"), ("a.webp", "--frames", "0-1000", "--size", "1000x1000", "--memory", "256"),
                      ("a.png", "--size", "1000x1000", "--memory", "64", "--multiple-scattering", "diffusion", "--size", "2300x2300")):
            done = self.render(*words)
            if "without WebP" not in done.err:
                self.assert_failed(done, "--size: a ", "brings the scene to", "--memory")
        self.assertEqual(self.files(), self.given)


class InterruptTest(check_cli.PictureCase):
    def test_preparing_ends_at_once(self):
        noise = {"type": "noise", "size": [200, 200, 200], "cells": [60, 60, 60], "octaves": 16, "gain": 0.9}
        self.scene = self.write_scene("slow.json", [{**FOG, "density": noise}] * 8)
        for words in (["render", self.scene, "-o", "a.png"], ["trace", self.scene], ["info", self.scene]):
            process = subprocess.Popen([NEBEL, *map(str, words), "--memory", "65536"], cwd=self.folder,
                                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
            time.sleep(0.3)
            self.assertIsNone(process.poll(), "the scene was prepared too soon to be interrupted")
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(2), -signal.SIGINT)
        self.assertFalse((self.folder / "a.png").exists())

    def test_preparing_a_frame_ends_at_once(self):
        fog = {"shape": FOG["shape"], "extinction": 1, "albedo": 0.9, "keys": [{"frame": 0, "extinction": 0}, {"frame": 1, "extinction": 200}, {"frame": 99, "extinction": 201}]}
        self.scene = self.write_scene("film.json", [fog], sun={"direction": [1, 1, 1], "irradiance": 1},
                                      multiple_scattering={"model": "diffusion", "max_cells": 4000000})
        process = subprocess.Popen([NEBEL, "render", self.scene, "-o", "f%d.png", "--frames", "0-99", "--size", "8x8"], cwd=self.folder, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
        while process.poll() is None and not (self.folder / "f0.png").exists():
            time.sleep(0.01)
        time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        start = time.monotonic()
        self.assertIn(b"stopped", process.communicate(timeout=60)[1])
        self.assertLess(time.monotonic() - start, 0.4, "the frame was prepared to its end")
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertEqual([name for name in self.files() if name.startswith(("f", ".")) and name != "film.json"], ["f0.png"])


if __name__ == "__main__":
    unittest.main()
