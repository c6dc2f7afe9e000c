#!/usr/bin/env python3
"""Runs the example engines in a window of their own display, photographs it, and compares with the fog in closed form; then without
a display, and ends them from outside.

What the pictures should show is computed here once more, from the scene and the fog that the examples describe: rays against
boxes, the optical depth of mist that thins out with height, and the ball of other fog by quadrature. With a folder as argument
it leaves the photographs there as PNG.
"""

import os
import pathlib
import struct
import subprocess
import sys
import tempfile
import time
import zlib

import numpy as np

WIDTH, HEIGHT = 640, 400
EYE = np.array([0.0, 2.0, 10.0])
BUILD = pathlib.Path(os.environ.get("NEBEL_BUILD", "build"))

# (centre, half width), colour; lit by .6 + n . (.1, .4, .2)
BOXES = [((0, -200, 0), 200, (.12, .2, .06)), ((-4, 1.5, 0), 1.5, (.5, .1, .08)), ((3, 2, -3), 2, (.5, .3, .1)),
         ((-9, 6, -22), 6, (.3, .3, .3))]
SKY = (.25, .45, .8)
LIGHT = (.1, .4, .2)
MIST, MIST_HEIGHT, MIST_SOURCE = .25, .6, np.array([.5, .6, .7])
BALL, BALL_RADIUS = np.array([-1, 1.2, 2]), 1.5
BALL_EXTINCTION, BALL_EMISSION = np.array([.4, .8, 1.2]), np.array([.7, .35, .1])
PARTICLE_CENTERS = [np.array([.8 * i ** .5 * np.cos(2.4 * i) - 1, .5 + .3 * np.sin(1.3 * i), .8 * i ** .5 * np.sin(2.4 * i) + 1.5])
                    for i in range(16)]
PARTICLE_RADIUS, PARTICLE_EXTINCTION, PARTICLE_LIGHT = 1.2, np.array([2, 2.5, 3]), np.array([1.8, 1.6, 1.4])


# ---- what should be seen -------------------------------------------------------------------------------------------

def directions():
    x = ((np.arange(WIDTH) + .5) / WIDTH * 2 - 1) * WIDTH / HEIGHT / 1.5
    y = (1 - (np.arange(HEIGHT) + .5) / HEIGHT * 2) / 1.5
    way = np.stack(np.broadcast_arrays(x[None, :], y[:, None], -1.0), axis=-1)
    return way / np.linalg.norm(way, axis=-1, keepdims=True)


def surfaces(way):
    """Distance and colour of what is hit first."""
    distance = np.full(way.shape[:2], 1e6)
    color = np.broadcast_to(SKY, way.shape).copy()
    with np.errstate(divide="ignore"):
        inverse = 1 / way
    for centre, half, paint in BOXES:
        low, high = ((np.array(centre) + side * half - EYE) * inverse for side in (-1, 1))
        entries = np.minimum(low, high)
        enter, leave = entries.max(-1), np.maximum(low, high).min(-1)
        axis = entries.argmax(-1)
        normal = -np.sign(np.take_along_axis(way, axis[..., None], -1)[..., 0])
        hit = (enter < leave) & (enter > 0) & (enter < distance)
        lit = .6 + normal * np.array(LIGHT)[axis]
        distance[hit] = enter[hit]
        color[hit] = (lit[..., None] * paint)[hit]
    return distance, color


def mist_depth(way, start, end):
    """The integral of MIST e^(-height / MIST_HEIGHT) from start to end along the ray."""
    slope = way[..., 1] / MIST_HEIGHT  # never 0: rays go through the middles of an even number of rows
    first, last = (np.exp(np.minimum(-EYE[1] / MIST_HEIGHT - slope * t, 80)) for t in (start, end))
    return MIST * (first - last) / slope


class Light:
    """What is gathered on the way from the eye: transmittance and in-scattering of one layer after the other."""

    def __init__(self, way):
        self.transmittance = np.ones(way.shape)
        self.radiance = np.zeros(way.shape)

    def add(self, light, depth):
        """A layer of optical depth `depth` whose light, were nothing absorbed, would be `light`."""
        through = np.exp(-depth)
        gathered = np.where(depth > 1e-12, light * (1 - through) / np.maximum(depth, 1e-300), light)
        self.radiance = self.radiance + self.transmittance * gathered
        self.transmittance = self.transmittance * through

    def add_mist(self, way, start, end):
        depth = mist_depth(way, start, end)[..., None] * np.ones(3)
        self.add(depth * MIST_SOURCE, depth)


def mist_before(way, distance):
    light = Light(way)
    light.add_mist(way, 0 * distance, distance)
    return light


def stretch(way, distance, center, radius):
    """Closest approach to a ball, the square of the distance there, and where rays enter and leave before `distance`."""
    closest = ((center - EYE) * way).sum(-1)
    square = ((center - EYE) ** 2).sum() - closest ** 2
    half = np.sqrt(np.maximum(radius ** 2 - square, 0))
    enter, leave = (np.clip(closest + side * half, 0, distance) for side in (-1, 1))
    return closest, square, enter, leave


def mist_and_ball(way, distance):
    """Mist, the ball in mist in many thin layers, mist."""
    closest, square, enter, leave = stretch(way, distance, BALL, BALL_RADIUS)
    light = Light(way)
    light.add_mist(way, 0 * distance, enter)
    steps = 200
    for i in range(steps):
        start, end = enter + (leave - enter) * i / steps, enter + (leave - enter) * (i + 1) / steps
        middle = (start + end) / 2
        inside = np.maximum(1 - (square + (middle - closest) ** 2) / BALL_RADIUS ** 2, 0) ** 2 * (end - start)
        mist = mist_depth(way, start, end)[..., None]
        light.add(mist * MIST_SOURCE + inside[..., None] * BALL_EMISSION, mist + inside[..., None] * BALL_EXTINCTION)
    light.add_mist(way, leave, distance)
    return light


def smoke(way, distance, center):
    """A particle before the surface: its density integrated by the antiderivative of a power."""
    closest, square, enter, leave = stretch(way, distance, center, PARTICLE_RADIUS)
    c = 1 - square / PARTICLE_RADIUS ** 2

    def integral(t):
        x = (t - closest) / PARTICLE_RADIUS
        return PARTICLE_RADIUS * (c * c * x - c * x ** 3 * 2 / 3 + x ** 5 / 5)
    length = np.where(leave > enter, integral(leave) - integral(enter), 0)[..., None]
    light = Light(way)
    light.add(length * PARTICLE_LIGHT, length * PARTICLE_EXTINCTION)
    return light


def bytes_of(light):
    light = np.clip(light, 0, 1)
    return np.where(light <= .0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - .055) * 255


def expected_scene():
    way = directions()
    distance, color = surfaces(way)
    light = mist_and_ball(way, distance)
    return bytes_of(light.transmittance * color + light.radiance)


def expected_particles():
    way = directions()
    distance, color = surfaces(way)
    before = mist_before(way, distance)
    pixel = before.transmittance * color + before.radiance
    for center in sorted(PARTICLE_CENTERS, key=lambda c: -np.linalg.norm(c - EYE)):
        before = mist_before(way, np.minimum(distance, np.linalg.norm(center - EYE)))
        ball = smoke(way, distance, center)
        behind = (pixel - before.radiance) / before.transmittance
        pixel = before.radiance + before.transmittance * (ball.transmittance * behind + ball.radiance)
    return bytes_of(pixel)


# ---- what is seen --------------------------------------------------------------------------------------------------

def photograph(folder):
    """The display as it is, in rows of RGB."""
    path = pathlib.Path(folder, "display.xwd")
    subprocess.run(["xwd", "-root", "-silent", "-out", path], check=True)
    data = path.read_bytes()
    header = struct.unpack(">25I", data[:100])
    start, width, height, order, row, colors = header[0] + 12 * header[19], header[4], header[5], header[7], header[12], header[19]
    assert header[11] == 32 and order == 0 and (width, height) == (WIDTH, HEIGHT), header
    pixels = np.frombuffer(data, np.uint8, row * height, start).reshape(height, row)[:, : 4 * width].reshape(height, width, 4)
    return pixels[:, :, 2::-1].astype(float)


def wait_for(condition, folder, what):
    deadline = time.monotonic() + 120
    while time.monotonic() < deadline:
        picture = photograph(folder)
        if condition(picture):
            return picture
        time.sleep(.2)
    sys.exit(f"check_hosts: {what} within two minutes")


def settled(program, folder):
    """Waits until two photographs in a row are the same and not black."""
    last = [None]

    def is_still(picture):
        if program.poll() is not None:
            sys.exit(f"check_hosts: {program.args[0]} ended by itself, status {program.returncode}")
        still = last[0] is not None and picture.max() > 0 and (picture == last[0]).all()
        last[0] = picture
        return still
    return wait_for(is_still, folder, "no still picture")


def press(action, key):
    subprocess.run(["xdotool", action, key], check=True)


def write_png(path, picture):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in picture)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", WIDTH, HEIGHT, 8, 2, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


# ---- one against the other -----------------------------------------------------------------------------------------

def check(name, wanted, step, share, key, output):
    """Half of the pixels are rounded right, at least `share` are within `step` of 255; a key changes the picture, another one
    ends the program. Before the first picture it says what takes so long: all but embed_vertex_colors, which has no fog in shaders."""
    with tempfile.TemporaryDirectory() as folder:
        # Drivers and window systems leak; what nebel leaks the tests without a window would find.
        program = subprocess.Popen([BUILD / "examples" / name], env=QUIET, stderr=subprocess.PIPE, text=True)
        try:
            picture = settled(program, folder)
            press("keydown", key)
            other = wait_for(lambda now: (np.abs(now - picture).max(-1) > 8).mean() > .002, folder, f"{name}: {key} did nothing")
            press("keyup", key)
            press("key", "Escape")
            words = program.communicate(timeout=60)[1]
            status = program.returncode
        finally:
            program.kill()
            program.wait()
    if output:
        write_png(pathlib.Path(output, f"{name}.png"), picture)
        write_png(pathlib.Path(output, f"{name}-{key}.png"), other)
    off = np.abs(picture - wanted).max(-1)
    found = (off <= step).mean()
    said = words.count("the driver compiles shaders") == (name != "embed_vertex_colors")
    print(f"{name}: {100 * found:.2f} % of the pixels within {step}, median {np.median(off):.2f}, status {status}, "
          f"says {words.strip() or 'nothing'}")
    return status == 0 and found >= share and np.median(off) <= .5 and said


# ---- what ends them ------------------------------------------------------------------------------------------------

NAMES = ["embed_glfw", "embed_sdl", "embed_vertex_colors", "embed_particles"]
QUIET = dict(os.environ, ASAN_OPTIONS="detect_leaks=0")


def check_refusal(name):
    """Without a display the program ends by itself and says what to do."""
    bare = {key: value for key, value in QUIET.items() if key not in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")}
    try:
        done = subprocess.run([BUILD / "examples" / name], env=bare, stderr=subprocess.PIPE, timeout=60, text=True)
    except subprocess.TimeoutExpired:
        print(f"{name}: without a display it does not end")
        return False
    good = done.returncode == 1 and "display" in done.stderr.lower() and f"xvfb-run -a {name}" in done.stderr
    if not good:
        print(f"{name}: without a display: status {done.returncode}, {done.stderr}")
    return good


def check_signal(name):
    """SIGTERM ends the program, also while a driver compiles its shaders."""
    program = subprocess.Popen([BUILD / "examples" / name], env=QUIET)
    time.sleep(1)
    program.terminate()
    try:
        program.wait(20)
    except subprocess.TimeoutExpired:
        print(f"{name}: SIGTERM does not end it")
        program.kill()
        program.wait()
        return False
    return True


def main():
    output = sys.argv[2] if len(sys.argv) > 2 else None
    scene = expected_scene()
    good = [check("embed_glfw", scene, 2, .99, "Right", output), check("embed_sdl", scene, 2, .99, "Right", output),
            check("embed_vertex_colors", scene, 6, .99, "Right", output),
            check("embed_particles", expected_particles(), 2, .99, "space", output)]
    good += [check_refusal(name) and check_signal(name) for name in NAMES]
    sys.exit(0 if all(good) else 1)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        main()
    # A server begins anew when its last client leaves, and turns away who comes just then, unless told not to.
    os.execvp("xvfb-run", ["xvfb-run", "-a", "-s", f"-screen 0 {WIDTH}x{HEIGHT}x24 -noreset", sys.executable, __file__,
                           "--inside"] + sys.argv[1:])
