"""A second reader of .csmap, written from docs/map_format.md alone: what it reads must be what
covsplat reads.
"""
import math
import struct
import zlib

COLUMNS = ["position", "normal_u", "normal_v", "twist", "scale_u", "scale_v", "opacity",
           "confidence", "control_score", "intensity", "keyframe", "last_seen"]


def sections(data: bytes):
    """Pairs of tag and payload; every checksum is checked."""
    assert data[:8] == b"CSMAP\r\n\x1a", data[:8]
    version, count, gaussians, crc = struct.unpack_from("<IIQI", data, 8)
    assert version == 1 and crc == zlib.crc32(data[:24])
    found, at = [], 28
    for _ in range(count):
        tag, size, crc = struct.unpack_from("<4sII", data, at)
        payload = data[at + 12:at + 12 + size]
        assert len(payload) == size and crc == zlib.crc32(data[at:at + 8] + payload)
        found.append((tag.decode(), payload))
        at += 12 + size
    assert at == len(data)
    return gaussians, found


def pack(gaussians, found) -> bytes:
    """The inverse of sections()."""
    data = b"CSMAP\r\n\x1a" + struct.pack("<IIQ", 1, len(found), gaussians)
    data += struct.pack("<I", zlib.crc32(data))
    for tag, payload in found:
        head = tag.encode() + struct.pack("<I", len(payload))
        data += head + struct.pack("<I", zlib.crc32(head + payload)) + payload
    return data


def columns(payload: bytes):
    """The cube of a tile, and its columns of integers by name."""
    *cube, n = struct.unpack_from("<iiiI", payload)
    at, table = 16, {}
    for name in COLUMNS:
        low, planes = struct.unpack_from("<qB", payload, at)
        at += 9
        values = [low] * n
        for plane in range(planes):
            size, = struct.unpack_from("<I", payload, at)
            data = zlib.decompress(payload[at + 4:at + 4 + size])
            assert len(data) == n
            values = [value + (byte << (8 * plane)) for value, byte in zip(values, data)]
            at += 4 + size
        table[name] = values
    assert at == len(payload)
    return cube, table


def rotation(u, v, twist):
    """Quaternion w x y z."""
    a, b = u / 2047 - 1, v / 2047 - 1
    z = 1 - abs(a) - abs(b)
    if z < 0:
        a, b = (1 - abs(b)) * (1 if a >= 0 else -1), (1 - abs(a)) * (1 if b >= 0 else -1)
    length = math.sqrt(a * a + b * b + z * z)
    x, y, z = a / length, b / length, z / length
    swing = [1 + z, -y, x] if z > -1 else [0, 1, 0]
    length = math.sqrt(sum(s * s for s in swing))
    w, i, j = (s / length for s in swing)
    c, s = math.cos(twist * math.pi / 512), math.sin(twist * math.pi / 512)
    return [w * c, i * c + j * s, j * c - i * s, w * s]


def gaussians_of(payload: bytes):
    """Dictionaries with the names of map.ply, in the order of the tile."""
    cube, table = columns(payload)
    code = 0
    for row in zip(*(table[name] for name in COLUMNS)):
        codes = dict(zip(COLUMNS, row))
        code += codes["position"]
        steps = [sum((code >> (3 * bit + axis) & 1) << bit for bit in range(17))
                 for axis in range(3)]
        found = {name: 64 * cube[axis] + (steps[axis] + 0.5) / 2048
                 for axis, name in enumerate("xyz")}
        q = rotation(codes["normal_u"], codes["normal_v"], codes["twist"])
        found.update({f"rot_{k}": q[k] for k in range(4)})
        found["scale_0"], found["scale_1"] = codes["scale_u"] / 64, codes["scale_v"] / 64
        found["opacity"] = codes["opacity"] / 64
        found["confidence"] = codes["confidence"] / 255
        score, light = codes["control_score"], codes["intensity"]
        found["control_score"] = score / 254 if score >= 0 else -1
        found["intensity"] = math.exp(light / 64) if light > -8192 else 0
        found["keyframe"], found["last_seen"] = codes["keyframe"], codes["last_seen"]
        yield found


def ply_rows(data: bytes):
    """The rows of a PLY of floats, as dictionaries."""
    header, body = data.split(b"end_header\n", 1)
    names = [line.split()[-1] for line in header.decode().splitlines() if
             line.startswith("property float")]
    for row in struct.iter_unpack(f"<{len(names)}f", body):
        yield dict(zip(names, row))


def differences(csmap: bytes, ply: bytes):
    """What two files of one map have that is not the same, to the precision of floats."""
    count, found = sections(csmap)
    mine = [g for tag, payload in found if tag == "TILE" for g in gaussians_of(payload)]
    theirs = list(ply_rows(ply))
    if not count == len(mine) == len(theirs):
        yield f"{count}, {len(mine)} and {len(theirs)} Gaussians"
    for i, (a, b) in enumerate(zip(mine, theirs)):
        for name, value in a.items():
            if abs(value - b[name]) > 1e-5 * max(1, abs(value)):
                yield f"{name} of {i}: {value} and {b[name]}"
