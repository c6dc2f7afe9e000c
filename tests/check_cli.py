#!/usr/bin/env python3
"""The program as people and scripts meet it: exit statuses, what goes to which stream, options, input, pictures."""

import fcntl
import json
import math
import os
import pathlib
import pty
import random
import re
import resource
import shutil
import signal
import struct
import subprocess
import tempfile
import termios
import time
import unittest

NEBEL = os.environ["NEBEL"]
HEADER = "T_r,T_g,T_b,S_r,S_g,S_b,error\n"
COMMANDS = ("render", "fog", "trace", "view", "info", "compare")
BOX = {"type": "box", "min": [-5, -5, -5], "max": [5, 5, 5]}
FOG = {"shape": BOX, "extinction": 0.1, "source": [0.7, 0.7, 0.5]}
RAY = "-9 0 0 1 0 0 100\n"

# Tables of air take a second each; the first opinion of `make test` does without.
with_tables_of_air = unittest.skipIf(float(os.environ.get("NEBEL_TEST_SCALE", 1)) < 1, "makes tables of air")

OBJECT = """v -2 -2 -3
v 2 -2 -3
v 0 2 -3
f 1 2 3
"""


def nebel(*words, text="", env=None, **more):
    if "stdin" not in more:
        more["input"] = text if isinstance(text, bytes) else text.encode()
    done = subprocess.run([NEBEL, *map(str, words)], stdout=more.pop("stdout", subprocess.PIPE), stderr=subprocess.PIPE,
                          env={**os.environ, **(env or {})}, timeout=120, **more)
    done.out = (done.stdout or b"").decode()
    done.err = done.stderr.decode()
    return done


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="nebel-check-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.scene = self.write_scene("scene.json", [FOG])

    def write_scene(self, name, fog, **more):
        path = self.folder / name
        path.write_text(json.dumps({"nebel": 1, "fog": fog, **more}))
        return path

    def assert_done(self, done):
        self.assertEqual(done.returncode, 0, done.err)

    def assert_failed(self, done, *words):
        self.assert_error(done, 1, *words)

    def assert_misused(self, done, *words):
        self.assert_error(done, 2, *words)
        self.assertIn("--help", done.err)

    def assert_error(self, done, status, *words):
        self.assertEqual(done.returncode, status, done.err)
        self.assertEqual(done.out, "", "standard output must stay empty")
        self.assertTrue(done.err.endswith("\n") and done.err.startswith("nebel: "), done.err)
        for word in words:
            self.assertIn(word, done.err)

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())


class CallingTest(Case):
    def test_help_and_version_go_to_standard_output(self):
        for words in (["--help"], ["-h"], ["--version"], ["help"], ["help", "help"], ["help", "trace"], *([command, "--help"] for command in COMMANDS),
                      *([command, "-h"] for command in COMMANDS)):
            done = nebel(*words)
            self.assert_done(done)
            self.assertEqual(done.err, "")
            self.assertTrue(done.out.endswith("\n"))
        self.assertRegex(nebel("--version").out, r"^nebel \d+\.\d+\.\d+\n$")

    def test_the_reader_of_models_is_no_command(self):
        reader = re.search(r"(?m)^model reader: (.+)$", nebel("info").out)[1]
        done = subprocess.run([reader], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertIn("they start it themselves", done.stderr)

    def test_help_pages_are_complete_and_fit_a_terminal(self):
        overview = nebel("--help").out
        for command in COMMANDS:
            self.assertRegex(overview, rf"(?m)^  {command} ")
            page = nebel(command, "--help").out
            for part in (f"Usage: nebel {command} ", "Options:", "--help", "Examples:", "Exit status: 0"):
                self.assertIn(part, page)
            self.assertLessEqual(max(map(len, page.split("\n"))), 80, page)

    def test_every_option_of_the_contract_is_on_the_help_page(self):
        contract = {
            "render": "output size device method tolerance samples exposure threads isa frames fps quality frame aov bounces seed quiet",
            "trace": "precision isa tolerance threads", "compare": "output amplify channel fail-above", "info": ""}
        for command, names in contract.items():
            page = nebel(command, "--help").out
            for name in names.split():
                self.assertRegex(page, rf"(?m)^  ....--{name}\b")

    def test_help_about_a_command(self):
        page = nebel("render", "--help").out
        for words in (["help", "render"], ["-h", "render"], ["--help", "render"]):
            self.assertEqual(nebel(*words).out, page, words)
        self.assert_misused(nebel("--help", "rendr"), "did you mean 'render'?")

    def test_help_wins_over_what_is_missing(self):
        self.assert_done(nebel("render", "--size", "5x5", "--help"))

    def test_no_command_is_misuse(self):
        self.assert_misused(nebel())

    def test_unknown_commands_get_the_nearest_name(self):
        self.assert_misused(nebel("rendr"), "rendr", "did you mean 'render'?")
        self.assert_misused(nebel("tarce"), "did you mean 'trace'?")
        self.assert_misused(nebel("xyzzy"), "xyzzy")
        self.assertNotIn("did you mean", nebel("xyzzy").err)
        self.assert_misused(nebel("--verson"), "option", "did you mean '--version'?")
        self.assert_misused(nebel("--hepl"), "did you mean '--help'?")

    def test_unknown_options_get_the_nearest_name(self):
        self.assert_misused(nebel("trace", self.scene, "--tolerence", "1"), "--tolerence", "did you mean '--tolerance'?")
        self.assert_misused(nebel("trace", self.scene, "--presicion=float"), "did you mean '--precision'?")
        self.assert_misused(nebel("trace", self.scene, "-x"), "-x")
        self.assert_misused(nebel("info", "--zzzz"), "--zzzz")
        self.assert_misused(nebel("info", "--hlep"), "did you mean '--help'?")

    def test_values_stand_apart_or_behind_an_equals_sign(self):
        for words in (["--precision", "float"], ["--precision=float"], ["-p", "float"], ["-pfloat"]):
            done = nebel("trace", *words, self.scene, text=RAY)
            self.assert_done(done)
            self.assertEqual(done.out, nebel("trace", self.scene, "-p", "float", text=RAY).out)

    def test_two_dashes_end_the_options(self):
        self.write_scene("--odd.json", [FOG])
        self.assert_done(nebel("trace", "--", "--odd.json", text=RAY, cwd=self.folder))
        self.assert_misused(nebel("trace", "--odd.json", text=RAY, cwd=self.folder))

    def test_the_last_of_repeated_options_counts(self):
        expected = nebel("trace", self.scene, "-p", "float", text=RAY).out
        self.assertEqual(nebel("trace", self.scene, "-p", "double", "-p", "float", text=RAY).out, expected)

    def test_values_that_are_missing_or_too_many(self):
        self.assert_misused(nebel("trace", self.scene, "--tolerance"), "--tolerance", "value")
        self.assert_misused(nebel("render", self.scene, "-o", "a.exr", "--aov=1"), "--aov", "no value")
        self.assert_misused(nebel("trace"), "it takes one scene file: nebel trace SCENE")
        self.assert_misused(nebel("trace", self.scene, "other.json"), "other.json")
        self.assert_misused(nebel("render", self.scene, "a.png"), "a.png", "nebel render SCENE -o FILE")
        self.assert_misused(nebel("compare", "a.png"), "two pictures")

    def test_numbers_have_a_range(self):
        for value in ("0", "-1", "nan", "inf", "1e999", "0x1p-3", "", "1,5", "2", "0.1e", " 0.1"):
            self.assert_misused(nebel("trace", self.scene, "--tolerance", value, text=RAY), "--tolerance")
        for value in ("-1", "1.5", "many", "99999999999999999999", ""):
            self.assert_misused(nebel("trace", self.scene, "--threads", value, text=RAY), "--threads")

    def test_all_wrong_options_are_named_at_once(self):
        self.assert_misused(nebel("trace", self.scene, "--threads", "x", "--tolerance", "y"), "--threads", "--tolerance")

    def test_messages_cannot_steer_the_terminal(self):
        done = nebel("trace", "no\x1b[2Jscene\n.json", text=RAY)
        self.assert_failed(done)
        self.assertNotIn("\x1b", done.err)
        self.assertEqual(done.err.count("\n"), 1, done.err)

    def test_names_in_scenes_cannot_steer_the_terminal(self):
        volume = {"name": "a\x9b31m\x1b[2Jb\u00e4", "shape": {"type": "sphere", "center": [0, 0, 0], "radius": 1}, "extinction": 1, "source": 0}
        done = nebel("info", self.write_scene("named.json", [volume]))
        self.assert_done(done)
        self.assertIn("fog[0] 'a", done.out)
        self.assertIn("b\u00e4'", done.out)
        self.assertNotIn("\x1b", done.out)
        self.assertNotIn("\x9b", done.out)

    def test_help_to_a_full_disk_fails(self):
        with open("/dev/full", "w") as full:
            done = nebel("--help", stdout=full)
        self.assertEqual(done.returncode, 1)
        self.assertIn("standard output", done.err)


class TraceTest(Case):
    def trace(self, text, *words, scene=None, **more):
        return nebel("trace", scene or self.scene, *words, text=text, **more)

    def numbers(self, text, *words, **more):
        done = self.trace(text, *words, **more)
        self.assert_done(done)
        self.assertTrue(done.out.startswith(HEADER))
        return [[float(field) for field in line.split(",")] for line in done.out.splitlines()[1:]]

    def test_a_frame_of_fog_that_moves(self):
        moving = dict(FOG, keys=[{"frame": 0}, {"frame": 20, "extinction": 0}])
        scene = self.write_scene("moving.json", [moving])
        for words, part in (([], 1), (["--frame", "0"], 1), (["--frame", "10"], 0.5), (["--frame", "20"], 0)):
            self.assertAlmostEqual(self.numbers(RAY, *words, scene=scene)[0][0], math.exp(-part), delta=1e-15)
        self.assert_misused(self.trace(RAY, "--frame", "-1"), "--frame")

    def test_a_box_of_constant_fog(self):
        row = self.numbers(RAY)[0]
        for i, source in enumerate((0.7, 0.7, 0.5)):
            self.assertAlmostEqual(row[i], math.exp(-1), delta=1e-15)
            self.assertAlmostEqual(row[3 + i], source * (1 - math.exp(-1)), delta=1e-15)
        self.assertEqual(self.trace(RAY).err, "")

    def test_directions_of_any_length_and_rays_of_any_length(self):
        expected = self.trace(RAY).out
        for ray in ("-9 0 0 1e-300 0 0 100", "-9 0 0 1e300 0 0 inf", "-9 0 0 5e-324 0 0 Infinity", "-9 0 0 2 0 0 +INF"):
            self.assertEqual(self.trace(ray).out, expected, ray)
        for zero in ("0", "-0", "0e5", ".0"):
            self.assertEqual(self.numbers(f"0 0 0 1 0 0 {zero}")[0][:6], [1, 1, 1, 0, 0, 0])

    def test_comments_blank_lines_and_line_ends(self):
        expected = self.trace(RAY + RAY).out
        plain = RAY.strip()
        for text in (f"# rays\n\n{plain} # first\n   \n\t{plain}#second", f"{plain}\r\n{plain}\r\n",
                     f"\ufeff{plain}\n{plain}", plain.replace(" ", "\t") + "\n" + plain.replace(" ", "   ") + "  \n"):
            done = self.trace(text)
            self.assert_done(done)
            self.assertEqual(done.out, expected, text)

    def test_no_rays_give_the_header(self):
        for text in ("", "\n", "# nothing", "\n\n   \n# nothing\r\n"):
            self.assertEqual(self.trace(text).out, HEADER)

    def test_bad_lines_are_errors_with_their_number(self):
        bad = {
            "0 0 0 1 0 0": "6 numbers", "0 0 0 1 0 0 1 2": "more than 7", "0 0 0 0 0 0 1": "direction",
            "0 0 0 0 -0 0e5 1": "direction", "0 0 0 1 0 0 -1": "tmax", "0 0 0 1 0 0 -inf": "tmax",
            "0 0 0 1 0 0 nan": "tmax", "nan 0 0 1 0 0 1": "ox", "0 -nan 0 1 0 0 1": "oy", "inf 0 0 1 0 0 1": "ox",
            "0 0 0 1 -inf 0 1": "dy", "0 0 1e999 1 0 0 1": "oz", "0 0 0 1 0 0 1e999": "tmax", "0 0 0 0x1 0 0 1": "dx",
            "0,0,0,1,0,0,1": "ox", "0 0 0 1 0 0 1m": "tmax", "zero": "zero", "1e 0 0 1 0 0 1": "1e", ". 0 0 1 0 0 1": "ox",
            "0 0 0 1 0 0 1 \r 1": "more than 7", "0 0 0 1 0 0 1\0": "tmax", "0" * 70000: "65536",
            "1" * 500 + " 0 0 1 0 0 1": "ox", "2e15 0 0 1 0 0 1": "1e15",
        }
        for line, word in bad.items():
            text = f"# first\n{RAY}{line}\n{RAY}"
            done = self.trace(text)
            self.assert_failed(done, "standard input:3: ", word)
            self.assertEqual(done.err.count("\n"), 1, done.err)

    def test_the_first_bad_line_is_named_after_many_good_ones(self):
        self.assert_failed(self.trace(RAY * 20000 + "x\n" + RAY * 1000 + "y\n"), "standard input:20001: ")

    def test_tiny_numbers_are_fine(self):
        self.assert_done(self.trace("1e-320 4.9e-324 1e-999 1 0 0 1e-310"))

    def test_endless_light_is_an_error_of_its_line(self):
        glow = self.write_scene("glow.json", [{"shape": {"type": "world"}, "extinction": 0, "emission": 1}])
        good = "0 0 0 1 0 0 5\n"
        self.assert_done(self.trace(good, scene=glow))
        for words in ((), ("-p", "float")):
            for before in (1, 5000):
                done = self.trace(good * before + "# endless\n0 0 0 1 0 0 inf\n" + good * 3000, *words, scene=glow)
                self.assert_failed(done, f"standard input:{before + 2}: ")
                self.assertEqual(done.err.count("\n"), 1, done.err)

    def test_output_reads_back_and_is_shortest(self):
        rng = random.Random(7)
        rays = "".join("%r 0.1 0.2 1 %r 0 %r\n" % (rng.uniform(-9, 0), rng.uniform(-1, 1), rng.uniform(0, 20))
                       for _ in range(500))
        for line in self.trace(rays).out.splitlines()[1:]:
            for field in line.split(","):
                digits = repr(float(field)).split("e")[0].replace(".", "").strip("0")
                self.assertEqual(field.split("e")[0].replace(".", "").strip("0"), digits)
        for line in self.trace(rays, "--precision", "float").out.splitlines()[1:]:
            for field in line.split(",")[:6]:
                self.assertLessEqual(len(re.sub(r"^[0.]*|\.|e.*$", "", field)), 9, field)
                self.assertEqual(struct.unpack("f", struct.pack("f", float(field)))[0],
                                 struct.unpack("f", struct.pack("f", float("%.9g" % float(field))))[0])

    def test_any_number_of_threads_gives_the_same_bytes(self):
        rng = random.Random(3)
        rays = "".join(" ".join("%.17g" % rng.uniform(-9, 9) for _ in range(6)) + " 30\n" for _ in range(12000))
        for words in ((), ("-p", "float")):
            outputs = {self.trace(rays, "--threads", count, *words).out for count in (0, 1, 2, 7, 1024)}
            self.assertEqual(len(outputs), 1)
            self.assertEqual(outputs.pop().count("\n"), 12001)

    def test_instruction_sets(self):
        available = next(line for line in nebel("info").out.splitlines() if line.startswith("instruction sets:"))
        names = available.split(":")[1].split()
        self.assertIn("scalar", names)
        outputs = {self.trace(RAY, "--precision", "float", "--isa", name).out for name in names}
        self.assertEqual(len(outputs), 1)
        for name in {"scalar", "sse2", "avx2", "avx512", "neon"} - set(names):
            self.assert_misused(self.trace(RAY, "--precision", "float", "--isa", name), name, "not available")
        self.assert_misused(self.trace(RAY, "--isa", "scalar"), "--isa", "float")
        self.assert_misused(self.trace(RAY, "-p", "float", "--isa", "avx3"), "avx3", "did you mean 'avx2'?")
        self.assert_misused(self.trace(RAY, "-p", "half"), "half", "double, float")

    def test_the_locale_changes_nothing(self):
        done = self.trace("-9.5 0 0 1 0 0 1.5", env={"LC_ALL": "de_DE.UTF-8", "LC_NUMERIC": "de_DE.UTF-8"})
        self.assertEqual(done.out, self.trace("-9.5 0 0 1 0 0 1.5", env={"LC_ALL": "C"}).out)

    def test_scenes_that_cannot_be_read(self):
        self.assert_failed(self.trace(RAY, scene=self.folder / "none.json"), "none.json")
        self.assert_failed(self.trace(RAY, scene=self.folder))
        broken = self.folder / "broken.json"
        broken.write_text('{ "nebel": 1,\n  "fog": [ { "shape": { "type": "bocks" } } ] }\n')
        self.assert_failed(self.trace(RAY, scene=broken), "broken.json:2:", "half_space")
        broken.write_text('{ "nebel": 1,\n  "fog": [ ')
        self.assert_failed(self.trace(RAY, scene=broken), "broken.json:")

    def test_output_that_cannot_be_written(self):
        with open("/dev/full", "w") as full:
            done = self.trace(RAY, stdout=full)
        self.assertEqual(done.returncode, 1)
        self.assertIn("standard output", done.err)
        done = subprocess.run(["sh", "-c", '"$0" trace "$1" >&-', NEBEL, str(self.scene)], input=RAY.encode(),
                              stderr=subprocess.PIPE)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"standard output", done.stderr)

    def test_a_closed_pipe_fails_quietly(self):
        reader, writer = os.pipe()
        os.close(reader)
        done = self.trace(RAY, stdout=writer)
        os.close(writer)
        self.assertEqual((done.returncode, done.err), (1, ""))

    def test_input_that_cannot_be_read(self):
        done = subprocess.run(["sh", "-c", '"$0" trace "$1" < "$2"', NEBEL, str(self.scene), str(self.folder)],
                              capture_output=True)
        self.assertEqual((done.returncode, done.stdout), (1, b""))
        self.assertIn(b"standard input", done.stderr)
        done = subprocess.run(["sh", "-c", '"$0" trace "$1" <&-', NEBEL, str(self.scene)], capture_output=True)
        self.assertEqual((done.returncode, done.stdout), (0, HEADER.encode()))


class PictureCase(Case):
    """A triangle in a box of fog."""

    def setUp(self):
        super().setUp()
        (self.folder / "triangle.obj").write_text(OBJECT)
        self.scene = self.write_scene("scene.json", [FOG], models=[{"file": "triangle.obj"}], background=[0.2, 0.4, 0.8],
                                      ambient=[0.3, 0.3, 0.3], camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.given = self.files()

    def render(self, output, *words, **more):
        return nebel("render", self.scene, "-o", output, "--size", "64x36", *words, cwd=self.folder, **more)

    def run_on_terminal(self, output, *words, env=None, interrupt_after=None):
        try:
            master, slave = pty.openpty()
        except OSError as error:
            self.skipTest(f"no pseudo-terminal can be had here ({error}); bar and Ctrl-C stay unchecked")
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 70, 0, 0))
        process = subprocess.Popen([NEBEL, "render", str(self.scene), "-o", output, *words], stderr=slave,
                                   stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, cwd=self.folder,
                                   preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
                                   env={**os.environ, "TERM": "xterm", **(env or {})})
        os.close(slave)
        seen = b""
        while True:
            try:
                piece = os.read(master, 65536)
            except OSError:
                break
            if not piece:
                break
            seen += piece
            if interrupt_after is not None and re.search(interrupt_after, seen):
                process.send_signal(signal.SIGINT)
                interrupt_after = None
        os.close(master)
        process.stdout.close()
        process.wait(60)
        return process, seen.decode()


class RenderTest(PictureCase):
    def test_png(self):
        done = self.render("a.png")
        self.assert_done(done)
        self.assertEqual(done.out, "")
        self.assertRegex(done.err, r"^nebel: a\.png: 64 x 36, 4 samples, .*s\n$")
        data = (self.folder / "a.png").read_bytes()
        self.assertEqual(data[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(struct.unpack(">II", data[16:24]), (64, 36))
        self.assertEqual(self.files(), sorted(self.given + ["a.png"]))

    def test_streams(self):
        words = ["render", self.scene, "--size", "64x36", "-o"]
        for name in ("-", "/dev/stdout"):
            done = subprocess.run([NEBEL, *map(str, words), name], capture_output=True, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertTrue(done.stdout.startswith(b"\x89PNG\r\n") and done.stdout.endswith(b"IEND\xaeB`\x82"))
        with open(self.folder / "log", "wb") as log:
            log.write(b"old")
            log.flush()
            self.assert_done(nebel(*words, "-", stdout=log))
        self.assertEqual((self.folder / "log").read_bytes(), b"old" + done.stdout)
        self.assert_done(nebel(*words, "/dev/null"))
        self.assert_failed(nebel(*words, "/dev/full"), "/dev/full", "a device")
        self.assert_misused(nebel(*words, "-", "--aov"), "--aov")
        self.assert_misused(nebel(*words, "-", "--frames", "0-1"), "--output")

    def test_a_limit_of_file_size_leaves_nothing(self):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        for name in ("a.png", "a.exr"):
            self.assert_failed(self.render(name, "--size", "640x360", preexec_fn=limit), name, "too large")
        self.assertEqual(self.files(), self.given)

    def test_memory_that_is_out_is_named(self):
        if "AddressSanitizer" in nebel("info").out:
            self.skipTest("AddressSanitizer needs more address space than the limit leaves")
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (150 << 20, 150 << 20))
        done = self.render("a.png", preexec_fn=limit)
        if done.returncode == 127:
            self.skipTest("the libraries alone need more than the limit leaves")
        self.assert_failed(done, "out of memory")
        self.assertNotIn("processor", done.err)

    def test_no_lack_of_memory_ends_in_an_abort(self):
        """Embree and its threads throw where nobody catches, in bands of a few MiB that differ from machine to machine."""
        if "AddressSanitizer" in nebel("info").out:
            self.skipTest("AddressSanitizer needs more address space than the limits leave")
        allowed = {0, 1, 127}
        if "libomp.so" in subprocess.run(["ldd", NEBEL], capture_output=True, text=True).stdout:
            allowed.add(-signal.SIGSEGV)  # LLVM's calls itself without end where a thread lacks memory
        seen = set()
        for mebibytes in range(140, 260, 2):
            limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (mebibytes << 20, mebibytes << 20))
            done = self.render("a.png", "--samples", "1", "--threads", "2", preexec_fn=limit)
            seen.add(done.returncode)
            if done.returncode == 1:
                self.assertRegex(done.err, "out of memory|Thread creation failed", f"{mebibytes} MiB")
                self.assertEqual(self.files(), self.given, f"{mebibytes} MiB")
            elif done.returncode == 0:
                (self.folder / "a.png").unlink()
        self.assertLessEqual(seen, allowed)
        self.assertIn(1, seen)

    def test_signals_while_a_file_is_written(self):
        """Two of each kind, from within the write: the picture is complete or absent, and nothing else is left."""
        if "AddressSanitizer" in nebel("info").out:
            self.skipTest("AddressSanitizer must be the first library to be loaded")
        shim = self.folder / "shim.so"
        (self.folder / "shim.c").write_text(
            "#include <signal.h>\n#include <stdlib.h>\n"
            "int fsync(int file) { int n = atoi(getenv(\"SHIM_SIGNAL\")); raise(n); raise(n); return file < 0; }\n")
        subprocess.run([os.environ.get("CC", "cc"), "-shared", "-fPIC", "-o", shim, self.folder / "shim.c"], check=True)
        given = self.files()
        shutil.copy(self.folder / "shim.c", self.folder / "old.png")
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGXCPU):
            calm = lambda: signal.signal(number, signal.SIG_DFL)
            env = {"LD_PRELOAD": str(shim), "SHIM_SIGNAL": str(int(number))}
            for name in ("a.png", "old.png"):
                done = self.render(name, env=env, preexec_fn=calm)
                self.assertEqual(done.returncode, -number, done.err)
                self.assertTrue((self.folder / name).read_bytes().endswith(b"IEND\xaeB`\x82"), name)
            self.assertEqual(self.files(), sorted([*given, "a.png", "old.png"]))
            done = nebel("compare", "a.png", "old.png", "-o", "d.png", cwd=self.folder, env=env, preexec_fn=calm)
            self.assertEqual(done.returncode, -number, done.err)
            self.assertEqual(self.files(), sorted([*given, "a.png", "d.png", "old.png"]))
            for name in ("a.png", "d.png"):
                (self.folder / name).unlink()

    def test_exr_and_its_layers(self):
        self.assert_done(self.render("a.exr"))
        data = (self.folder / "a.exr").read_bytes()
        self.assertEqual(data[:4], b"\x76\x2f\x31\x01")
        self.assertNotIn(b"depth.Z\0", data)
        self.assert_done(self.render("b.exr", "--aov"))
        data = (self.folder / "b.exr").read_bytes()
        for name in ("R", "G", "B", "transmittance.R", "in_scattering.B", "depth.Z", "normal.X", "error"):
            self.assertIn(name.encode() + b"\0", data)
        for layer, place in (("transmittance.R", "a"), ("error", "a")):
            done = nebel("compare", self.folder / "b.exr", self.folder / "b.exr", "--channel", layer)
            self.assertIn("RMSE: 0\n", done.out, place)

    def test_aov_layers_hold_what_they_say(self):
        self.assert_done(self.render("b.exr", "--aov"))
        self.assert_done(self.render("a.exr"))
        self.assertIn("RMSE: 0\n", nebel("compare", self.folder / "a.exr", self.folder / "b.exr").out)

    def test_the_reference_tells_its_standard_error(self):
        paths = ("--method", "path", "--samples", "8")
        done = self.render("a.exr", *paths, "--aov")
        self.assert_done(done)
        self.assertRegex(done.err, r"note: standard error [\d.e-]+ of a pixel, [\d.e-]+ of the mean of all")
        picture = (self.folder / "a.exr").read_bytes()
        self.assertIn(b"standard_error.G\0", picture)
        self.assertNotIn(b"\0error\0", picture)
        self.assert_done(self.render("b.exr", "--method", "reference", *paths[2:], "--aov", "--threads", "1", "--seed", "0"))
        self.assertEqual((self.folder / "b.exr").read_bytes(), picture)
        self.assertNotIn("note", self.render("c.exr", *paths, "--seed", "1", "--bounces", "1", "--quiet").err)
        self.assertNotIn("RMSE: 0\n", nebel("compare", self.folder / "a.exr", self.folder / "c.exr").out)

    def test_multiple_scattering(self):
        scene = self.folder / "ball.json"
        scene.write_text('{"nebel": 1, "camera": {"position": [0, 0, 9]}, "sun": {"direction": [1, 1, 1], "irradiance": 3},'
                         '"fog": [{"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 2}, "extinction": 2, "albedo": 1}],'
                         '"multiple_scattering": {"model": "diffusion", "max_cells": 8000}}')
        def render(name, *options):
            done = nebel("render", scene, "-o", self.folder / name, "--size", "16x16", *options)
            self.assert_done(done)
            return (self.folder / name).read_bytes()
        own = render("own.exr")
        self.assertEqual(render("same.exr", "--multiple-scattering", "diffusion", "--threads", "1"), own)
        self.assertNotEqual(render("off.exr", "--multiple-scattering", "off"), own)

    def test_fog_in_cells(self):
        self.assert_failed(self.render("a.exr", "--method", "cells"), "scene.json", 'no section "cells"')
        room = {"shape": {"type": "box", "min": [-9, -9, 1], "max": [9, 9, 4]}, "density": 0.1, "color": 0.5}
        hall = {"shape": {"type": "box", "min": [-9, -9, -9], "max": [9, 9, 1]}}
        more = {"models": [{"file": "triangle.obj"}], "cells": {"cells": [room, hall]},
                "camera": {"position": [0, 0, 6], "look_at": [0, 0, 0]}}
        self.scene = self.write_scene("cells.json", [FOG], **more)
        done = self.render("a.exr", "--method", "cells", "--aov")
        self.assert_done(done)
        self.assertIn('note: ', done.err)
        self.assertIn('draws the section "cells" alone', done.err)
        self.assertNotIn(b"error\0", (self.folder / "a.exr").read_bytes())
        self.scene = self.write_scene("cells.json", [], **more)
        self.assertNotIn("note", self.render("a.exr", "--method", "cells").err)
        self.assert_done(self.render("b.exr", "--method", "cells-pixel"))
        self.assert_done(self.render("c.exr"))
        for other in "bc":
            self.assertNotIn("RMSE: 0\n", nebel("compare", self.folder / "a.exr", self.folder / f"{other}.exr").out)
        self.assertIn("cells: 2, 1 of them with fog, portals wherever they touch", nebel("info", self.scene).out)

    def test_classic_fog(self):
        self.assert_failed(self.render("a.exr", "--method", "exp2"), "scene.json", 'no section "classic"')
        classic = {"start": 1, "end": 9, "density": 0.2, "color": [1, 0.5, 0.25]}
        self.scene = self.write_scene("classic.json", [FOG], models=[{"file": "triangle.obj"}], classic=classic,
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        pictures = {}
        for method in ("exact", "vertex", "additive", "linear", "exp", "exp2"):
            self.assert_done(self.render("a.exr", "--method", method, "--aov"))
            pictures[method] = (self.folder / "a.exr").read_bytes()
            self.assertEqual(b"error\0" in pictures[method], method == "exact")
        self.assertEqual(len(set(pictures.values())), len(pictures))

    def test_triangles_that_are_large_against_the_factor_are_told(self):
        classic = {"start": 1, "end": 2, "color": 1}
        for stage, method, note in (("vertex", "linear", r"up to [\d.]+ m long, where fog grows within 1 m"), ("pixel", "linear", None),
                                    ("vertex", "exp", None)):
            self.scene = self.write_scene("classic.json", [], models=[{"file": "triangle.obj"}],
                                          classic={**classic, "stage": stage, "density": 1e-3}, camera={"position": [0, 0, 6]})
            done = self.render("a.png", "--method", method)
            self.assert_done(done)
            self.assertNotIn("edges", done.err) if note is None else self.assertRegex(done.err, note)

    def test_tessellation(self):
        box = {"shape": {"type": "box", "min": [-9, -0.5, -9], "max": [9, 0.5, 9]}, "extinction": 0.3, "source": 1}
        self.scene = self.write_scene("box.json", [box], models=[{"file": "triangle.obj"}],
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.assert_done(self.render("a.exr", "--method", "vertex"))
        done = self.render("b.exr", "--method", "vertex", "--tessellate", "0.004")
        self.assert_done(done)
        self.assertRegex(done.err, r"note: \S*box.json: 1 triangles became \d\d+; .* within 0.00[0-4]\d* of the exact one\n")
        self.assertNotIn("limit", done.err)
        self.assertNotIn("RMSE: 0\n", nebel("compare", self.folder / "a.exr", self.folder / "b.exr").out)
        vertex = ("--method", "vertex", "--tessellate")
        self.assert_misused(self.render("c.png", *vertex, "1e-6"), "--tessellate", "more than 1e-6")
        misused = self.render("c.png", "--tessellate", "0.1")
        self.assert_misused(misused, "--tessellate needs --method vertex")
        self.assertNotIn("0.1", misused.err)
        self.assert_misused(self.render("c.png", *vertex, "0.1", "--tessellate-depth", "49"), "from 1 to 48")
        self.assert_misused(self.render("c.png", "--tessellate-triangles", "9"), "--tessellate-triangles", "without --tessellate")
        self.assert_misused(self.render("c%d.png", *vertex, "0.1", "--frames", "0-1"), "--tessellate", "one frame")

    def test_limits_of_tessellation(self):
        box = {"shape": {"type": "box", "min": [-9, -0.5, -9], "max": [9, 0.5, 9]}, "extinction": 0.3, "source": 1}
        self.scene = self.write_scene("box.json", [box], models=[{"file": "triangle.obj"}],
                                      camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        call = ("a.png", "--method", "vertex", "--tessellate", "0.004", "--tessellate-triangles", "100")
        for limit, fewest, most in (("--tessellate-triangles", 100, 200), ("--tessellate-depth", 2, 20)):
            done = self.render(*call, *(("--tessellate-depth", "3") if "depth" in limit else ()))
            self.assert_done(done)
            count = int(re.search(r"1 triangles became (\d+)", done.err).group(1))
            self.assertTrue(fewest <= count <= most, count)
            self.assertRegex(done.err, rf"note: \S*box.json: \d+ triangles are left above --tessellate, .* more with {limit}, or")

    def test_fog_that_cannot_be_tessellated_is_named(self):
        box = {"shape": {"type": "box", "min": [-9, -0.5, -9], "max": [9, 0.5, 9]}, "extinction": 0.3, "source": 1}
        soft = {**box, "shape": {"type": "cylinder", "from": [0, -1, 0], "to": [0, 1, 0], "radius": 1},
                "density": {"type": "soft_edge", "distance": 0.2}}
        holes = [{"shape": {"type": "sphere", "center": [i, 0, 0], "radius": 1}, "operation": "exclude", "priority": 1} for i in range(8)]
        for fog, at, reason in (([box, soft, box], 1, "soft edge of a cylinder"), ([box, *holes, box], 8, "more than 8 parts")):
            self.scene = self.write_scene("odd.json", fog, models=[{"file": "triangle.obj"}],
                                          camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
            self.assert_failed(self.render("a.png", "--method", "vertex", "--tessellate", "0.1"), "odd.json", f"fog[{at}]: ", reason,
                               "leave out --tessellate")

    def test_quiet(self):
        done = self.render("a.png", "--quiet")
        self.assert_done(done)
        self.assertEqual(done.err, "")

    def test_any_number_of_threads_gives_the_same_picture(self):
        pictures = set()
        for count in (1, 2, 5):
            self.assert_done(self.render("a.png", "--threads", count))
            pictures.add((self.folder / "a.png").read_bytes())
        self.assertEqual(len(pictures), 1)

    def test_exposure_brightens(self):
        for name, exposure in (("a.png", 0), ("b.png", 2)):
            self.assert_done(self.render(name, "--exposure", exposure))
        self.assertNotEqual((self.folder / "a.png").read_bytes(), (self.folder / "b.png").read_bytes())
        self.assert_done(self.render("c.png", "--exposure", "-1.5"))
        self.assert_misused(self.render("c.exr", "--exposure", "1"), "--exposure", "PNG")

    def test_wrong_calls(self):
        self.assert_misused(nebel("render", self.scene), "-o")
        self.assert_misused(self.render("a.jpg"), "a.jpg", ".png", ".exr")
        self.assert_misused(self.render(""), ".png")
        self.assert_misused(self.render(".png"), ".png")
        self.assert_misused(self.render("a.png", "--aov"), "--aov")
        for size in ("0x5", "5x0", "5", "x5", "5x", "5x5x5", "-5x5", "5.0x5", "32769x1", "99999999999x99999999999",
                     "4294967297x1", "32768x32768", "5 x5"):
            self.assert_misused(self.render("a.png", "--size", size), "--size")
        for samples in ("0", "4097", "2.5", "-1"):
            self.assert_misused(self.render("a.png", "--samples", samples), "--samples")
        self.assert_misused(self.render("a.png", "--device", "gpu"), "--device", "cpu, gl")
        self.assert_misused(self.render("a.png", "--bounces", "2"), "--bounces", "--method path")
        self.assert_misused(self.render("a.png", "--method", "path", "--bounces", "0"), "--bounces", "1 to 10000")
        self.assert_misused(self.render("a.png", "--multiple-scattering", "octaves"), "--multiple-scattering", "off, diffusion")
        self.assert_misused(self.render("a.png", "--multiple-scattering", "off", "--method", "path"), "--bounces")
        self.assert_misused(self.render("a.png", "--method", "magic"), "--method", "exact, cells, cells-pixel, vertex, additive, linear, exp, exp2, five-tap, fog-coord, two-pass, alpha, d3d9, path, reference")
        self.assert_misused(self.render("a.png", "--method", "cells", "--tolerance", "0.1"), "--tolerance", "exact")
        self.assert_misused(self.render("a.png", "--method", "five-tap"), "--method", "--device gl")
        self.assertEqual(self.files(), self.given)

    def test_folders_are_made(self):
        for out, frames in (("a/b/c.png", ()), ("n/%d/x.exr", ("--frames", "0-1")), ("./a//d/../e/f.png", ())):
            self.assert_done(self.render(out, *frames))
        made = {str(path.relative_to(self.folder)) for path in self.folder.rglob("*") if path.name not in self.given}
        self.assertEqual(made, {"a", "a/b", "a/b/c.png", "n", "n/0", "n/0/x.exr", "n/1", "n/1/x.exr", "a/d", "a/e", "a/e/f.png"})

    def test_places_that_cannot_be_written_are_found_before_the_work(self):
        began = time.monotonic()
        more = ("--size", "4000x4000", "--samples", "4096")
        self.assert_failed(self.render("/proc/none/a.png", *more), 'cannot make the folder "/proc/none"')
        (self.folder / "folder.png").mkdir()
        self.assert_failed(self.render("folder.png", *more), "folder.png", "name a file in it")
        self.assert_failed(self.render("triangle.obj/a.png", *more), "triangle.obj")
        (self.folder / "dangling.png").symlink_to("none/a.png")
        self.assert_failed(self.render("dangling.png", *more), "dangling.png")
        self.assert_failed(self.render("/proc/a.png", *more), "/proc/a.png", "no file can be made")
        self.assert_failed(self.render("a" * 300 + ".png", *more), "too long")
        self.assert_failed(self.render("/proc/none%d/a.png", "--frames", "0-1", *more), "/proc/none0")
        self.assertEqual(self.files(), sorted(self.given + ["dangling.png", "folder.png"]))
        if os.geteuid() != 0:
            (self.folder / "locked").mkdir(mode=0o555)
            self.assert_failed(self.render("locked/a.png", *more), "locked")
        self.assertLess(time.monotonic() - began, 20)

    def test_a_full_disk_leaves_nothing(self):
        (self.folder / "full.png").symlink_to("/dev/full")
        self.assert_failed(self.render("full.png"), "full.png")
        self.assertTrue((self.folder / "full.png").is_symlink())
        self.assertEqual(self.files(), sorted(self.given + ["full.png"]))

    def test_a_failed_render_leaves_the_old_picture(self):
        (self.folder / "a.png").write_text("old")
        (self.folder / "triangle.obj").write_text("v 1\n")
        self.assert_failed(self.render("a.png"), "triangle.obj")
        self.assertEqual((self.folder / "a.png").read_text(), "old")

    def test_endless_light_cannot_be_rendered(self):
        self.scene = self.write_scene("glow.json", [{"shape": {"type": "world"}, "extinction": 0, "emission": 1}])
        done = self.render("a.png")
        self.assert_failed(done, "glow.json", "infinite")
        self.assertEqual(done.err.count("\n"), 1, done.err)
        self.assertNotIn("a.png", self.files())

    def test_a_model_that_is_missing(self):
        (self.folder / "triangle.obj").unlink()
        self.assert_failed(self.render("a.png"), "triangle.obj")
        self.assertNotIn("a.png", self.files())


class FramesTest(PictureCase):
    def test_frames(self):
        done = self.render("f%%_%04d.png", "--frames", "8-10")
        self.assert_done(done)
        self.assertRegex(done.err, "3 pictures")
        self.assertRegex(done.err, 'nothing moves.*camera and sun move with "keys"')
        self.assertNotIn("wind", done.err)
        self.assertEqual(self.files(), sorted(self.given + [f"f%_{n:04d}.png" for n in (8, 9, 10)]))
        self.assertEqual(self.render("f%d.png", "--frames", "1-2", "--quiet").err, "")
        for n in (1, 2):
            (self.folder / f"f{n}.png").unlink()
        self.assertNotIn("nothing moves", self.render("g%d.png", "--frames=7-7").err)
        self.assert_done(self.render("h%012d.png", "--frames=7-7"))
        self.assertLessEqual({"g7.png", "h000000000007.png"}, set(self.files()))

    def test_a_percent_sign_means_nothing_without_frames(self):
        self.assert_done(self.render("100%s%n.png"))
        self.assertIn("100%s%n.png", self.files())
        self.assert_done(self.render("%04d.png", "--frame", "3"))
        self.assertIn("%04d.png", self.files())

    def test_frame_names_that_are_no_pattern(self):
        for name in ("a.png", "a%s.png", "a%d%d.png", "a%n%d.png", "a%4d.png", "a%0d.png", "a%-4d.png", "a%099d.png",
                     "a%ld.png", "a%%.png", "a%.png", "%0", "a%04d%.png", "a%*d.png", "a%1$d.png", "a%04i.png"):
            self.assert_misused(self.render(name, "--frames", "0-1"), "--output")
        for frames in ("1", "2-1", "-1-2", "a-b", "0-1000001", "1-2-3", "0-99999999999", ""):
            self.assert_misused(self.render("a%d.png", "--frames", frames), "--frames")
        self.assert_misused(self.render("a%d.png", "--frames", "7"), "one alone is --frame\n")
        self.assert_misused(self.render("a%d.png", "--frames", "0-1", "--frame", "0"), "--frame")
        self.assert_misused(self.render("a.png", "--frame", "1.5"), "--frame")
        self.assertEqual(self.files(), self.given)

    def test_films(self):
        """What is in them tests/test_film.c knows."""
        moving = dict(FOG, keys=[{"frame": 0}, {"frame": 3, "extinction": 0}])
        self.scene = self.write_scene("fog.json", [moving], background=1, camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        self.assert_misused(self.render("a.webp"), "--output", "--frames 0-95")
        unknown = self.render("a.mp4", "--frames", "0-3")
        self.assert_misused(unknown, "--output", "is no name that ends in .png, .exr or .webp")
        self.assertNotIn("%04d", unknown.err, "pictures are not what was wanted")
        self.assert_misused(self.render("a%03d.webp", "--frames", "0-3"), "--output", "one film")
        self.assert_misused(self.render("a.webp", "--frames", "0-3", "--aov"), "--output", ".exr")
        self.assert_misused(self.render("a.webp", "--frames", "0-3", "--size", "16384x10"), "--size", "16383")
        for option, values in {"--fps": ("0.5", "101", "x"), "--quality": ("0", "101", "9.5")}.items():
            self.assert_misused(self.render("a%d.png", "--frames", "0-3", option, values[0]), option)
            for value in values:
                self.assert_misused(self.render("a.webp", "--frames", "0-3", option, value), option)
        self.assert_misused(self.render("a%d.png", "--frames", "0-3", "--fps", "30"), "--fps", ".webp")
        self.assertEqual(self.files(), sorted(self.given + ["fog.json"]))
        done = self.render("a.webp", "--frames", "0-3", "--fps", "12.5", "--quality", "100")
        if "WebP 1" not in nebel("info").out:
            self.assert_failed(done, "libwebp")
            return
        self.assert_done(done)
        self.assertRegex(done.err, "4 pictures")
        film = (self.folder / "a.webp").read_bytes()
        self.assertTrue(film.startswith(b"RIFF") and film[8:12] == b"WEBP")
        self.assertEqual(film.count(b"ANMF"), 4)
        duration = film.index(b"ANMF") + 8 + 12
        self.assertEqual(int.from_bytes(film[duration:duration + 3], "little"), 80)
        self.assertEqual(self.files(), sorted(self.given + ["a.webp", "fog.json"]))
        # LLVM's OpenMP writes a file of 1024 bytes itself.
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1024, 1024))
        done = self.render("a.webp", "--frames", "0-15", "--quality", "100", preexec_fn=limit)
        self.assert_failed(done, "a.webp", "too large")
        self.assert_failed(self.render("triangle.obj/a.webp", "--frames", "0-3"), "triangle.obj", "Not a directory")
        self.assertEqual((self.folder / "a.webp").read_bytes(), film)
        self.assertEqual(self.files(), sorted(self.given + ["a.webp", "fog.json"]))

    def test_a_film_is_whole_or_not_there(self):
        if "WebP 1" not in nebel("info").out:
            return
        process, seen = self.run_on_terminal("f.webp", "--frames", "0-9999", "--size", "160x90",
                                             interrupt_after=rb"frame ([4-9]|\d\d+) of")
        self.assertEqual(process.returncode, -signal.SIGINT, seen)
        self.assertEqual(self.files(), self.given)

    def test_a_turntable_turns(self):
        self.scene = self.write_scene("turn.json", [FOG], models=[{"file": "triangle.obj"}], background=1, camera={
            "position": [0, 0, 6], "look_at": [0, 0, 0], "turntable": {"frames": 4}})
        done = self.render("t%d.png", "--frames", "0-4")
        self.assert_done(done)
        self.assertNotIn("nothing moves", done.err)
        pictures = [(self.folder / f"t{n}.png").read_bytes() for n in range(5)]
        self.assertNotEqual(pictures[0], pictures[1])

    def test_fog_moves(self):
        moving = dict(FOG, keys=[{"frame": 0}, {"frame": 2, "extinction": 0}])
        self.scene = self.write_scene("fog.json", [moving], background=1, camera={"position": [0, 0, 6], "look_at": [0, 0, 0]})
        done = self.render("t%d.png", "--frames", "0-3")
        self.assert_done(done)
        self.assertNotIn("nothing moves", done.err)
        pictures = [(self.folder / f"t{n}.png").read_bytes() for n in range(4)]
        pixels = [picture[picture.index(b"IDAT"):] for picture in pictures]
        self.assertEqual(len(set(pixels)), 3)
        self.assertEqual(pixels[2], pixels[3])
        self.assertNotEqual(pictures[2], pictures[3], "the record names the frame")
        self.assert_done(self.render("u.png", "--frame", "1"))
        self.assertEqual((self.folder / "u.png").read_bytes(), pictures[1])

    def test_a_shutter_blurs_what_moves(self):
        """Fog that thickens over a frame has the mean of its transmittance, (exp(-a d) - exp(-b d)) / ((b - a) d), within the midpoint rule's error."""
        thin, thick, depth, samples = 0.11, 0.21, 10, 64
        mean = (math.exp(-thin * depth) - math.exp(-thick * depth)) / ((thick - thin) * depth)
        camera = {"position": [0, 0, 6], "look_at": [0, 0, 0], "projection": "orthographic", "view_height": 2}
        fog = {"shape": BOX, "extinction": thin, "source": 0}
        # Level slopes at the first and the last key, even ones between: the second frame grows evenly.
        keys = [{"frame": frame, "extinction": thin + (thick - thin) * (frame - 1)} for frame in range(4)]
        moving = dict(fog, keys=keys)
        self.write_scene("even.json", [dict(fog, extinction=-math.log(mean) / depth)], background=1, camera=camera)
        self.scene = self.write_scene("moving.json", [moving], background=1, camera=camera)
        self.assert_done(self.render("moving.exr", "--frame", "1", "--shutter", "1", "--samples", samples, "--tolerance", "1e-6"))
        self.scene = self.folder / "even.json"
        self.assert_done(self.render("even.exr", "--samples", "1"))
        seen = nebel("compare", "moving.exr", "even.exr", cwd=self.folder).out
        self.assertLess(float(re.search(r"largest difference: ([\d.e-]+)", seen)[1]), 1e-4, seen)
        seen = nebel("compare", "moving.exr", self.made("other.exr", "moving.json", "--frame", "1", "--shutter", "0.5"), cwd=self.folder).out
        self.assertGreater(float(re.search(r"largest difference: ([\d.e-]+)", seen)[1]), 0.02, "half a frame is another time")

    def made(self, name, scene, *words):
        self.scene = self.folder / scene
        self.assert_done(self.render(name, *words))
        return name

    def test_a_shutter_leaves_what_stands(self):
        self.assert_done(self.render("a.png", "--samples", "7"))
        self.assert_done(self.render("b.png", "--samples", "7", "--shutter", "0.5"))
        pictures = [(self.folder / name).read_bytes() for name in ("a.png", "b.png")]
        self.assertEqual(*[picture[picture.index(b"IDAT"):] for picture in pictures])
        notes = [self.render("a.png", "--samples", "3", "--method", "path", *words).err for words in ([], ["--shutter", "1"])]
        self.assertEqual(*[re.search(r"standard error [\d.e-]+ of a pixel, [\d.e-]+ of", note)[0] for note in notes])
        for value in ("-0.1", "1.1", "x", ""):
            self.assert_misused(self.render("c.png", "--shutter", value), "--shutter")
        for words in (["--samples", "1"], ["--device", "gl"], ["--method", "vertex", "--tessellate", "0.1"]):
            self.assert_misused(self.render("c.png", "--shutter", "0.5", *words), "--shutter")

    def test_no_bar_without_a_terminal(self):
        done = self.render("a.png", "--samples", "64")
        self.assertNotIn("\r", done.err)
        self.assertNotIn("%", done.err)

    def test_a_bar_on_a_terminal(self):
        process, seen = self.run_on_terminal("a.png", "--samples", "16", "--size", "640x360")
        self.assertEqual(process.returncode, 0, seen)
        self.assertRegex(seen, r"\[[#.]+\] +\d+ %")
        self.assertNotIn("\x1b", seen)
        for line in re.split(r"[\r\n]+", seen):
            self.assertLess(len(line), 70)
        self.assertRegex(seen, r"\r +\rnebel: a\.png: ")

    def test_no_bar_where_it_is_not_wanted(self):
        for words, env in ((["--quiet"], {}), ([], {"TERM": "dumb"})):
            process, seen = self.run_on_terminal("a.png", "--size", "64x36", *words, env=env)
            self.assertEqual(process.returncode, 0)
            self.assertNotIn("%", seen)

    def test_ctrl_c_stops_cleanly(self):
        (self.folder / "a.png").write_text("old")
        process, seen = self.run_on_terminal("a.png", "--samples", "512", "--size", "1280x720", interrupt_after=b"%")
        self.assertEqual(process.returncode, -signal.SIGINT, seen)
        self.assertIn("stopped", seen)
        self.assertEqual((self.folder / "a.png").read_text(), "old")
        self.assertEqual(self.files(), sorted(self.given + ["a.png"]))

    def test_complete_pictures_stay_after_ctrl_c(self):
        process, seen = self.run_on_terminal("f%d.png", "--frames", "0-9999", "--size", "160x90",
                                             interrupt_after=rb"frame ([4-9]|\d\d+) of")
        self.assertEqual(process.returncode, -signal.SIGINT, seen)
        pictures = [name for name in self.files() if name not in self.given]
        self.assertGreaterEqual(len(pictures), 3)
        for name in pictures:
            self.assertTrue((self.folder / name).read_bytes().endswith(b"IEND\xaeB`\x82"), name)


class CompareTest(PictureCase):
    def setUp(self):
        super().setUp()
        self.assert_done(self.render("a.exr", "--aov"))
        self.assert_done(self.render("a.png"))
        self.scene = self.write_scene("empty.json", [], background=[0.2, 0.4, 0.8])
        self.assert_done(self.render("b.exr", "--aov"))
        self.assert_done(self.render("b.png"))

    def compare(self, *words, **more):
        return nebel("compare", *words, cwd=self.folder, **more)

    def number(self, done, name):
        return float(re.search(rf"(?m)^{name}: ([^ \n]+)", done.out)[1])

    def test_equal_pictures(self):
        for name in ("a.png", "a.exr"):
            done = self.compare(name, name)
            self.assert_done(done)
            self.assertEqual(done.err, "")
            for line in ("size: 64 x 36\n", "channels: R G B\n", "RMSE: 0\n", "PSNR: infinite", "largest difference: 0\n"):
                self.assertIn(line, done.out)

    def test_pictures_that_differ(self):
        done = self.compare("a.png", "b.png")
        self.assert_done(done)
        rmse, largest = self.number(done, "RMSE"), self.number(done, "largest difference")
        self.assertTrue(0 < rmse <= largest <= 1, done.out)
        self.assertAlmostEqual(self.number(done, "PSNR"), -20 * math.log10(rmse), delta=1e-3)
        self.assertIn("(peak 1)", done.out)
        place = re.search(r"largest difference: (\S+) at x (\d+), y (\d+), channel ([RGB]): (\S+) and (\S+)\n", done.out)
        self.assertTrue(int(place[2]) < 64 and int(place[3]) < 36)
        self.assertAlmostEqual(abs(float(place[5]) - float(place[6])), largest, delta=1e-7)

    def test_the_peak_of_exr_is_the_largest_sample(self):
        self.assertRegex(self.compare("b.exr", "a.exr").out, r"PSNR: \S+ dB \(peak 0\.8")

    def test_difference_pictures(self):
        self.assert_done(self.compare("a.png", "b.png", "-o", "d.png"))
        self.assert_done(self.compare("a.png", "b.png", "-o", "e.exr", "--amplify", "1"))
        self.assert_done(self.compare("a.png", "a.png", "-o", "black.png"))
        data = (self.folder / "d.png").read_bytes()
        self.assertEqual(struct.unpack(">II", data[16:24]), (64, 36))
        largest = self.number(self.compare("a.png", "b.png"), "largest difference")
        black = self.compare("black.png", "d.png")
        self.assertAlmostEqual(self.number(black, "largest difference"), min(1, 8 * largest), delta=1 / 255)
        self.assertAlmostEqual(self.number(self.compare("e.exr", "e.exr"), "RMSE"), 0)

    def test_channels(self):
        done = self.compare("a.exr", "b.exr", "--channel", "transmittance.G")
        self.assert_done(done)
        self.assertIn("channels: transmittance.G\n", done.out)
        self.assert_failed(self.compare("a.exr", "b.exr", "--channel", "Z"), "Z", "depth.Z")
        self.assert_done(self.compare("a.exr", "b.exr", "-c", "depth.Z", "-o", "d.png"))

    def test_infinite_samples(self):
        same = self.compare("b.exr", "b.exr", "--channel", "depth.Z")
        self.assertIn("RMSE: 0\n", same.out)
        done = self.compare("a.exr", "b.exr", "--channel", "depth.Z")
        self.assert_done(done)
        self.assertEqual(self.number(done, "RMSE"), math.inf)
        self.assertRegex(done.out, r"NaN or infinite in one picture only: [1-9]\d* samples\n")
        self.assertIn("PSNR: none", done.out)
        self.assertEqual(self.compare("a.exr", "b.exr", "-c", "depth.Z", "--fail-above", "1e9").returncode, 1)

    def test_fail_above(self):
        rmse = self.number(self.compare("a.png", "b.png"), "RMSE")
        self.assert_done(self.compare("a.png", "b.png", "--fail-above", rmse * 1.01))
        done = self.compare("a.png", "b.png", "--fail-above", rmse * 0.99)
        self.assertEqual(done.returncode, 1)
        self.assertIn("RMSE", done.out)
        self.assertIn("above", done.err)
        self.assert_done(self.compare("a.png", "a.png", "--fail-above", 0))

    def test_sizes_must_agree(self):
        self.assert_done(self.render("c.png", "--size", "36x64"))
        self.assert_failed(self.compare("a.png", "c.png"), "64 x 36", "36 x 64")

    def test_light_and_srgb_get_a_remark(self):
        done = self.compare("a.png", "a.exr")
        self.assert_done(done)
        self.assertIn("sRGB", done.err)

    def test_pictures_that_cannot_be_read_or_written(self):
        self.assert_failed(self.compare("a.png", "none.png"), "none.png")
        data = (self.folder / "a.png").read_bytes()
        (self.folder / "cut.png").write_bytes(data[:len(data) // 2])
        self.assert_failed(self.compare("a.png", "cut.png"), "cut.png")
        (self.folder / "text.png").write_text("hello")
        self.assert_failed(self.compare("text.png", "a.png"), "text.png")
        self.assert_failed(self.compare("a.png", "b.png", "-o", "none/d.png"), "none")

    def test_wrong_calls(self):
        self.assert_misused(self.compare("a.png", "b.png", "-o", "d.gif"), "d.gif")
        for value in ("0", "-1", "nan", "x", "1e7"):
            self.assert_misused(self.compare("a.png", "b.png", "--amplify", value), "--amplify")
        self.assert_misused(self.compare("a.png", "b.png", "--fail-above", "-1"), "--fail-above")
        self.assert_misused(self.compare("a.png", "b.png", "c.png"), "c.png")


class InfoTest(PictureCase):
    def test_the_program(self):
        done = nebel("info")
        self.assert_done(done)
        self.assertEqual(done.err, "")
        for line in (r"nebel \d+\.\d+\.\d+", r"compiler: (gcc|clang) .+", r"build: .+", r"scene libraries: .*libpng.*",
                     r"model reader: /.*/nebel-read-model",
                     r"renderer libraries: .*Embree.*", r"processor: .+", r"instruction sets: scalar.*", r"chosen: \w+",
                     r"threads: [1-9]\d*"):
            self.assertRegex(done.out, rf"(?m)^{line}$")

    def test_a_scene(self):
        done = nebel("info", self.scene)
        self.assert_done(done)
        for line in ("camera: at 0 0 6, towards 0 0 0, perspective, vertical field of view 50 degrees",
                     "models: 1 meshes, 1 triangles, 3 vertices, 0 textures", "bounds: -2 -2 -3 to 2 2 -3 (m)",
                     "fog: 1 volume", "  1 x box, constant"):
            self.assertIn(line + "\n", done.out)
        self.assertNotIn("warning", done.out)

    def test_cameras_lights_particles_and_cells(self):
        """Each kind of entry that a scene may have has its line."""
        place = {"position": [0, 0, 6], "look_at": [0, 0, 0]}
        sky = {"type": "gradient", "zenith": [0.1, 0.2, 0.3], "horizon": 0.5, "ground": 0}
        keys = [{"frame": 2}, {"frame": 12, "position": [0, 1, 6]}]
        rooms = [{"shape": {"type": "box", "min": [x, -2, -2], "max": [x + 2, 2, 2]}, "density": x + 2, "name": f"room{x}"}
                 for x in (-2, 0)]
        door = {"cells": ["room-2", "room0"], "polygon": [[0, -1, -1], [0, 1, -1], [0, 1, 1], [0, -1, 1]]}
        self.assert_done(nebel("render", self.scene, "-o", self.folder / "sky.exr", "-s", "8x4", "-q"))
        scenes = (({"camera": {**place, "projection": "orthographic", "view_height": 7, "turntable": {"frames": 9}}},
                   ["camera: at 0 0 6, towards 0 0 0, orthographic, view height 7 m", "motion: once around in 9 frames"]),
                  ({"camera": {**place, "projection": "panorama", "keys": keys}, "ambient": sky, "background": "ambient"},
                   ["camera: at 0 0 6, towards 0 0 0, panorama", "motion: 2 keys, frames 2 to 12", "background: ambient",
                    "ambient: gradient, zenith 0.1 0.2 0.3, horizon 0.5 0.5 0.5, ground 0 0 0"]),
                  ({"ambient": {"type": "environment", "file": "sky.exr", "rotation": 90, "intensity": 2},
                    "sun": {"direction": [0, 1, 0], "irradiance": 1, "keys": [{"frame": 1}, {"frame": 3, "direction": [1, 1, 0]}]}},
                   ["sun: 2 keys, frames 1 to 3"]),
                  ({"nebula": [{"points": {"file": "triangle.obj"}, "radius_range": [0.4, 0.5], "emission": 1},
                               {"shape": {"type": "sphere", "center": [0, 0, 0], "radius": 2}, "count": 12, "radius_range": [0.4, 0.5], "emission": 1}]},
                   ["nebula: 3 particles at the vertices of a model", "nebula: 12 particles in a shape of type sphere"]),
                  ({"cells": {"cells": rooms, "portals": [door]}}, ["cells: 2, 1 of them with fog, 1 portal"]))
        for entries, lines in scenes:
            done = nebel("info", self.write_scene("all.json", [], **entries))
            self.assert_done(done)
            for line in lines:
                self.assertIn(line + "\n", done.out)
            if "ambient" in entries and "file" in entries["ambient"]:
                self.assertRegex(done.out, r"(?m)^ambient: environment .*sky\.exr, rotation 90 degrees, intensity 2$")

    def test_visibility_from_the_camera(self):
        scene = self.write_scene("clear.json", [{"shape": {"type": "world"}, "visibility": 60, "source": 1}])
        self.assertIn("visibility: 60 m", nebel("info", scene).out)
        self.assertIn("visibility: no end", nebel("info", self.write_scene("none.json", [])).out)

    @with_tables_of_air
    def test_visibility_in_air(self):
        """Of air that is as good as even: -ln(0.05) mean free paths; fog takes its part; and air is no lack of fog."""
        planet = {"model": "physical", "radius": 1e9, "thickness": 1e6,
                  "components": [{"type": "exponential", "scattering": 1e-4, "scale_height": 1e9}]}
        camera = {"position": [0, 1000, 0], "look_at": [1, 1000, 0]}
        for fog, wanted in (([], -math.log(0.05) / 1e-4),
                            ([{"shape": {"type": "world"}, "extinction": 3e-4, "source": 1}], -math.log(0.05) / 4e-4)):
            out = nebel("info", self.write_scene("air.json", fog, planet=planet, camera=camera)).out
            self.assertAlmostEqual(float(re.search(r"visibility: (\S+) m", out)[1]), wanted, delta=1e-3 * wanted)
            self.assertNotIn("there is no fog", out)

    @with_tables_of_air
    def test_the_depth_of_air(self):
        """Scattering times scale height, but for what is above the air; and clouds cover a part of the planet."""
        air = {"type": "exponential", "scattering": [2e-5, 0, 0], "absorption": [0, 0, 1], "scale_height": 8000}
        planet = {"model": "physical", "components": [air], "clouds": [{"coverage": 0.3}]}
        out = nebel("info", self.write_scene("air.json", [], planet=planet)).out
        self.assertIn("air: optical depth straight up from the ground 0.16 0 more than 80\nwarning: air deeper than 12 ", out)
        self.assertIn("clouds: cumulus, 900 to 2700 m, 0.3 of the planet\n", out)
        moon = nebel("info", self.write_scene("moon.json", [], planet={"model": "physical", "preset": "moon"})).out
        self.assertNotIn("optical depth", moon)
        self.assertNotIn("deeper", nebel("info", self.write_scene("e.json", [], planet={"model": "physical"})).out)

    @with_tables_of_air
    def test_deep_air_is_said_with_its_picture(self):
        air = {"type": "exponential", "scattering": [2e-3, 2e-3, 2e-3], "scale_height": 8000}
        for airs, told in (([air], 1), ([], 0)):
            scene = self.write_scene("air.json", [], planet={"model": "physical", "components": airs} if airs else {"model": "physical"})
            warning = f"nebel: warning: {scene}: planet: air deeper than 12 "
            for command in (["render", scene, "-o", self.folder / "a.png", "-s", "8x8", "-q"], ["trace", scene]):
                said = nebel(*command, text=RAY).err
                self.assertEqual(said.count(warning), told)
            self.assertIn(f"note: {scene}: rays meet fog alone", said)

    def make_layers(self):
        """A planet that is made at once: generated maps take seconds."""
        self.assert_done(nebel("render", self.scene, "-o", self.folder / "ground.png", "-s", "2x1", "-q"))
        return {"model": "textured", "color_map": "ground.png"}

    def test_a_camera_below_the_ground_of_a_planet(self):
        for planet, radius in (({"model": "physical", "preset": "mars"}, 3389500), (self.make_layers(), 6360000)):
            for height, deep in ((0, None), (-5000, 5000), (-radius, radius)):
                camera = {"position": [0, height, 0], "look_at": [9, height, 0]}
                out = nebel("info", self.write_scene("deep.json", [], planet=planet, camera=camera)).out
                found = re.search(r"the camera is (\S+) m below the ground of a planet", out)
                self.assertEqual(None if found is None else float(found[1]), deep)

    def test_what_looks_like_a_mistake(self):
        scene = self.write_scene("odd.json", [
            {"name": "ghost", "shape": BOX, "extinction": 0}, {"shape": BOX, "extinction": 5},
            {"name": "unlit", "shape": BOX, "extinction": 1, "albedo": 0.9}], models=[{"file": "triangle.obj"}])
        out = nebel("info", scene).out
        for warning in ("fog[0] 'ghost' has no extinction", "fog[1] has neither", "fog[2] 'unlit' scatters",
                        "less than 1 m", "the models are black"):
            self.assertIn(warning, out)
        self.assertIn("there is no fog", nebel("info", self.write_scene("none.json", [])).out)

    def test_fog_that_keeps_the_sun_away(self):
        world, low, high = {"type": "world"}, [0, -0.1, 1], [0, 0.1, 1]
        ground = {"type": "half_space", "point": [0, 0, 0], "normal": [0, 1, 0]}
        rising = {"type": "height", "base": 0, "scale_height": 3}
        denser = {way: {"type": "linear", "from": [0, 0, 0], "to": [0, way, 0]} for way in (-5, 5)}
        for shape, density, sun, is_dark in ((world, None, high, True), (world, rising, low, True), (ground, None, low, True),
                                             (world, denser[5], high, True), (world, denser[-5], high, False),
                                             (world, rising, high, False), (ground, None, high, False), (BOX, None, low, False)):
            volume = {"name": "haze", "shape": shape, "extinction": 0.1, "albedo": 0.9}
            if density is not None:
                volume["density"] = density
            scene = self.write_scene("dim.json", [{"shape": BOX, "extinction": 1, "albedo": 0.5}, volume],
                                     sun={"direction": sun, "irradiance": 3})
            warned = "warning: no sunlight reaches fog or models: fog[1] 'haze' has no end" in nebel("info", scene).out
            self.assertEqual(warned, is_dark, (shape, density, sun))
            done = nebel("render", scene, "-o", self.folder / "dim.png", "-s", "8x8", "-q")
            for said in (done.err, nebel("trace", scene, text=RAY).err):
                self.assertEqual(f"warning: {scene}: no sunlight reaches fog or models: fog[1]" in said, is_dark)

    @with_tables_of_air
    def test_a_planet_without_a_sun(self):
        air, layers, sun = {"model": "physical"}, self.make_layers(), {"direction": [0, 1, 0]}
        sky = {"type": "gradient", "zenith": 0, "horizon": 0, "ground": 0}
        dark_air, dark = "the planet's air is black", "the planet is black"
        for planet, light, warning in ((air, {}, dark_air), (air, {"ambient": 1}, dark_air), (air, {"sun": sun}, None),
                                       (air, {"sun": {**sun, "irradiance": 0}}, dark_air), (layers, {}, dark),
                                       (layers, {"ambient": 1}, None), (layers, {"sun": sun}, None),
                                       (layers, {"ambient": {**sky, "zenith": 1}}, None), (layers, {"ambient": sky}, dark)):
            scene = self.write_scene("night.json", [], planet=planet, **light)
            told = (nebel("info", scene).out, nebel("render", scene, "-o", self.folder / "night.png", "-s", "8x8", "-q").err)
            for text, head in zip(told, ("warning: ", f"warning: {scene}: ")):
                for one in (dark_air, dark):
                    self.assertEqual(head + one in text, one == warning, (planet, light))

    def test_a_scene_or_a_model_that_is_wrong(self):
        self.assert_failed(nebel("info", self.folder / "none.json"), "none.json")
        (self.folder / "triangle.obj").unlink()
        self.assert_failed(nebel("info", self.scene), "triangle.obj")


if __name__ == "__main__":
    unittest.main()
