#!/usr/bin/env python3
"""Many processes, one result: shards, MPI and bands give the bytes of one process, whatever dies on the way; --resume does what is missing,
and nothing else."""

import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import time
import unittest

from check_cli import FOG, NEBEL, OBJECT, PictureCase, nebel

MPIRUN = ["mpirun", "--allow-run-as-root", "--oversubscribe"]
FRAMES = 8
# Outputs, their options, and how many items they have.
PICTURES = ("f%d.png", ["--frames", f"0-{FRAMES - 1}"], FRAMES)
FILM = ("f.webp", ["--frames", f"0-{FRAMES - 1}", "--quality", "100"], FRAMES)
LARGE = ("large.png", ["--size", "300x400", "--bands", "64"], 7)
LAYERS = ("large.exr", ["--size", "300x400", "--bands", "128", "--aov", "--shutter", "0.5", "--samples", "3"], 4)


def ranks_are_missing():
    """Why programs of MPI cannot run here; None where they can, or must."""
    if "CI" in os.environ:
        return None
    if "MPI: not in this build" in nebel("info").out:
        return "this build has no MPI"
    if shutil.which("mpirun") is None:
        return "mpirun is missing; Debian has it in openmpi-bin"
    return None


MISSING = ranks_are_missing()


def change_bit(path):
    """As a disk does that fails: the file keeps its size."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 4
    path.write_bytes(data)


class ClusterCase(PictureCase):
    """A triangle in fog that fades, seen from a camera that turns."""

    def setUp(self):
        super().setUp()
        self.has_films = "WebP 1" in nebel("info").out
        self.write_moving(0.1)
        self.given = self.files()

    def write_moving(self, extinction):
        fog = dict(FOG, extinction=extinction, keys=[{"frame": 0}, {"frame": FRAMES, "extinction": 0.01}])
        self.scene = self.write_scene(
            "scene.json", [fog], models=[{"file": "triangle.obj"}], background=[0.2, 0.4, 0.8], ambient=[0.3, 0.3, 0.3],
            camera={"position": [0, 0, 6], "look_at": [0, 0, 0], "turntable": {"frames": 2 * FRAMES}})

    def kinds(self):
        return [PICTURES, LARGE, LAYERS] + ([FILM] if self.has_films else [])

    def words(self, kind, *more):
        """The call for an output in a folder of its own."""
        return ["render", str(self.scene), "-o", kind[0], "--size", "64x36", *kind[1], *more]

    def folder_of(self, name):
        folder = self.folder / name
        folder.mkdir(exist_ok=True)
        return folder

    def run_in(self, name, kind, *more, **options):
        return nebel(*self.words(kind, *more), cwd=self.folder_of(name), **options)

    def contents(self, name):
        return {path.name: path.read_bytes() for path in sorted(self.folder_of(name).iterdir())}

    def stamps(self, name):
        """What changes when a file is written anew."""
        return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in self.folder_of(name).rglob("*") if path.is_file()}

    def expected(self, kind):
        """What one process makes of it at once."""
        alone = (kind[0], [word for i, word in enumerate(kind[1]) if "--bands" not in (word, kind[1][i - 1])])
        self.assert_done(self.run_in("expected-" + kind[0], alone))
        return self.contents("expected-" + kind[0])


class ShardTest(ClusterCase):
    def test_shards_make_the_bytes_of_one_process(self):
        for kind in self.kinds():
            with self.subTest(kind[0]):
                expected = self.expected(kind)
                for number in (2, 0, 1):
                    self.assert_done(self.run_in(kind[0], kind, "--shard", f"{number}/3"))
                self.assertEqual(self.contents(kind[0]), expected)

    def test_shards_that_end_together(self):
        """One of them joins, whichever; the parts are not taken from under it."""
        kind = ("large.png", ["--size", "64x512", "--samples", "1", "--bands", "64"], 8)
        expected = self.expected(kind)
        for i in range(6):
            folder = self.folder_of(f"together-{i}")
            shards = [subprocess.Popen([NEBEL, *self.words(kind, "--shard", f"{n}/3")], cwd=folder, stderr=subprocess.PIPE, text=True)
                      for n in range(3)]
            for shard in shards:
                _, seen = shard.communicate(timeout=120)
                self.assertEqual((shard.returncode, seen.count("\n")), (0, 1), seen)
            self.assertEqual(self.contents(folder.name), expected)

    def test_a_shard_does_its_own(self):
        self.assert_done(self.run_in("a", PICTURES, "--shard", "1/3"))
        self.assertEqual(sorted(self.contents("a")), ["f1.png", "f4.png", "f7.png"])
        self.assert_done(self.run_in("b", PICTURES, "--shard", "9/10"))
        self.assertEqual(self.contents("b"), {})
        done = self.run_in("c", LARGE, "--shard", "0/2")
        self.assert_done(done)
        self.assertIn("4 bands", done.err)
        parts = self.folder / "c" / "large.png.parts"
        self.assertEqual(sorted(path.name for path in parts.iterdir()), [f"00000{n}.png" for n in (0, 2, 4, 6)])
        self.assertFalse((self.folder / "c" / "large.png").exists())

    def test_frames_in_bands(self):
        kind = ("f%d.exr", ["--frames", "2-4", "--size", "64x200", "--bands", "64"], 12)
        expected = self.expected(kind)
        for number in range(5):
            self.assert_done(self.run_in("a", kind, "--shard", f"{number}/5"))
        self.assertEqual(self.contents("a"), expected)
        self.assertIn("12 bands, 12 of them there already", self.run_in("a", kind, "--resume").err)
        (self.folder / "a" / "f3.exr").unlink()
        self.assertIn("12 bands, 8 of them there already", self.run_in("a", kind, "--resume").err)
        self.assertEqual(self.contents("a"), expected)

    def test_one_picture_comes_in_bands_by_itself(self):
        kind = ("large.png", ["--size", "1024x600", "--samples", "1"], 3)
        expected = self.expected(kind)
        for number in range(2):
            self.assert_done(self.run_in("a", kind, "--shard", f"{number}/2"))
        self.assertEqual(self.contents("a"), expected)
        done = self.run_in("b", kind, "--resume")
        self.assertIn("3 bands", done.err)
        self.assertEqual(self.contents("b"), expected)

    def test_bad_calls(self):
        for shard in ("3/3", "a/b", "1", "0/0", "-1/3", "1/", "/3", "0/1000001", "0.5/2", "1/3/4", "", "1 /3", "99999999999/3"):
            self.assert_misused(self.run_in("a", PICTURES, "--shard", shard), "--shard")
        for rows in ("0", "63", "100", "x", "32832"):
            self.assert_misused(self.run_in("a", PICTURES, "--bands", rows), "--bands")
        self.assert_misused(self.run_in("a", LARGE, "--device", "gl"), "--bands", "cpu")
        self.assert_misused(self.run_in("a", FILM, "--bands", "64"), "--bands", "film")
        for words in (["--shard", "0/2"], ["--resume"], ["--bands", "64"]):
            self.assert_misused(self.run_in("a", ("/dev/null", [])[:2], *words), words[0], "files")
        self.assertEqual(self.contents("a"), {})

    def test_a_scene_from_a_pipe_cannot_be_shared(self):
        words = ["render", "/dev/stdin", "-o", "f.png", "--size", "64x36"]
        text = '{"nebel": 1, "fog": []}'
        self.assert_done(nebel(*words, text=text, cwd=self.folder))
        self.assert_failed(nebel(*words, "--resume", text=text, cwd=self.folder), "scene in a file")

    def test_copies_of_a_job_are_told(self):
        def notes(*words, tasks="3"):
            return self.run_in("a", PICTURES, *words, env={"SLURM_STEP_NUM_TASKS": tasks}).err.count("each does all of the work")
        self.assertEqual([notes(), notes("--shard", "0/3"), notes("--quiet"), notes(tasks="1"), notes(tasks="x")], [1, 0, 0, 0, 0])

    def test_a_full_disk(self):
        """A limit of the size of files stands for it. Larger pictures: LLVM's OpenMP writes a file of 1024 bytes itself."""
        kind = ("f%d.png", ["--frames", "0-3", "--size", "320x180"], 4)
        expected = self.expected(kind)
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048))
        self.assert_failed(self.run_in("a", kind, "--shard", "0/2", preexec_fn=limit), "f0.png", "too large")
        self.assertEqual(self.contents("a"), {})
        self.assert_done(self.run_in("a", kind, "--shard", "1/2"))
        self.assert_done(self.run_in("a", kind, "--resume"))
        self.assertEqual(self.contents("a"), expected)

    def test_the_folder_of_parts_cannot_be_made(self):
        (self.folder_of("a") / "large.png.parts").write_text("mine")
        self.assert_failed(self.run_in("a", LARGE), "large.png.parts")
        self.assertEqual(self.contents("a"), {"large.png.parts": b"mine"})


class ResumeTest(ClusterCase):
    def test_what_is_there_stays(self):
        for kind in self.kinds():
            with self.subTest(kind[0]):
                expected = self.expected(kind)
                before = self.stamps("expected-" + kind[0])
                for more in ([], ["--threads", "1"], ["--isa", "scalar"], ["--shard", "0/2"], ["--memory", "1000"]):
                    done = self.run_in("expected-" + kind[0], kind, "--resume", *more)
                    self.assert_done(done)
                    self.assertRegex(done.err, r"(\d+) (pictures|bands?), \1 of them there already")
                self.assertEqual(self.stamps("expected-" + kind[0]), before)
                self.assertEqual(self.contents("expected-" + kind[0]), expected)

    def test_what_is_stale_is_made_again(self):
        changes = {
            "scene": lambda: self.write_moving(0.2),
            "model": lambda: (self.folder / "triangle.obj").write_text(OBJECT.replace("v 0 2 -3", "v 0 1 -3")),
        }
        for kind in self.kinds():
            for name, change in changes.items():
                if name == "model" and kind != PICTURES:
                    continue
                folder = f"{name}-{kind[0]}"
                with self.subTest(folder):
                    self.assert_done(self.run_in(folder, kind))
                    before = self.stamps(folder)
                    change()
                    self.assert_done(self.run_in(folder, kind, "--resume"))
                    after = self.stamps(folder)
                    self.assertEqual(sorted(after), sorted(before))
                    self.assertFalse(set(after.values()) & set(before.values()), "every file is new")
                    self.assertEqual(self.contents(folder), self.expected(kind))
                    self.write_moving(0.1)
                    (self.folder / "triangle.obj").write_text(OBJECT)

    def test_options_that_change_pixels(self):
        self.assert_done(self.run_in("a", PICTURES))
        for more in (["--samples", "2"], ["--exposure", "1"], ["--tolerance", "0.1"], ["--method", "vertex"],
                     ["--method", "path", "--bounces", "2"], ["--method", "path", "--seed", "2"],
                     ["--multiple-scattering", "diffusion"]):
            done = self.run_in("a", (PICTURES[0], ["--frames", "0-1"]), "--resume", *more)
            self.assert_done(done)
            self.assertIn(": 2 pictures, 64 x 36", done.err)
        other = self.run_in("a", (PICTURES[0], ["--frames", "0-2", "--method", "path", "--seed", "2"]), "--resume")
        self.assertIn(": 3 pictures, 64 x 36", other.err, "the last options were others")

    def test_what_is_damaged_or_missing_is_made_again(self):
        expected = self.expected(PICTURES)
        folder = self.folder / ("expected-" + PICTURES[0])
        before = self.stamps(folder.name)
        (folder / "f1.png").unlink()
        (folder / "f2.png").write_bytes(expected["f2.png"][:-1])
        (folder / "f3.png").write_bytes(expected["f3.png"][:100])
        (folder / "f4.png").write_bytes(b"")
        (folder / "f5.png").write_bytes(expected["f6.png"])
        (folder / "f6.png").write_bytes(b"a picture of somebody else's")
        change_bit(folder / "f7.png")
        done = self.run_in(folder.name, PICTURES, "--resume")
        self.assert_done(done)
        self.assertIn(f"{FRAMES} pictures, 1 of them there already", done.err)
        self.assertEqual(self.contents(folder.name), expected)
        self.assertEqual(self.stamps(folder.name)["f0.png"], before["f0.png"])

    def test_parts_are_whole_or_made_again(self):
        kinds = [kind for kind in self.kinds() if kind != PICTURES]
        for kind in kinds:
            with self.subTest(kind[0]):
                expected = self.expected(kind)
                self.assert_done(self.run_in("a", kind, "--shard", "0/2"))
                parts = sorted((self.folder / "a" / (kind[0] + ".parts")).iterdir())
                self.assertEqual(len(parts), (kind[2] + 1) // 2)
                broken = len(parts) // 2
                change_bit(parts[0])
                if broken > 1:
                    parts[1].write_bytes(parts[1].read_bytes()[:-20])
                (parts[0].parent / ".nebel-0123456789abcdef.tmp").write_bytes(b"half")
                done = self.run_in("a", kind, "--resume")
                self.assert_done(done)
                self.assertIn(f"{kind[2]} {'pictures' if kind == FILM else 'bands'}, {len(parts) - min(broken, 2)} of them there already", done.err)
                self.assertEqual(self.contents("a"), expected)
                shutil.rmtree(self.folder / "a")

    def test_parts_of_other_bands_go(self):
        expected = self.expected(LARGE)
        self.assert_done(self.run_in("a", LARGE, "--shard", "1/2"))
        other = (LARGE[0], ["--size", "300x400", "--bands", "192"])
        self.assertIn("3 bands, 300", self.run_in("a", other, "--resume").err)
        self.assertEqual(self.contents("a"), expected)
        (self.folder / "a" / "large.png").unlink()
        self.assert_done(self.run_in("a", LARGE, "--shard", "1/2"))
        mine = self.folder / "a" / "large.png.parts" / "mine.png"
        mine.write_bytes(b"somebody else's")
        self.assert_done(self.run_in("a", LARGE, "--resume"))
        self.assertEqual((self.folder / "a" / "large.png").read_bytes(), expected["large.png"])
        self.assertEqual([path.name for path in mine.parent.iterdir()], ["mine.png"])

    def test_ctrl_c_loses_what_is_in_work(self):
        if not self.has_films:
            return
        kind = ("f.webp", ["--frames", "0-39", "--size", "640x360", "--quality", "100", "--threads", "1"], 40)
        expected = self.expected(kind)
        self.folder_of("a")
        process, seen = self.run_on_terminal("a/f.webp", *kind[1], "--resume", interrupt_after=rb"frame ([4-9]|\d\d) of")
        self.assertEqual(process.returncode, -signal.SIGINT, seen)
        parts = [path.name for path in (self.folder / "a" / "f.webp.parts").iterdir()]
        self.assertGreaterEqual(len(parts), 3)
        self.assertEqual([name for name in parts if name.endswith(".tmp")], [])
        done = self.run_in("a", kind, "--resume")
        self.assertIn(f"40 pictures, {len(parts)} of them there already", done.err)
        self.assertEqual(self.contents("a"), expected)


@unittest.skipIf(MISSING, MISSING)
class RanksCase(ClusterCase):
    def start(self, name, *groups, **options):
        """mpirun with groups of (number of processes, words)."""
        words = list(MPIRUN)
        for number, call in groups:
            words += ([":"] if len(words) > len(MPIRUN) else []) + ["-n", str(number), *map(str, call)]
        # Open MPI does not give back all memory.
        environment = {**os.environ, "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":detect_leaks=0"}
        return subprocess.Popen(words, cwd=self.folder_of(name), env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, **options)

    def mpirun(self, name, *groups):
        process = self.start(name, *groups)
        seen, _ = process.communicate(timeout=120)
        return process.returncode, seen

    def ranks(self, name, number, kind, *more):
        return self.mpirun(name, (number, [NEBEL, *self.words(kind, "--threads", "1", *more)]))

    def find_ranks(self, process):
        """Processes of nebel that mpirun started."""
        found = []
        for entry in pathlib.Path("/proc").glob("[0-9]*"):
            try:
                words = (entry / "cmdline").read_bytes().split(b"\0")
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError, ValueError):
                continue
            if parent == process.pid and words[0] == NEBEL.encode():
                found.append(int(entry.name))
        return found

    def kill_and_resume(self, name, kind, expected, pause, chosen):
        """Whether somebody died of it."""
        process = self.start(name, (3, [NEBEL, *self.words(kind, "--threads", "1", "--resume")]))
        time.sleep(pause)
        ranks = self.find_ranks(process)
        if ranks:
            os.kill(ranks[chosen % len(ranks)], signal.SIGKILL)
        process.communicate(timeout=120)
        finished = {file: stamp for file, stamp in self.stamps(name).items() if not file.endswith(".tmp") and file != "lock"}
        for file in set(finished) & set(expected):
            self.assertEqual((self.folder / name / file).read_bytes(), expected[file], f"{file} is not whole")
        is_complete = set(expected) <= set(finished)
        kept = kind[2] if is_complete else self.count_items(finished)
        status, seen = self.ranks(name, 3, kind, "--resume")
        self.assertEqual(status, 0, seen)
        self.assertIn(f"{kept} of them there already" if kept else "s, ", seen)
        after = self.stamps(name)
        for file in set(finished) & set(after):
            self.assertEqual(after[file], finished[file], f"{file} was written again")
        self.assertEqual({file: data for file, data in self.contents(name).items() if not file.endswith(".tmp")}, expected)
        self.assertTrue(is_complete or process.returncode != 0, "a job that is not complete has failed")
        return bool(ranks) and process.returncode != 0

    def kill_often(self, kinds, longest):
        """At ten random moments, up to so many seconds after the start."""
        seed = int(os.environ.get("NEBEL_TEST_SEED", time.time_ns() % 1000000))
        dice = random.Random(seed)
        expected = [self.expected(kind) for kind in kinds]
        killed = 0
        for i in range(10):
            k = i % len(kinds)
            with self.subTest(f"NEBEL_TEST_SEED={seed}, number {i}, {kinds[k][0]}"):
                killed += self.kill_and_resume(f"kill-{i}", kinds[k], expected[k], dice.uniform(0.2, longest), dice.randrange(3))
        self.assertGreater(killed, 2, "the work was over before anybody was killed")

    def count_items(self, finished):
        """How many are complete of what has files of these names."""
        return len(finished)


class FewRanksTest(RanksCase):
    """The first opinion: one picture, in bands."""

    def test_bands_of_one_picture(self):
        expected = self.expected(LARGE)
        for number in (4, 7):
            status, seen = self.ranks(f"large-{number}", number, LARGE)
            self.assertEqual(status, 0, seen)
            self.assertEqual(self.contents(f"large-{number}"), expected)


class RanksTest(RanksCase):
    def test_ranks_make_the_bytes_of_one_process(self):
        numbers = {"f%d.png": (1, 2, 4, 7), "f.webp": (1, 2, 4, 7), "large.png": (1, 2, 4, 7), "large.exr": (4, 7)}
        for kind in self.kinds():
            expected = self.expected(kind)
            for number in numbers[kind[0]]:
                with self.subTest(f"{kind[0]}, {number} ranks"):
                    status, seen = self.ranks(f"{kind[0]}-{number}", number, kind)
                    self.assertEqual(status, 0, seen)
                    self.assertEqual(self.contents(f"{kind[0]}-{number}"), expected)
                    self.assertEqual(len(re.findall(r"^nebel: .* s$", seen, re.M)), 1, f"one summary: {seen}")
                    self.assertIn(f"{kind[2]} {'bands' if '--bands' in kind[1] else 'pictures'}, ", seen)

    def test_resume(self):
        expected = self.expected(PICTURES)
        folder = "expected-" + PICTURES[0]
        before = self.stamps(folder)
        (self.folder / folder / "f3.png").unlink()
        status, seen = self.ranks(folder, 2, PICTURES, "--resume")
        self.assertEqual(status, 0, seen)
        self.assertIn(f"{FRAMES} pictures, {FRAMES - 1} of them there already", seen)
        self.assertEqual(self.contents(folder), expected)
        after = self.stamps(folder)
        self.assertEqual({name for name in after if after[name] != before[name]}, {"f3.png"})

    def test_the_first_rank_reports_for_all(self):
        """In a log: lines, the first after two seconds."""
        kind = ("f%d.png", ["--frames", "0-1999", "--size", "320x180", "--samples", "64"], 2000)
        process = self.start("a", (2, [NEBEL, *self.words(kind, "--threads", "1")]))
        line = process.stdout.readline()
        process.terminate()
        seen = line + process.communicate(timeout=60)[0]
        self.assertRegex(line, r"^nebel: frame \d+ of 2000, \d+ %, .* left$")
        self.assertNotEqual(process.returncode, 0, seen)
        # MPI may kill, a second later, who is still writing: a temporary file may be left, but no half picture under its name.
        pictures = {name: data for name, data in self.contents("a").items() if not name.endswith(".tmp")}
        self.assertTrue(pictures and all(data.endswith(b"IEND\xaeB`\x82") for data in pictures.values()), seen)

    def test_one_rank_cannot_write(self):
        """What it has not done is missing, the rest is there, and the job has failed."""
        kind = ("f%d.png", ["--frames", "0-7", "--size", "320x180"], 8)
        expected = self.expected(kind)
        call = [NEBEL, *self.words(kind)]
        # Shared memory of MPI that is no file has no such limit.
        limited = ["env", "OMPI_MCA_shmem=sysv", "sh", "-c", 'ulimit -f 2; exec "$@"', "sh", *call]
        status, seen = self.mpirun("a", (1, limited), (1, ["env", "OMPI_MCA_shmem=sysv", *call]))
        self.assertNotEqual(status, 0)
        self.assertRegex(seen, r"f\d\.png.*too large")
        there = self.contents("a")
        self.assertEqual(len(there), 7, seen)
        self.assertEqual({name: expected[name] for name in there}, there)
        status, seen = self.ranks("a", 2, kind, "--resume")
        self.assertEqual(status, 0, seen)
        self.assertIn("7 of them there already", seen)
        self.assertEqual(self.contents("a"), expected)

    def test_a_scene_that_is_wrong_ends_all(self):
        self.scene.write_text("{")
        status, seen = self.ranks("a", 2, PICTURES)
        self.assertNotEqual(status, 0)
        self.assertIn("scene.json:1", seen)
        self.assertEqual(self.contents("a"), {})

    def test_processes_with_other_calls_are_no_job(self):
        other = self.words(PICTURES, "--samples", "2")
        status, seen = self.mpirun("a", (1, [NEBEL, *self.words(PICTURES)]), (1, [NEBEL, *other]))
        self.assertNotEqual(status, 0)
        self.assertIn("called differently", seen)
        self.assertEqual(self.contents("a"), {})

    def test_a_shard_stands_alone(self):
        call = ["sh", "-c", 'exec "$@" --shard $OMPI_COMM_WORLD_RANK/2', "sh", NEBEL, *self.words(PICTURES)]
        status, seen = self.mpirun("a", (2, call))
        self.assertEqual(status, 0, seen)
        self.assertEqual(self.contents("a"), self.expected(PICTURES))


class KillTest(RanksCase):
    """Slow: a rank is killed at random moments."""

    def test_a_rank_that_is_killed(self):
        kinds = [("f%02d.png", ["--frames", "0-23", "--size", "160x90", "--samples", "64"], 24),
                 ("large.exr", ["--size", "320x1000", "--bands", "64", "--samples", "64"], 16)]
        if self.has_films:
            kinds.append(("f.webp", ["--frames", "0-23", "--size", "160x90", "--samples", "64", "--quality", "100"], 24))
        self.kill_often(kinds, 1.5)


if __name__ == "__main__":
    unittest.main()
