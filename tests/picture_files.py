"""Pictures in files, as bytes of NumPy arrays: PNG, OpenEXR, PFM. Only what tests need, and nothing that nebel uses."""

import base64
import struct
import zlib

import numpy as np

# 16 x 8 pixels, the left half 128, the right half 200, of all colors, without loss.
GRAY_JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEB"
    "AQEBAQH/2wBDAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQH/wAARCAAIABAD"
    "AREAAhEBAxEB/8QAFQABAQAAAAAAAAAAAAAAAAAAAAr/xAAUEAEAAAAAAAAAAAAAAAAAAAAA/8QAFAEBAAAAAAAAAAAAAAAAAAAAAP/EABQRAQAA"
    "AAAAAAAAAAAAAAAAAAD/2gAMAwEAAhEDEQA/AAKQAf/Z")
# The same size in four inks.
CMYK_JPEG = base64.b64decode(
    "/9j/7gAOQWRvYmUAZAAAAAAA/9sAQwABAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEBAQEB"
    "AQEB/8AAFAgACAAQBEMRAE0RAFkRAEsRAP/EABUAAQEAAAAAAAAAAAAAAAAAAAAK/8QAFBABAAAAAAAAAAAAAAAAAAAAAP/aAA4EQwBNAFkASwAA"
    "PwAApAUgKQFID//Z")


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(array, bits=None):
    """Of uint8 or uint16, rows x columns or rows x columns x channels; bits 1: gray of 0 and 1."""
    array = np.asarray(array)
    channels = array.shape[2] if array.ndim == 3 else 1
    bits = bits or 8 * array.dtype.itemsize
    rows = np.packbits(array, axis=1) if bits == 1 else array.astype(array.dtype.newbyteorder(">"))
    body = b"".join(b"\0" + row.tobytes() for row in rows)
    head = struct.pack(">IIBBBBB", array.shape[1], array.shape[0], bits, {1: 0, 2: 4, 3: 2, 4: 6}[channels], 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(body, 1)) + chunk(b"IEND", b""))


def unfilter(kind, row, above, step):
    if kind == 0:
        return row
    if kind == 2:
        return row + above
    row = row.copy()
    for i in range(len(row)):
        left = int(row[i - step]) if i >= step else 0
        up, corner = int(above[i]), int(above[i - step]) if i >= step else 0
        guess = left + up - corner
        near = min((abs(guess - left), 0, left), (abs(guess - up), 1, up), (abs(guess - corner), 2, corner))[2]
        row[i] = (int(row[i]) + {1: left, 3: (left + up) // 2, 4: near}[kind]) & 255
    return row


def read_png(data):
    """rows x columns x channels, uint8 or uint16."""
    at, body = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, bits, color = struct.unpack(">IIBB", data[at + 8:at + 18])
        if kind == b"IDAT":
            body += data[at + 8:at + 8 + size]
        at += 12 + size
    channels = {0: 1, 2: 3, 4: 2, 6: 4}[color]
    step = channels * bits // 8
    raw = np.frombuffer(zlib.decompress(body), np.uint8).reshape(height, 1 + width * step)
    if (raw[:, 0] == 1).all():  # the commonest filter at once
        sums = np.cumsum(raw[:, 1:].reshape(height, width, step), axis=1, dtype=np.uint8)
        rows = sums.reshape(height, width * step)
    else:
        rows = np.zeros((height, width * step), np.uint8)
        for y in range(height):
            rows[y] = unfilter(raw[y, 0], raw[y, 1:], rows[y - 1] if y else np.zeros_like(rows[0]), step)
    whole = rows.reshape(-1).view(">u2").astype(np.uint16) if bits == 16 else rows
    return whole.reshape(height, width, channels)


def attribute(name, kind, data):
    return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data


def exr(planes):
    """Of {name: float32 array}, uncompressed."""
    names = sorted(planes)
    height, width = planes[names[0]].shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)
    channels = b"".join(n.encode() + b"\0" + struct.pack("<IBxxxII", 2, 0, 1, 1) for n in names) + b"\0"
    head = (b"\x76\x2f\x31\x01" + struct.pack("<I", 2) + attribute(b"channels", b"chlist", channels) +
            attribute(b"compression", b"compression", b"\0") + attribute(b"dataWindow", b"box2i", box) +
            attribute(b"displayWindow", b"box2i", box) + attribute(b"lineOrder", b"lineOrder", b"\0") +
            attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) +
            attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)) +
            attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    size = 8 + 4 * width * len(names)
    offsets = b"".join(struct.pack("<Q", len(head) + 8 * height + y * size) for y in range(height))
    rows = b"".join(struct.pack("<iI", y, size - 8) + b"".join(planes[n][y].astype("<f4").tobytes() for n in names)
                    for y in range(height))
    return head + offsets + rows


def unzip_exr(data, size):
    if len(data) == size:
        return data
    steps = np.frombuffer(zlib.decompress(data), np.uint8).astype(np.int64)
    steps[1:] -= 128
    halves = np.cumsum(steps).astype(np.uint8)
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = halves[:(size + 1) // 2], halves[(size + 1) // 2:]
    return out.tobytes()


def read_exr(data):
    """{name: float32 array} of scan lines of floats, by ZIP or none."""
    at, found = 8, {}
    while data[at] != 0:
        end = data.index(b"\0", at)
        kind_end = data.index(b"\0", end + 1)
        size, = struct.unpack("<I", data[kind_end + 1:kind_end + 5])
        found[data[at:end]] = data[kind_end + 5:kind_end + 5 + size]
        at = kind_end + 5 + size
    low_x, low_y, high_x, high_y = struct.unpack("<4i", found[b"dataWindow"])
    width, height, names, list_at = high_x - low_x + 1, high_y - low_y + 1, [], 0
    while found[b"channels"][list_at] != 0:
        end = found[b"channels"].index(b"\0", list_at)
        names.append(found[b"channels"][list_at:end].decode())
        list_at = end + 17
    lines = 16 if found[b"compression"] == b"\3" else 1
    blocks = (height + lines - 1) // lines
    planes = {name: np.empty((height, width), np.float32) for name in names}
    for block, start in enumerate(struct.unpack(f"<{blocks}Q", data[at + 1:at + 1 + 8 * blocks])):
        _, size = struct.unpack("<iI", data[start:start + 8])
        count = min(lines, height - block * lines)
        raw = unzip_exr(data[start + 8:start + 8 + size], count * width * len(names) * 4)
        rows = np.frombuffer(raw, "<f4").reshape(count, len(names), width)
        for i, name in enumerate(names):
            planes[name][block * lines:block * lines + count] = rows[:, i]
    return planes


def pfm(array, big=False):
    order = ">f4" if big else "<f4"
    return f"Pf\n{array.shape[1]} {array.shape[0]}\n{1.0 if big else -1.0}\n".encode() + array[::-1].astype(order).tobytes()
