"""Writes brick.png: a normal map of a wall of bricks, 225 mm x 150 mm, two courses in running bond.

    python3 make_brick.py brick.png

Bricks are 215 mm x 65 mm with joints of 10 mm that lie 0.3 mm back; faces and joints are rough. The
picture repeats without a seam. Only the standard library is needed, and the result is always the
same.
"""

import math
import random
import struct
import sys
import zlib

WIDTH, HEIGHT = 512, 512  # texels
SIZE_X, SIZE_Y = 0.225, 0.150  # m
COURSE = 0.075  # m
JOINT = 0.010  # m
DEPTH = 0.0003  # m, of the joints
BEVEL = 0.004  # m, over which an edge falls off
WAVES = 400
ROUGH = 40e-6  # m, rms of the faces
STEEPEST = 0.9  # slope that a colour can hold with sense


def joint_height(x, y):
    """m: 0 on a face, -DEPTH in a joint."""
    course = math.floor(y / COURSE)
    y -= course * COURSE
    x = (x + (0.5 * SIZE_X if course % 2 else 0.0)) % SIZE_X
    inside = min(x - 0.5 * JOINT, SIZE_X - 0.5 * JOINT - x, y - 0.5 * JOINT, COURSE - 0.5 * JOINT - y)
    t = min(max(0.5 + inside / BEVEL, 0.0), 1.0)
    return -DEPTH * (1.0 - t * t * (3.0 - 2.0 * t))


def rough_waves():
    """Waves that fit the picture, finer ones lower, of random phase."""
    rng = random.Random(8)
    waves = []
    for _ in range(WAVES):
        q = math.exp(rng.uniform(math.log(20.0), math.log(230.0)))  # periods across the picture
        angle = rng.uniform(0.0, math.pi)
        i, j = round(q * math.cos(angle)), round(q * math.sin(angle) * SIZE_Y / SIZE_X)
        waves.append((i, j, rng.uniform(0.0, 2.0 * math.pi), q**-0.4))
    power = sum(a * a for _, _, _, a in waves) / 2.0
    return [(i, j, p, a * ROUGH / math.sqrt(power)) for i, j, p, a in waves]


def add_waves(slopes_x, slopes_y):
    """Adds the slopes of the waves, by products of tables of sines."""
    for i, j, phase, a in rough_waves():
        kx, ky = 2.0 * math.pi * i / SIZE_X, 2.0 * math.pi * j / SIZE_Y
        along_x = [2.0 * math.pi * i * (u + 0.5) / WIDTH for u in range(WIDTH)]
        sin_x, cos_x = [math.sin(t) for t in along_x], [math.cos(t) for t in along_x]
        for v in range(HEIGHT):
            t = 2.0 * math.pi * j * (v + 0.5) / HEIGHT + phase
            s, c = math.sin(t), math.cos(t)
            row_x, row_y = slopes_x[v], slopes_y[v]
            for u in range(WIDTH):
                d = -a * (sin_x[u] * c + cos_x[u] * s)
                row_x[u] += kx * d
                row_y[u] += ky * d


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def main():
    dx, dy = SIZE_X / WIDTH, SIZE_Y / HEIGHT
    slopes_x = [[0.0] * WIDTH for _ in range(HEIGHT)]
    slopes_y = [[0.0] * WIDTH for _ in range(HEIGHT)]
    for v in range(HEIGHT):
        for u in range(WIDTH):
            x, y = (u + 0.5) * dx, (v + 0.5) * dy
            slopes_x[v][u] = (joint_height(x + dx / 2, y) - joint_height(x - dx / 2, y)) / dx
            slopes_y[v][u] = (joint_height(x, y + dy / 2) - joint_height(x, y - dy / 2)) / dy
    add_waves(slopes_x, slopes_y)
    rows = bytearray()
    for v in reversed(range(HEIGHT)):  # the lowest row of the picture is v = 0
        rows.append(0)
        for u in range(WIDTH):
            sx = min(max(slopes_x[v][u], -STEEPEST), STEEPEST)
            sy = min(max(slopes_y[v][u], -STEEPEST), STEEPEST)
            n = math.sqrt(1.0 + sx * sx + sy * sy)
            rows += bytes(round(127.5 * (c / n + 1.0)) for c in (-sx, -sy, 1.0))
    header = struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 2, 0, 0, 0)
    with open(sys.argv[1], "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"IDAT", zlib.compress(bytes(rows), 9)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    main()
