#!/usr/bin/env python3
"""nebel fog by many processes: shards and MPI give the bytes of one process, --resume does what is missing or stale, and a fault of one
picture, one file or one process leaves the others."""

import os
import re
import resource
import shutil
import subprocess
import time
import unittest

import numpy as np

import picture_files as files
from check_cluster import NEBEL, RanksCase, ClusterCase, change_bit, nebel

COUNT = 8
HEIGHT, WIDTH = 60, 90
DICE = np.random.default_rng(7)
CAMERA = ["--camera", "../camera.txt"]
# Outputs, their options, and how many items they have.
PLAIN = ("p_*.png", [*CAMERA, "--visibility", "80"], COUNT)
PAIRS = ("q_*.png", [*CAMERA, "--visibility", "80", "--transmittance", "t_*.exr"], COUNT)
NOISE = ("n_*.png", ["--scene", "../fog.json", "--frame", "name", "--seed", "3", "--transmittance", "t_*.png"], COUNT)
KINDS = (PLAIN, PAIRS, NOISE)


def photograph(height=HEIGHT, width=WIDTH):
    y, x = np.mgrid[0:height, 0:width]
    return (np.stack([2 * x, 3 * y, x + y], axis=-1) % 199 + DICE.integers(0, 50, (height, width, 3))).astype(np.uint8)


class FogCase(ClusterCase):
    """Photographs with depth and a camera, and a scene with noise."""

    def setUp(self):
        super().setUp()
        for name in ("photos", "depth"):
            (self.folder / name).mkdir()
        for i in range(COUNT):
            self.add_photograph(f"{i}")
        (self.folder / "camera.txt").write_text("80 80 44.5 29.5\n")
        self.write_noise(5)

    def add_photograph(self, name, picture=None):
        picture = photograph() if picture is None else picture
        depth = DICE.uniform(2, 90, picture.shape[:2]).astype(np.float32)
        depth[:2, :3] = np.nan, np.inf, 0
        (self.folder / f"photos/{name}.png").write_bytes(files.png(picture))
        (self.folder / f"depth/{name}.pfm").write_bytes(files.pfm(depth))

    def write_noise(self, seed):
        fog = {"shape": {"type": "box", "min": [-20, -6, -90], "max": [20, 6, 1]}, "extinction": 0.1, "source": 0.8,
               "keys": [{"frame": 0}, {"frame": 10, "extinction": 0.2}],
               "density": {"type": "noise", "size": [12, 12, 12], "cells": [2, 2, 2], "seed": seed}}
        self.write_scene("fog.json", [fog], camera={"position": [0, 0, 0], "look_at": [0, 0, -1], "vertical_fov": 40})

    def words(self, kind, *more):
        return ["fog", "../photos/*.png", "--depth", "../depth/*.pfm", "-o", kind[0], *kind[1], *more]

    def count_items(self, finished):
        """Of pairs both files must be there."""
        pictures = {name[2:].split(".")[0] for name in finished if name[0] != "t"}
        shares = {name[2:].split(".")[0] for name in finished if name[0] == "t"}
        return len(pictures & shares) if shares else len(pictures)

    def assert_made_again(self, done, count, kept):
        self.assert_done(done)
        if kept:
            self.assertIn(f" {count} pictures, {kept} of them there already", done.err)
        else:
            self.assertRegex(done.err, rf": {count} pictures, (extinction|the fog)")

    def break_some(self):
        """Bad input of every kind; what is said of it, by name."""
        nothing = np.full((HEIGHT, WIDTH), np.nan, np.float32)
        (self.folder / "depth/0.pfm").write_bytes(files.pfm(np.ones((HEIGHT, WIDTH - 1), np.float32)))
        (self.folder / "depth/1.pfm").write_bytes(files.pfm(nothing))
        (self.folder / "photos/2.png").write_bytes(files.png(np.eye(HEIGHT, WIDTH, dtype=np.uint8), bits=1))
        (self.folder / "photos/3.png").write_bytes(files.CMYK_JPEG)
        (self.folder / "depth/4.pfm").unlink()
        for i in range(COUNT):
            (self.folder / f"camera-{i}.txt").write_text("nan 80 44.5 29.5\n" if i == 5 else "80 80 44.5 29.5\n")
        return {"../photos/0.png: the picture is 90 x 60 pixels, its depth \"../depth/0.pfm\" 89 x 60", "../depth/1.pfm: the depth of no pixel",
                "../photos/2.png: ", "../photos/3.png: ", "cannot read the depth \"../depth/4.pfm\"", "../camera-5.txt: ",
                "cannot write \"p_6.png\": it is one of the files that are read"}

    def check_broken(self, name, seen, status, reasons):
        self.assertNotEqual(status, 0, seen)
        for reason in reasons:
            self.assertEqual(seen.count(reason), 1, f"{reason}\n{seen}")
        self.assertEqual([path for path in self.contents(name) if path != "p_6.png"], ["p_7.png"])


BROKEN = ("p_*.png", ["--camera", "../camera-*.txt", "--visibility", "80"], COUNT)


# ---- shards -------------------------------------------------------------------------------------


class FogShardTest(FogCase):
    def test_shards_make_the_bytes_of_one_process(self):
        for kind in KINDS:
            with self.subTest(kind[0]):
                expected = self.expected(kind)
                self.assertEqual(len(expected), COUNT if kind == PLAIN else 2 * COUNT)
                for number in (2, 0, 1):
                    self.assert_done(self.run_in(kind[0], kind, "--shard", f"{number}/3"))
                self.assertEqual(self.contents(kind[0]), expected)

    def shards_of(self, name, count):
        """Which files each shard writes."""
        shares = []
        for number in range(count):
            before = set(self.contents(name))
            self.assert_done(self.run_in(name, PLAIN, "--shard", f"{number}/{count}"))
            shares.append(set(self.contents(name)) - before)
        return shares

    def test_a_picture_belongs_to_one_shard_by_its_name(self):
        """Whatever else is in the folder."""
        shares = self.shards_of("a", 4)
        self.assertEqual(sum(map(len, shares)), COUNT)
        for name in ("0a", "00", "zz"):
            self.add_photograph(name)
        (self.folder / "photos/4.png").unlink()
        others = self.shards_of("b", 4)
        self.assertEqual(sum(map(len, others)), COUNT + 2)
        for before, after in zip(shares, others):
            self.assertEqual(before - {"p_4.png"}, after - {"p_0a.png", "p_00.png", "p_zz.png"})

    def test_shards_are_about_equal(self):
        """By chance alone a third of 300 lies within 5 standard deviations."""
        (self.folder / "photos/0.png").write_bytes(files.png(np.zeros((2, 2, 3), np.uint8)))
        depth = self.folder / "depth/one.npy"
        np.save(depth, np.ones((2, 2), np.float32))
        (self.folder / "many").mkdir()
        for i in range(300):
            os.link(self.folder / "photos/0.png", self.folder / f"many/frame_{i:06d}_left.png")
        sizes = []
        for number in range(3):
            folder = self.folder_of(f"share-{number}")
            self.assert_done(nebel("fog", "../many/*.png", "--depth", depth, "--visibility", "9", "--hfov", "50", "-o", "*.png",
                                   "--shard", f"{number}/3", cwd=folder))
            sizes.append(len(list(folder.iterdir())))
        self.assertEqual(sum(sizes), 300)
        self.assertLess(max(abs(size - 100) for size in sizes), 5 * (300 * 2 / 9) ** 0.5, sizes)

    def test_bad_calls(self):
        for shard in ("3/3", "a/b", "1", "0/0", "-1/3", ""):
            self.assert_misused(self.run_in("a", PLAIN, "--shard", shard), "--shard")
        for words in (["--shard", "0/2"], ["--resume"]):
            self.assert_misused(self.run_in("a", ("/dev/null", PLAIN[1]), *words), words[0], "files")
            self.assert_misused(self.run_in("a", PLAIN, "--transmittance", "/dev/null", *words), words[0], "files")
        self.assertEqual(self.contents("a"), {})

    def test_a_scene_from_a_pipe_has_no_record(self):
        text = (self.folder / "fog.json").read_text()
        kind = ("n_*.png", ["--scene", "/dev/stdin"], COUNT)
        self.assert_done(self.run_in("a", kind, text=text))
        self.assert_failed(self.run_in("a", kind, "--resume", text=text), "scene in a file")

    def test_copies_of_a_job_are_told(self):
        done = self.run_in("a", PLAIN, env={"SLURM_STEP_NUM_TASKS": "3"})
        self.assertIn("each does all of the work", done.err)

    def test_bad_input_leaves_the_others(self):
        reasons = self.break_some()
        (self.folder_of("a") / "p_6.png").symlink_to("../photos/7.png")
        done = self.run_in("a", BROKEN)
        self.check_broken("a", done.err, done.returncode, reasons)
        self.assertIn("1 picture, 7 failed", done.err)
        (self.folder_of("b") / "p_6.png").symlink_to("../photos/7.png")
        shards = [self.run_in("b", BROKEN, "--shard", f"{number}/3") for number in range(3)]
        self.check_broken("b", "".join(done.err for done in shards), max(done.returncode for done in shards), reasons)

    def test_a_folder_that_changes(self):
        """A file that has gone since it was listed is an error, one that has come is for the next call."""
        for i in range(20, 40):
            self.add_photograph(f"{i}", photograph(300, 400))
        kind = ("p_*.png", ["--hfov", "50", "--visibility", "80"], COUNT + 20)
        process = subprocess.Popen([NEBEL, *self.words(kind, "-t", "1")], cwd=self.folder_of("a"), stderr=subprocess.PIPE, text=True)
        while not self.contents_of_files("a"):
            time.sleep(0.001)
        (self.folder / "photos/39.png").unlink()
        (self.folder / "depth/38.pfm").unlink()
        self.add_photograph("7new")
        _, seen = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, seen)
        self.assertRegex(seen, r'cannot read the picture "../photos/39.png": No such file')
        self.assertRegex(seen, r'cannot read the depth "../depth/38.pfm": No such file')
        self.assertIn(f"{COUNT + 18} pictures, 2 failed", seen)
        (self.folder / "photos/38.png").unlink()
        self.assert_made_again(self.run_in("a", kind, "--resume"), COUNT + 19, COUNT + 18)
        self.assertIn("p_7new.png", self.contents("a"))

    def contents_of_files(self, name):
        return [path for path in (self.folder / name).iterdir() if not path.name.startswith(".")]


# ---- what is there ------------------------------------------------------------------------------


class FogResumeTest(FogCase):
    def test_what_is_there_stays(self):
        for kind in KINDS:
            with self.subTest(kind[0]):
                expected = self.expected(kind)
                folder = "expected-" + kind[0]
                before = self.stamps(folder)
                os.utime(self.folder / "photos/1.png")
                for more in ([], ["--threads", "1"], ["--quiet"]):
                    done = self.run_in(folder, kind, "--resume", *more)
                    self.assert_done(done)
                    self.assertIn("" if more == ["--quiet"] else f" {COUNT} pictures, {COUNT} of them there already", done.err)
                self.assert_done(self.run_in(folder, kind, "--resume", "--shard", "1/2"))
                self.assertEqual(self.stamps(folder), before)
                self.assertEqual(self.contents(folder), expected)

    def check_stale(self, kind, change, stale):
        """After the change so many are made again, to the bytes of a fresh call."""
        shutil.rmtree(self.folder / "a", ignore_errors=True)
        self.assert_done(self.run_in("a", kind))
        before = self.stamps("a")
        change()
        self.assert_made_again(self.run_in("a", kind, "--resume"), COUNT, COUNT - stale)
        after = self.stamps("a")
        made = {name for name in after if after[name] != before[name]}
        self.assertEqual(len(made), stale * (1 if kind == PLAIN else 2), made)
        self.assertEqual(self.contents("a"), self.expected(kind))

    def test_results_beside_the_pictures(self):
        """The pattern of pictures fits those of results, too: they are passed over. Others' files are not written over."""
        call = ["fog", "*.png", "--depth", "../depth/0.pfm", "-o", "*_foggy.png", "--transmittance", "*_t.png", *CAMERA, "--visibility"]
        folder = self.folder / "photos"
        names = {f"{i}{end}.png" for i in range(COUNT) for end in ("", "_foggy", "_t")}
        self.assert_done(nebel(*call, "80", "--shard", "0/2", cwd=folder))
        done = nebel(*call, "80", "--shard", "1/2", cwd=folder)
        self.assert_done(done)
        self.assertRegex(done.err, r"note: \d+ of the pictures are results of an earlier call")
        self.assertEqual(set(self.contents("photos")), names)
        before = self.stamps("photos")
        self.assert_made_again(nebel(*call, "80", "--resume", cwd=folder), COUNT, COUNT)
        self.assertEqual(self.stamps("photos"), before)
        self.assert_made_again(nebel(*call, "81", "--resume", cwd=folder), COUNT, 0)
        (folder / "1_foggy.png").write_bytes(files.png(photograph()))
        own = (folder / "1_foggy.png").read_bytes()
        done = nebel(*call, "81", "--resume", cwd=folder)
        self.assert_failed(done, 'cannot write "1_foggy.png": it is one of the files that are read')
        self.assertEqual((folder / "1_foggy.png").read_bytes(), own)

    def test_results_that_go_in_a_circle(self):
        folder = self.folder_of("c")
        for name in ("qrqrs.png", "rqrs.png"):
            done = nebel("fog", "../photos/0.png", "--depth", "../depth/0.pfm", *CAMERA, "--visibility", "9", "-o", name, cwd=folder)
            self.assert_done(done)
        before = self.contents("c")
        done = nebel("fog", "q*qrs.png", "r*s.png", "--depth", "../depth/0.pfm", *CAMERA, "--visibility", "9", "-o", "*qrs.png", cwd=folder)
        self.assert_failed(done, "each picture is the result of another one")
        self.assertEqual(self.contents("c"), before)

    def test_what_is_stale_is_made_again(self):
        def write_depth():
            (self.folder / "depth/2.pfm").write_bytes(files.pfm(np.full((HEIGHT, WIDTH), 7, np.float32)))

        def write_picture():
            (self.folder / "photos/3.png").write_bytes(files.png(photograph()))

        def write_camera():
            (self.folder / "camera.txt").write_text("81 80 44.5 29.5\n")

        self.check_stale(PLAIN, write_depth, 1)
        self.check_stale(PAIRS, write_picture, 1)
        self.check_stale(PAIRS, write_camera, COUNT)
        self.check_stale(NOISE, lambda: self.write_noise(6), COUNT)

    def test_the_files_of_a_scene_count(self):
        grid = self.folder / "smoke.raw"
        grid.write_bytes(bytes(range(8)))
        fog = {"shape": {"type": "box", "min": [-20, -6, -90], "max": [20, 6, 1]}, "extinction": 0.1, "source": 0.8,
               "density": {"type": "grid", "file": "smoke.raw", "size": [2, 2, 2], "voxels": "uint8"}}
        self.write_scene("fog.json", [fog], camera={"position": [0, 0, 0], "look_at": [0, 0, -1], "vertical_fov": 40})
        done = self.run_in("a", NOISE)
        self.assert_done(done)
        self.check_stale(NOISE, lambda: grid.write_bytes(bytes(range(1, 9))), COUNT)

    def test_a_seed_goes_by_the_name(self):
        """A picture under another name has other noise."""
        folder = self.folder_of("a")
        self.assert_done(self.run_in("a", NOISE))
        for name in ("photos/0.png", "depth/0.pfm"):
            (self.folder / name).rename(self.folder / name.replace("0", "9"))
        for name in ("n_0.png", "t_0.png"):
            (folder / name).rename(folder / name.replace("0", "9"))
        self.assert_made_again(self.run_in("a", NOISE, "--resume"), COUNT, COUNT - 1)

    def test_what_is_damaged_or_missing_is_made_again(self):
        expected = self.expected(PAIRS)
        folder = self.folder / ("expected-" + PAIRS[0])
        before = self.stamps(folder.name)
        (folder / "q_1.png").unlink()
        (folder / "t_2.exr").unlink()
        (folder / "q_3.png").write_bytes(expected["q_3.png"][:-1])
        (folder / "t_4.exr").write_bytes(expected["t_4.exr"][:-9])
        (folder / "q_5.png").write_bytes(expected["q_6.png"])
        (folder / "q_6.png").write_bytes(b"a picture of somebody else's")
        change_bit(folder / "t_7.exr")
        self.assert_made_again(self.run_in(folder.name, PAIRS, "--resume"), COUNT, 1)
        self.assertEqual(self.contents(folder.name), expected)
        after = self.stamps(folder.name)
        made = {name for name in after if after[name] != before.get(name)}
        self.assertEqual(made, {"q_1.png", "t_2.exr", "q_3.png", "t_4.exr", "q_5.png", "q_6.png", "t_7.exr"}, "what was whole stays")

    def test_transmittance_that_is_asked_for_later(self):
        expected = self.expected(PAIRS)
        plain = ("q_*.png", PAIRS[1][:-2], COUNT)
        self.assert_done(self.run_in("a", plain))
        before = self.stamps("a")
        self.assert_made_again(self.run_in("a", PAIRS, "--resume"), COUNT, 0)
        self.assertEqual(self.contents("a"), expected)
        self.assertEqual({name: stamp for name, stamp in self.stamps("a").items() if name[0] == "q"}, before)

    def test_devices_without_an_end_are_no_depth(self):
        done = nebel("fog", "../photos/0.png", "--depth", "/dev/zero", "--visibility", "9", "-o", "a.png", cwd=self.folder_of("a"))
        self.assert_failed(done, "/dev/zero", "a device")


class FogOptionsTest(FogCase):
    def test_every_option_that_changes_pixels(self):
        base = ("p_*.png", [], COUNT)
        changes = [["--visibility", "80"], ["--visibility", "81"], ["--visibility", "80", "--contrast", "0.02"], ["--extinction", "0.03"],
                   *(["--extinction", "0.03", *more] for more in (
                       ["--airlight", "1,1,1"], ["--airlight", "1,1,0"], ["--blend", "srgb"], ["--invalid", "far"], ["--invalid", "keep"],
                       ["--sky", "keep"], ["--sky", "50"], ["--depth-kind", "radial"], ["--depth-scale", "2"], ["--depth-format", "hypersim"],
                       ["--depth-channel", "Z"])),
                   ["--scene", "../fog.json"], ["--scene", "../fog.json", "--frame", "1"], ["--scene", "../fog.json", "--frame", "name"],
                   ["--scene", "../fog.json", "--seed", "0"], ["--scene", "../fog.json", "--seed", "1"]]
        cameras = [CAMERA, ["--intrinsics", "80,80,44.5,30"], ["--hfov", "50"], ["--hfov", "51"]]
        calls = [[*change, *CAMERA] for change in changes] + [["--visibility", "80", *camera] for camera in cameras[1:]]
        for call in calls:
            with self.subTest(call):
                self.assert_made_again(self.run_in("a", base, "--resume", *call), COUNT, 0)
        self.assert_made_again(self.run_in("a", base, "--resume", *calls[-1]), COUNT, COUNT)
        known = set(re.findall(r"(?m)^  ....--([a-z-]+)", nebel("fog", "--help").out))
        told = {word[2:] for call in calls for word in call if word.startswith("--")}
        self.assertEqual(known - told, {"depth", "output", "transmittance", "shard", "resume", "threads", "quiet", "help"})


# ---- ranks --------------------------------------------------------------------------------------


class FewFogRanksTest(FogCase, RanksCase):
    """The first opinion."""

    def test_four_ranks(self):
        expected = self.expected(PAIRS)
        (self.folder / "depth/3.pfm").rename(self.folder / "gone.pfm")
        status, seen = self.ranks("a", 4, PAIRS)
        self.assertEqual(status, 1, seen)
        self.assertEqual(seen.count("cannot read the depth \"../depth/3.pfm\""), 1, seen)
        self.assertEqual(seen.count(f"{COUNT - 1} pictures, 1 failed, extinction"), 1, seen)
        (self.folder / "gone.pfm").rename(self.folder / "depth/3.pfm")
        status, seen = self.ranks("a", 4, PAIRS, "--resume")
        self.assertEqual(status, 0, seen)
        self.assertIn(f"{COUNT} pictures, {COUNT - 1} of them there already", seen)
        self.assertEqual(self.contents("a"), expected)


class FogRanksTest(FogCase, RanksCase):
    def test_ranks_make_the_bytes_of_one_process(self):
        for kind in KINDS:
            expected = self.expected(kind)
            for number in (1, 2, 4, 7):
                with self.subTest(f"{kind[0]}, {number} ranks"):
                    name = f"{kind[0]}-{number}"
                    status, seen = self.ranks(name, number, kind)
                    self.assertEqual(status, 0, seen)
                    self.assertEqual(self.contents(name), expected)
                    self.assertEqual(seen.count(f": {COUNT} pictures, "), 1, f"one summary: {seen}")
                    lines = [line for line in seen.splitlines() if not re.match(r"nebel: picture \d of \d, ", line)]  # on a busy machine
                    self.assertEqual(len(lines), 2, seen)
                    self.assertIn("depth: 0.1 % unknown, filled in; 0.0 % without end; ", lines[1])

    def test_the_first_rank_reports_for_all(self):
        """In a log: lines, the first after two seconds. What is stopped then has whole pictures."""
        self.add_photograph("0", photograph(300, 400))
        (self.folder / "many").mkdir()
        for i in range(2000):
            os.link(self.folder / "photos/0.png", self.folder / f"many/{i}.png")
        call = [NEBEL, "fog", "../many/*.png", "--depth", "../depth/0.pfm", "--hfov", "50", "--visibility", "9", "-o", "*.png", "--threads", "2"]
        process = self.start("a", (2, call))
        line = process.stdout.readline()
        process.terminate()
        seen = line + process.communicate(timeout=60)[0]
        self.assertRegex(line, r"^nebel: picture \d+ of 2000, \d+ %, .* left$")
        self.assertNotEqual(process.returncode, 0, seen)
        pictures = {name: data for name, data in self.contents("a").items() if not name.endswith(".tmp")}
        self.assertTrue(pictures and all(data.endswith(b"IEND\xaeB`\x82") for data in pictures.values()), seen)

    def test_ranks_with_many_threads(self):
        """More than pictures, so that some share one."""
        expected = self.expected(NOISE)
        status, seen = self.ranks("a", 2, NOISE, "--threads", "16")
        self.assertEqual(status, 0, seen)
        self.assertEqual(self.contents("a"), expected)

    def test_bad_input_leaves_the_others(self):
        reasons = self.break_some()
        (self.folder_of("a") / "p_6.png").symlink_to("../photos/7.png")
        status, seen = self.ranks("a", 3, BROKEN)
        self.check_broken("a", seen, status, reasons)
        self.assertIn("1 picture, 7 failed", seen)

    def test_a_folder_that_changes(self):
        """The first process says what there is, whatever the others see."""
        for name in ("mine", "theirs"):
            shutil.copytree(self.folder / "photos", self.folder / name / "photos")
            shutil.copytree(self.folder / "depth", self.folder / name / "depth")
        self.add_photograph("8")
        shutil.copy(self.folder / "photos/8.png", self.folder / "theirs/photos/00.png")
        shutil.copy(self.folder / "depth/8.pfm", self.folder / "theirs/depth/00.pfm")
        (self.folder / "theirs/photos/5.png").unlink()
        out = self.folder_of("out")
        call = [NEBEL, "fog", "photos/*.png", "--depth", "depth/*.pfm", "--hfov", "50", "--visibility", "80", "-o", f"{out}/p_*.png"]
        there = ["sh", "-c", 'cd "$0" && exec "$@"']
        status, seen = self.mpirun(".", (1, [*there, "mine", *call]), (1, [*there, "theirs", *call]))
        names = {f"p_{i}.png" for i in range(COUNT)}
        made = set(self.contents("out"))
        self.assertLessEqual(names - made, {"p_5.png"})
        self.assertLessEqual(made, names)
        self.assertEqual(status != 0, made != names, seen)
        self.assertEqual('cannot read the picture "photos/5.png"' in seen, made != names, seen)

    def check_full_disk(self, limited, plain):
        """What cannot write stops after two pictures; the others do the rest."""
        kind = ("p_*.png", [*CAMERA, "--visibility", "80"], COUNT + 12)
        for i in range(20, 32):
            self.add_photograph(f"{i}")
        expected = self.expected(kind)
        call = [NEBEL, *self.words(kind, "--threads", "1")]
        status, seen = self.mpirun("a", (1, [*limited, *call]), (2, [*plain, *call]))
        there = self.contents("a")
        self.assertEqual(status, 1, seen)
        failed = kind[2] - len(there)
        self.assertEqual(seen.count('cannot write "p_'), failed, seen)
        self.assertTrue(1 <= failed <= 2, seen)
        self.assertEqual(seen.count("takes no more pictures"), failed // 2, seen)
        self.assertEqual({name: expected[name] for name in there}, there)
        status, seen = self.ranks("a", 2, kind, "--resume")
        self.assertEqual(status, 0, seen)
        self.assertIn(f"{len(there)} of them there already", seen)
        self.assertEqual(self.contents("a"), expected)

    def test_one_rank_cannot_write(self):
        """Shared memory of MPI that is no file has no such limit."""
        memory = ["env", "OMPI_MCA_shmem=sysv"]
        self.check_full_disk([*memory, "sh", "-c", 'ulimit -f 2; exec "$@"', "sh"], memory)

    def test_no_rank_can_write(self):
        """Two pictures each, and the rest is not tried."""
        memory = ["env", "OMPI_MCA_shmem=sysv", "sh", "-c", 'ulimit -f 2; exec "$@"', "sh"]
        status, seen = self.mpirun("a", (2, [*memory, NEBEL, *self.words(PLAIN, "--threads", "1")]))
        self.assertEqual(status, 1, seen)
        self.assertEqual(seen.count('cannot write "p_'), 4, seen)
        self.assertIn(f"{COUNT - 4} pictures are left to do", seen)
        self.assertEqual(self.contents("a"), {})

    def test_a_full_disk_of_one_rank(self):
        """A file system of one page in place of the folder."""
        mount = "mount -t tmpfs -o size=4k none . && cd ."
        probe = subprocess.run(["unshare", "-m", "sh", "-c", mount], cwd=self.folder_of("b"), capture_output=True, text=True)
        if probe.returncode != 0:
            self.skipTest(f"no file system can be mounted here: {probe.stderr}")
        self.check_full_disk(["unshare", "-m", "sh", "-c", f'{mount} "$PWD" && exec "$@"', "sh"], [])

    def test_processes_with_other_calls_are_no_job(self):
        for kind, more in ((PLAIN, ["--sky", "keep"]), (PLAIN, ["-o", "x_*.png"]), (NOISE, ["--seed", "4"])):
            status, seen = self.mpirun("a", (1, [NEBEL, *self.words(kind)]), (1, [NEBEL, *self.words(kind, *more)]))
            self.assertNotEqual(status, 0)
            self.assertIn("called differently", seen)
            self.assertEqual(self.contents("a"), {})

    def test_nothing_to_do_ends_all(self):
        status, seen = self.mpirun("a", (3, [NEBEL, "fog", "../none/*.png", *self.words(PLAIN)[2:]]))
        self.assertEqual(status, 1)
        self.assertEqual(seen.count("nebel: "), 1, seen)
        (self.folder / "fog.json").write_text("{")
        status, seen = self.ranks("a", 2, NOISE)
        self.assertNotEqual(status, 0)
        self.assertIn("fog.json:1", seen)

    def test_a_shard_stands_alone(self):
        call = ["sh", "-c", 'exec "$@" --shard $OMPI_COMM_WORLD_RANK/2', "sh", NEBEL, *self.words(PLAIN)]
        status, seen = self.mpirun("a", (2, call))
        self.assertEqual(status, 0, seen)
        self.assertEqual(self.contents("a"), self.expected(PLAIN))


class FogKillTest(FogCase, RanksCase):
    """Slow: a rank is killed at random moments."""

    def test_a_rank_that_is_killed(self):
        for i in range(20, 60):
            self.add_photograph(f"{i}", photograph(300, 400))
        kinds = [(name, [*options, "--hfov", "50"] if "--scene" in options else options, COUNT + 40) for name, options, _ in (PAIRS, NOISE)]
        self.kill_often(kinds, 2)


if __name__ == "__main__":
    unittest.main()
