#!/usr/bin/env python3
"""Checks fog in WebGL 2, in headless Chromium: the GLSL ES 3.00 text compiles with each feature alone, with all of them and
with those of every example, and pictures are those of `nebel trace`. Arguments: more scenes whose features are tried."""

import html
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

NEBEL = os.environ["NEBEL"]
SOURCE = pathlib.Path(os.environ["NEBEL_SOURCE"])
WEB_CASE = pathlib.Path(os.environ["NEBEL_BUILD"]) / "tests" / "web_case"
EXAMPLES = SOURCE / "examples" / "scenes"
FEATURE_COUNT = 25

# One scene for each kind of walk: mixed volumes, lights, voxels with light scattered more than once, sunlit height fog, soft edges.
PICTURES = ("forty-volumes", "street-lamps", "cloud", "sun-shafts", "soft-edges")
SIZE = ("20", "11")

ONE_CALL = """
uniform vec4 place;
out vec4 color;
void main()
{
    nebel_view_ray sight = nebel_make_view_ray(gl_FragCoord.xy, place.x);
    nebel_transfer fog = nebel_trace(sight.origin, sight.direction, sight.t_max);
    color = vec4(fog.transmittance + fog.in_scattering, 1.0);
}"""
CALLS = ONE_CALL.replace("fog.transmittance +", "fog.transmittance * nebel_transmit(sight.origin, sight.direction, place.y) +")

# What the text declares beside fog along rays.
OTHER_DEFINES = """#define NEBEL_TILES
#define NEBEL_TRANSPARENT
#define NEBEL_SKY_VIEW
uniform highp sampler2D opaque;
#define NEBEL_OPAQUE_DEPTH(at) texture(opaque, at).x
#define NEBEL_FEATURES_LITERAL
#define NEBEL_FEATURES 2
"""
OTHER_CALLS = """
uniform vec4 place;
out vec4 color;
void main()
{
    nebel_view_ray sight = nebel_make_view_ray(gl_FragCoord.xy, place.x);
    nebel_transfer fog = nebel_trace_list(sight.origin, sight.direction, sight.t_max, 3, 4);
    nebel_transfer air = nebel_trace_atmosphere(sight.direction, sight.t_max);
    nebel_ground ground = nebel_trace_ground(sight.direction);
    float length = nebel_sphere_path_length(sight.origin, sight.direction, sight.t_max, place.xyz, 2.0, 3);
    length += nebel_gaussian_path_length(sight.origin, sight.direction, sight.t_max, place.xyz, 3.0, 1.0);
    nebel_blend blend = nebel_blend_medium(nebel_medium_transfer(length, place.xyz, place.xyz), fog);
    blend.source += nebel_blend_over(place.xyz, 0.5, fog).source + nebel_blend_screen(place.xyz, fog).source;
    color = nebel_blend_gray(blend) * nebel_five_taps(place.xy, place.z, nebel_default_taps());
    color.xyz += air.transmittance * air.in_scattering + ground.sun + ground.sky + nebel_evaluate_environment(ground.normal);
    color.xyz += nebel_transmit_shadow_list(sight.origin, sight.direction, place.y, 0, 1);
}"""

CHROMIUM = ["chromium", "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
            "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
            "--disable-gpu-watchdog"]


def run(*words, **more):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True, **more).stdout


def feature_set(name, features):
    return {"name": name, "calls": CALLS, "defines": f"#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES {features}\n"}


def feature_sets(scenes, pictures):
    """Those to try, each once, but for those that pictures are drawn with."""
    sets = {1 << bit: f"feature {1 << bit} alone" for bit in range(FEATURE_COUNT)}
    for line in run(WEB_CASE, "features", *scenes).splitlines():
        features, _, path = line.partition(" ")
        sets.setdefault(int(features), f"{pathlib.Path(path).name}, features {features}")
    drawn = {picture["features"] for picture in pictures}
    return ([feature_set(name, features) for features, name in sets.items() if features not in drawn]
            + [{"name": "all features", "defines": "", "calls": ONE_CALL},
               {"name": "air, tiles and transparent surfaces", "defines": OTHER_DEFINES, "calls": OTHER_CALLS}])


def open_page(given, folder):
    """What the page answers. Everything is in the file, so that no server is needed; the text of scripts ends where "</" would."""
    script = (SOURCE / "tests" / "web_page.js").read_text()
    page = folder / "page.html"
    page.write_text(f"<!doctype html><body><script>const input = {json.dumps(given).replace('</', '<' + chr(92) + '/')};\n{script}</script>")
    done = subprocess.run([*CHROMIUM, f"--user-data-dir={folder / 'profile'}", "--dump-dom", page.as_uri()],
                          capture_output=True, text=True, timeout=900)
    body = re.search(r"<body>(\{.*\})\s*</body>", done.stdout, re.S)
    if done.returncode != 0 or body is None:
        sys.exit(f"check_web: chromium: status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}")
    return json.loads(html.unescape(body.group(1)))


def trace(scene, picture):
    """T and S of each pixel, and the bound of their error, by `nebel trace`."""
    lines = "".join(line + "\n" for line, _ in picture["pixels"])
    rows = run(NEBEL, "trace", scene, "--tolerance", "1e-4", input=lines).splitlines()[1:]
    return [[float(number) for number in row.split(",")] for row in rows]


def worst_difference(truth, answer):
    """The largest beyond what the truth may be off by itself: in transmittance, and in in-scattering relative to the brightest of
    the picture where that is above 1."""
    units = [1] * 3 + [max([1] + [max(row[3:6]) for row in truth])] * 3
    worst = 0
    for i, (*wanted, error) in enumerate(truth):
        drawn = [answer[name][4 * i + c] for name in ("transmittance", "inScattering") for c in range(3)]
        if None in drawn:  # NaN in JSON
            return float("inf")
        worst = max([worst] + [(abs(a - b) - error) / unit for a, b, unit in zip(drawn, wanted, units, strict=True)])
    return worst


@unittest.skipIf(shutil.which("chromium") is None and "CI" not in os.environ, "chromium is missing; Debian has it in chromium")
class Web(unittest.TestCase):
    scenes = []

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="nebel-web-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.pictures = [json.loads(run(WEB_CASE, "picture", EXAMPLES / f"{name}.json", *SIZE)) for name in PICTURES]
        cls.sets = feature_sets(sorted(EXAMPLES.glob("*.json")) + cls.scenes, cls.pictures)
        cls.output = open_page({"text": run(WEB_CASE, "text"), "sets": cls.sets, "pictures": cls.pictures}, cls.folder)
        print(f"WebGL 2: {cls.output['driver']}")

    def test_every_feature_set_compiles(self):
        for given, answer in zip(self.sets, self.output["sets"], strict=True):
            with self.subTest(given["name"]):
                self.assertNotIn("fault", answer, answer)
        print(f"{len(self.sets)} feature sets in {sum(answer.get('seconds', 0) for answer in self.output['sets']):.1f} s")

    def test_pictures_are_those_of_nebel_trace(self):
        for name, given, answer in zip(PICTURES, self.pictures, self.output["pictures"], strict=True):
            with self.subTest(name):
                self.assertNotIn("fault", answer, answer)
                truth = trace(EXAMPLES / f"{name}.json", given)
                worst = worst_difference(truth, answer)
                print(f"{name}: off by {worst:.1e}, in {answer['seconds']:.1f} s")
                self.assertGreater(sum(row[0] < 0.99 for row in truth), len(truth) / 16)
                self.assertLess(worst, 1 / 255)


if __name__ == "__main__":
    Web.scenes = [pathlib.Path(word) for word in sys.argv[1:]]
    sys.exit(unittest.main(argv=sys.argv[:1], verbosity=2))
