#!/usr/bin/env python3
"""Checks closed forms of the literature (tests/truth/physics.json) through `nebel trace`.

The file states heights as z; nebel's y is up. Each case is a scene, rays and what is expected of them: an optical depth,
a transmittance or an in-scattered radiance, with the relative tolerance that the file states for double and for float.
"""

import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile

NEBEL = os.environ["NEBEL"]
PHYSICS = pathlib.Path(__file__).resolve().parent / "truth" / "physics.json"

DOUBLE = 1e-12
FLOAT = 3e-6
FLOAT_FAR = 1e-5
# A float transmittance near 1 knows the optical depth no better than to this.
FLOAT_STEP = 1.2e-7


class Case:
    """One ray. `kind` is tau, T or S; `double` and `single` are relative tolerances, None: not checked in float."""

    def __init__(self, name, ray, kind, expected, double=DOUBLE, single=FLOAT):
        self.name, self.ray, self.kind, self.expected = name, ray, kind, expected
        self.double, self.single = double, single


def upright(origin, direction):
    """The directions of the file, z up, in nebel's, y up: a turn about x."""
    return [origin[0], origin[2], -origin[1]], [direction[0], direction[2], -direction[1]]


def ray_of(origin, direction, length):
    return [*origin, *direction, math.inf if length is None or length == "inf" else length]


def slope(case):
    """A ray of the file that is given by height, elevation and length."""
    elevation = math.radians(case["elev_deg"])
    return ray_of([0, case["z_m"], 0], [math.cos(elevation), math.sin(elevation), 0], case["length_m"])


def volume(shape, extinction=1, **more):
    return {"shape": shape, "extinction": extinction, **more}


def sphere(check):
    ball = volume({"type": "sphere", "center": check["inputs"]["center"], "radius": check["inputs"]["radius_m"]},
                  check["inputs"]["sigma_t_per_m"])
    for case in check["expected"]["cases"]:
        single = FLOAT_FAR if "far" in case["name"] else 2e-6
        yield [ball], Case(case["name"], ray_of(case["origin"], case["dir"], case["tmax"]), "tau", case["tau"],
                           single=single)


def box(check):
    body = volume({"type": "box", "min": check["inputs"]["lo"], "max": check["inputs"]["hi"]},
                  check["inputs"]["sigma_t_per_m"])
    for case in check["expected"]["cases"]:
        yield [body], Case(case["name"], ray_of(case["origin"], case["dir"], None), "tau", case["tau"])


def bodies(check):
    signs = (-1, 1)
    shapes = {
        "ellipsoid": {"type": "ellipsoid", "center": [0, 0, 0], "radii": [3, 1, 0.5]},
        "cylinder": {"type": "cylinder", "from": [0, -0.8, 0], "to": [0, 0.8, 0], "radius": 1},
        "cone": {"type": "cone", "from": [0, 0, 0], "to": [0, 2, 0], "radius_from": 1, "radius_to": 0},
        "capsule": {"type": "capsule", "from": [0, -1, 0], "to": [0, 1, 0], "radius": 0.5},
        "octahedron": {"type": "convex", "planes": [[x, y, z, 1] for x in signs for y in signs for z in signs]},
        "tetrahedron": {"type": "convex", "planes": [[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [1, 1, 1, 1]]},
    }
    for name, case in check["expected"].items():
        body = volume(shapes[name.split()[0]])
        yield [body], Case(name, ray_of(case["origin"], case["dir"], None), "tau", case["chord"])
        enter, leave = case["t_enter"], case["t_exit"]
        middle = (enter + leave) / 2
        yield [body], Case(name + ", ends inside", ray_of(case["origin"], case["dir"], middle), "tau", middle - enter,
                           double=1e-11, single=1e-5)
        yield [body], Case(name + ", ends before", ray_of(case["origin"], case["dir"], enter * 0.999), "tau", 0)


def height(check):
    fog = volume({"type": "world"}, check["inputs"]["s0_per_m"],
                 density={"type": "height", "base": 0, "scale_height": check["inputs"]["H_m"]})
    for case in check["expected"]["cases"]:
        # Below the smallest float there is nothing to compare.
        single = None if case["T"] < 1e-37 else FLOAT
        yield [fog], Case(f"{case['elev_deg']} degrees, {case['length_m']} m", slope(case), "tau", case["tau"],
                          single=single)


def two_layers(check):
    """Unreal's T = 2^-(sum L) is that of two layers whose extinction is (ln 2)^2 D 2^(-f (z - h)): here in metres, and as an
    artist would copy the settings from the editor."""
    fog = []
    for name in ("layer1", "layer2"):
        layer = check["inputs"][name]
        falloff = layer["HeightFalloff"] / 1000 * 100
        fog.append(volume({"type": "world"}, math.log(2) ** 2 * layer["FogDensity"] / 1000 * 100, density={
            "type": "height", "base": layer["height_cm"] / 100, "scale_height": 1 / (falloff * math.log(2))}))
    x, y, z = (a / 100 for a in check["inputs"]["camera_to_receiver_cm"])
    origin, direction = upright([0, 0, check["inputs"]["camera_z_cm"] / 100], [x, y, z])
    ray = ray_of(origin, direction, math.sqrt(x * x + y * y + z * z))
    yield fog, Case("T", ray, "T", check["expected"]["T_unreal"], double=1e-6)
    yield fog, Case("tau", ray, "tau", check["expected"]["tau_natural"], double=1e-6)
    first, second = check["inputs"]["layer1"], check["inputs"]["layer2"]
    copied = {"import": {"type": "unreal_height_fog", "FogDensity": first["FogDensity"], "FogHeightFalloff": first["HeightFalloff"],
                         "RelativeLocation": [0, 0, first["height_cm"]],
                         "SecondFogData": {"FogDensity": second["FogDensity"], "FogHeightFalloff": second["HeightFalloff"],
                                           "FogHeightOffset": second["height_cm"] - first["height_cm"]}}}
    yield [copied], Case("imported, T", ray, "T", check["expected"]["T_unreal"])
    yield [copied], Case("imported, tau", ray, "tau", check["expected"]["tau_natural"])


def ramp(check):
    inputs = check["inputs"]
    fog = volume({"type": "world"}, inputs["s0_per_m"], density={
        "type": "linear", "from": [0, inputs["z0_m"] + inputs["h_m"], 0], "to": [0, inputs["z0_m"], 0]})
    for case in check["expected"]["cases"]:
        yield [fog], Case(f"z {case['z_m']}, {case['elev_deg']} degrees", slope(case), "tau", case["tau"])


def falloff_sphere(check):
    radius = check["inputs"]["R_m"]
    for case in check["expected"]["cases"]:
        power = case["k"]
        ball = volume({"type": "sphere", "center": [0, 0, 0], "radius": radius}, check["inputs"]["sigma0"],
                      density={"type": "radial", "power": power})
        name = f"power {power}"
        yield [ball], Case(name + ", centre", [-9, 0, 0, 1, 0, 0, math.inf], "tau", case["central_chord"])
        yield [ball], Case(name + ", b 1.2", [-9, 1.2, 0, 1, 0, 0, math.inf], "tau", case["impact_1_2_full"])
        yield [ball], Case(name + ", b 1.2, in part", [-0.5, 1.2, 0, 1, 0, 0, 2.5], "tau",
                           case["impact_1_2_partial_s_minus0_5_to_2"])


def gaussian(check):
    blob = check["inputs"]["iso"]
    fog = volume({"type": "world"}, density={"type": "gaussian", "center": [0, 0, 0], "sigma": blob["sigma"]})
    yield [fog], Case("isotropic", [-30, blob["impact"], 0, 1, 0, 0, math.inf], "tau", check["expected"]["iso_full"],
                      single=1e-5)


def constant_source(check):
    """Light of irradiance E scattered evenly is that of an ambient radiance E / (4 pi)."""
    inputs = check["inputs"]
    fog = volume({"type": "world"}, inputs["sigma_t"], albedo=inputs["albedo"], phase={"type": "isotropic"})
    for case in check["expected"]["cases"]:
        ray = [0, 0, 0, 0, 0, -1, case["L_m"]]
        yield [fog], Case(f"{case['L_m']} m", ray, "T", case["T"])
        yield [fog], Case(f"{case['L_m']} m, light", ray, "S", case["inscatter"])


def glowing(check):
    """S per metre is emission. Slices that touch must add up to the whole."""
    inputs, expected = check["inputs"], check["expected"]
    for count in [1] + inputs["slices"]:
        edges = [inputs["length"] * i / count for i in range(count + 1)]
        fog = [volume({"type": "box", "min": [a, -5, -5], "max": [b, 5, 5]}, inputs["sigma_t"], emission=inputs["S"])
               for a, b in zip(edges, edges[1:])]
        ray = [-1, 0.3, 0.2, 1, 0, 0, math.inf]
        yield fog, Case(f"{count} slices", ray, "S", expected["L"], double=1e-13, single=1e-6)
    for name in ("opaque", "vanishing"):
        slab = inputs[name]
        fog = [volume({"type": "box", "min": [0, -5, -5], "max": [slab["D"], 5, 5]}, slab["sigma"],
                      emission=inputs["S"])]
        yield fog, Case(name, [-1, 0, 0, 1, 0, 0, math.inf], "S", expected[name + "_slice"], double=1e-12, single=1e-6)


def visibility(check):
    for row in check["expected"]["rows"]:
        metres = row["V_m"]
        for name, more in (("sigma_5pct", {}), ("sigma_2pct", {"contrast": 0.02})):
            fog = {"shape": {"type": "world"}, "visibility": metres, **more}
            yield [fog], Case(f"{metres} m, {name}", [0, 0, 0, 1, 0, 0, metres], "tau", row[name] * metres, double=1e-12)


CHECKS = {"T01": sphere, "T02": box, "T03": bodies, "T04": height, "T06": two_layers, "T07": ramp, "T08": falloff_sphere,
          "T10": gaussian, "T14": constant_source, "T15": glowing, "T25": visibility}
AMBIENT = {"T14": lambda inputs: inputs["E"] / (4 * math.pi)}


def trace(scene, ray, *options):
    done = subprocess.run([NEBEL, "trace", scene, *options], input=" ".join(map(repr, ray)), capture_output=True,
                          text=True)
    if done.returncode != 0:
        sys.exit(f"check_physics: nebel trace: status {done.returncode}\n{done.stderr}")
    return [float(field) for field in done.stdout.splitlines()[1].split(",")]


def difference(case, result, step):
    """How far off the result is, and how far `1` relative would be."""
    if case.kind == "S":
        return abs(result[3] - case.expected), abs(case.expected)
    if case.kind == "T":
        return abs(result[0] - case.expected), abs(case.expected) + step
    tau = -math.log(result[0])
    return max(0, abs(tau - case.expected) - step), abs(case.expected)


def judge(case, results):
    """Faults of one case, in double and in float."""
    for name, result, relative, step in (("double", results[0], case.double, 2.3e-16),
                                         ("float", results[1], case.single, FLOAT_STEP)):
        if relative is None:
            continue
        # An optical depth is known to the rounding of exp(-tau) only.
        off, size = difference(case, result, step)
        if off > relative * size:
            yield f"{name}: {case.kind} is {off:.3g} off, {relative * size:.3g} is allowed"


def main():
    checks = {check["id"]: check for check in json.loads(PHYSICS.read_text())["checks"]}
    faults = []
    count = 0
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "scene.json")
        for identity, cases in CHECKS.items():
            check = checks[identity]
            ambient = AMBIENT.get(identity, lambda inputs: 0)(check["inputs"])
            for fog, case in cases(check):
                pathlib.Path(scene).write_text(json.dumps({"nebel": 1, "ambient": ambient, "fog": fog}))
                results = [trace(scene, case.ray, "--tolerance", "1e-9"),
                           trace(scene, case.ray, "--precision", "float", "--tolerance", "1e-7")]
                count += 1
                faults += [f"{identity} {case.name}: {fault}" for fault in judge(case, results)]
    print("\n".join(faults))
    print(f"check_physics: {count} cases of {len(CHECKS)} checks, {len(faults)} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
