#!/usr/bin/env python3
"""Damages copies of models and hands each to `nebel info`, which must end within 10 s and below 2 GB, with status 0, or with
status 1 and a message that names the model.

damage_models.py PROGRAM [--count N] [--seed N] [--jobs N] [--models FOLDER] [--keep FOLDER]

Each copy lies beside its original, so that it finds what it names. One in five keeps the model and damages a file beside it.
The same seed gives the same copies. Prints what becomes of them, and exits 1 where one was mishandled; --keep saves those."""

import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time

SECONDS = 10
MEMORY = 2 << 30
# Not models: what models name, and what the collection says of itself.
OTHERS = {".png", ".jpg", ".jpeg", ".tga", ".bmp", ".dds", ".mtl", ".bin", ".txt", ".md", ".material", ".skeleton", ".pcx", ".glsl", ".html",
          ".source", ".license", ".py", ".svg", ".gif", ".vert", ".frag", ".json"}
WORDS = [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7F800000, 0x7FC00000, 0x00FFFFFF, 0x10000000]
NUMBERS = [b"-1", b"0", b"1e38", b"1e-38", b"nan", b"inf", b"4294967295", b"2147483648", b"99999999999999999999", b"16777216", b""]


def flip(dice, data):
    for _ in range(dice.randint(1, 32)):
        at = dice.randrange(len(data))
        data[at] ^= 1 << dice.randrange(8)


def put_words(dice, data):
    for _ in range(dice.randint(1, 6)):
        at = dice.randrange(len(data))
        word = struct.pack("<I", dice.choice(WORDS))[:dice.choice([1, 2, 4])]
        data[at:at + len(word)] = word


def cut(dice, data):
    del data[dice.randrange(len(data)):]


def take_out(dice, data):
    at = dice.randrange(len(data))
    del data[at:at + dice.choice([1, 4, 100, 5000])]


def repeat(dice, data):
    at = dice.randrange(len(data))
    block = bytes(data[at:at + dice.choice([4, 40, 400, 4000])])
    data[at:at] = block * dice.choice([1, 10, 1000][:3 if len(block) < 1000 else 2])


def put_noise(dice, data):
    at = dice.randrange(len(data))
    data[at:at] = dice.randbytes(dice.choice([1, 16, 1000]))


def put_numbers(dice, data):
    """Numbers written in digits become others."""
    for _ in range(dice.randint(1, 4)):
        start = dice.randrange(len(data))
        digits = [i for i in range(start, min(start + 4000, len(data))) if 0x30 <= data[i] <= 0x39]
        if not digits:
            return flip(dice, data)
        end = digits[0]
        while end < len(data) and 0x30 <= data[end] <= 0x39:
            end += 1
        data[digits[0]:end] = dice.choice(NUMBERS)
    return None


KINDS = [flip, put_words, cut, take_out, repeat, put_noise, put_numbers]


def damage(dice, data):
    data = bytearray(data)
    for _ in range(dice.choice([1, 1, 1, 2, 3])):
        if data:
            dice.choice(KINDS)(dice, data)
    return bytes(data)


def limit():
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def run(program, scene):
    """Status, or what went wrong instead; the last message; seconds; the largest of the processes in bytes."""
    begin = time.monotonic()
    child = subprocess.Popen([program, "info", str(scene)], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                             preexec_fn=limit, start_new_session=True)
    late = threading.Event()

    def stop():
        late.set()
        os.killpg(child.pid, signal.SIGKILL)

    timer = threading.Timer(SECONDS, stop)
    timer.start()
    said = child.stderr.read().decode(errors="replace").strip()
    _, status, usage = os.wait4(child.pid, 0)
    timer.cancel()
    child.returncode = 0
    child.stderr.close()
    result = "no end" if late.is_set() else os.waitstatus_to_exitcode(status)
    return result, said, time.monotonic() - begin, usage.ru_maxrss * 1024


class Worker:
    """A tree of models of its own, in which to damage things."""

    def __init__(self, options):
        self.options = options
        self.root = pathlib.Path(tempfile.mkdtemp(prefix="nebel-damage."))
        shutil.copytree(options.models, self.root / "models")

    def try_one(self, number):
        options = self.options
        dice = random.Random(options.seed * 1000003 + number)
        original = dice.choice(options.names)
        folder = (self.root / "models" / original).parent
        beside = sorted(p for p in folder.iterdir() if p.is_file() and p.suffix.lower() in OTHERS and p.stat().st_size > 0)
        model = self.root / "models" / original
        victim = dice.choice(beside) if beside and dice.random() < 0.2 else model
        whole = victim.read_bytes()
        target = victim
        if victim == model:
            model = target = folder / f"damaged-{number}{model.suffix}"
        target.write_bytes(damage(dice, whole))
        scene = self.root / "scene.json"
        scene.write_text(json.dumps({"nebel": 1, "fog": [], "models": [{"file": str(model)}]}))
        try:
            status, said, seconds, memory = run(options.program, scene)
            wrong = None
            if status not in (0, 1):
                wrong = str(status)
            elif status == 1 and model.name not in said:
                wrong = "does not name the model"
            elif memory >= MEMORY:
                wrong = f"{memory >> 20} MiB"
            if wrong and options.keep:
                pathlib.Path(options.keep).mkdir(parents=True, exist_ok=True)
                shutil.copy(target, pathlib.Path(options.keep) / f"{number}-{target.name}")
        finally:
            if target == victim:
                victim.write_bytes(whole)
            else:
                target.unlink()
        return number, str(original), status, said, seconds, memory, wrong


def kind_of(status, said):
    """A line of the table, by what was said last."""
    if status == 0:
        return "read"
    for part, kind in (("takes longer than", "refused: time"), ("of memory", "refused: memory"), ("was ended by", "refused: the reader crashed"),
                       ("ended early", "refused: the reader ended early"), ("cannot be:", "refused: impossible meshes")):
        if part in said:
            return kind
    return "refused: with a reason"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=os.path.abspath)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--models", default="/usr/share/assimp/models")
    parser.add_argument("--keep")
    options = parser.parse_args()
    top = pathlib.Path(options.models)
    options.names = sorted(p.relative_to(top) for p in top.rglob("*") if p.is_file() and p.suffix and p.suffix.lower() not in OTHERS)
    if not options.names:
        print(f"damage_models: no models in {top}; install assimp-testmodels")
        return 0
    kinds, faults, slowest, largest = collections.Counter(), 0, 0.0, 0
    local = threading.local()
    workers = []

    def work(number):
        if not hasattr(local, "worker"):
            local.worker = Worker(options)
            workers.append(local.worker)
        return local.worker.try_one(number)

    try:
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for number, name, status, said, seconds, memory, wrong in pool.map(work, range(options.count)):
                kinds[kind_of(status, said)] += 1
                slowest, largest = max(slowest, seconds), max(largest, memory)
                if wrong:
                    faults += 1
                    print(f"{number} {name}: {wrong}, {seconds:.1f} s: {said[-200:]}", flush=True)
    finally:
        for worker in workers:
            shutil.rmtree(worker.root, ignore_errors=True)
    for kind, count in kinds.most_common():
        print(f"{count:6} {kind}")
    print(f"damage_models: {options.count} models, {faults} mishandled; at most {slowest:.1f} s and {largest >> 20} MiB a process")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
