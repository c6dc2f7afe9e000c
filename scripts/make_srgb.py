#!/usr/bin/env python3
"""Makes the tables of sRGB in bytes (IEC 61966-2-1), src/stream/srgb_table.c.

    make_srgb.py FILE              write it
    make_srgb.py --check FILE      exit 1 unless it is as written

The first table gives the linear light of each byte. The second table gives the byte nearest to a light, in integers only. Its
index is the upper 16 bits of the float: sign, exponent and the first 7 bits of the fraction. Entries are narrower than bytes,
128 an octave, so each entry covers at most two bytes. The sum of the entry and the float's bits is the byte, in bits 16 to 23.
If the light belongs to the higher byte, the lower 16 bits of that sum carry into it.
"""
import struct
import sys

OCTAVES = 13  # below 1; light below 2^-13 is less than half of byte 1
FIRST = (127 - OCTAVES) << 7
COUNT = OCTAVES << 7


def decode(byte):
    c = byte / 255
    return c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4


def bits_from(light):
    """The bits of the smallest float that is not below `light`."""
    bits = struct.unpack("<I", struct.pack("<f", light))[0]
    return bits if struct.unpack("<f", struct.pack("<I", bits))[0] >= light else bits + 1


def entries():
    starts = [bits_from(decode(byte - 0.5)) for byte in range(1, 256)]
    for place in range(FIRST, FIRST + COUNT):
        low, high = place << 16, (place + 1) << 16
        byte = sum(start <= low for start in starts)
        inside = [start for start in starts if low < start < high]
        assert len(inside) <= 1
        carry = high - inside[0] if inside else 0
        yield ((byte << 16) + carry - low) & 0xffffffff


def rows(words, each):
    return "".join(",".join(words[i:i + each]) + ",\n" for i in range(0, len(words), each))


def text():
    lights = ["%.8ef" % struct.unpack("<f", struct.pack("<f", decode(byte)))[0] for byte in range(256)]
    return ('/* Written by scripts/make_srgb.py, which says of what. */\n#include "srgb.h"\n\n/* clang-format off */\n'
            "const float nb_srgb_light[256] = {\n" + rows(lights, 7) + "};\n\n"
            "const uint32_t nb_srgb_bytes[NB_SRGB_BYTES] = {\n" + rows(["0x%08x" % entry for entry in entries()], 10) + "};\n")


def main(words):
    if len(words) not in (1, 2) or words[:-1] not in ([], ["--check"]):
        return __doc__
    if words[0] != "--check":
        with open(words[0], "w") as file:
            file.write(text())
    elif open(words[1]).read() != text():
        return "make_srgb: %s is not what this writes" % words[1]
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
