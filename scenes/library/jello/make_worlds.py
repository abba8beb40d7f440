"""Writes the world files of this folder: jello cubes of 8 x 8 x 8 points, 1 m wide.

    python3 make_worlds.py

drop.w: falls on the floor, tilted. rotate.w: turns in free space. inclined_plane.w: falls on an
inclined plane and slides down. stiff.w: a small tilt is let go, of springs so stiff that it rings.
Only the standard library is needed, and the result is always the same.
"""

import math

N = 8


def rotation(axis, degrees):
    length = math.sqrt(sum(a * a for a in axis))
    x, y, z = (a / length for a in axis)
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [
        [c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
        [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
        [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)],
    ]


def times(matrix, v):
    return [sum(row[i] * v[i] for i in range(3)) for row in matrix]


def cube(middle, turn, shape=lambda p: p):
    points = []
    for i in range(N):
        for j in range(N):
            for k in range(N):
                p = shape([i / (N - 1) - 0.5, j / (N - 1) - 0.5, k / (N - 1) - 0.5])
                points.append([m + q for m, q in zip(middle, times(turn, p))])
    return points


def write(name, head, field, points, velocities):
    with open(name, "w", encoding="ascii", newline="\n") as file:
        file.write(head)
        file.write(field)
        for v in points + velocities:
            file.write(" ".join(repr(round(c, 9)) for c in v) + "\n")


STILL = [[0.0, 0.0, 0.0]] * N**3
MASS = 1.0 / 512
FALLS = "2\n" + f"0 0 {-9.81 * MASS!r}\n" * 8

tilt = rotation([1, 2, 0.5], 25)
write("drop.w", f"RK4\n0.0005 33\n200 0.25 400 0.25\n{MASS!r}\n0\n", FALLS, cube([0, 0, 0.5], tilt), STILL)

spin = [0.0, 0.0, 2.0]
points = cube([0, 0, 0], rotation([1, 0, 0], 20), lambda p: [1.2 * p[0], p[1], 0.9 * p[2]])
turning = [
    [spin[1] * p[2] - spin[2] * p[1], spin[2] * p[0] - spin[0] * p[2], spin[0] * p[1] - spin[1] * p[0]]
    for p in points
]
write("rotate.w", f"RK4\n0.0005 33\n200 0.25 400 0.25\n{MASS!r}\n0\n", "0\n", points, turning)

write(
    "inclined_plane.w",
    f"RK4\n0.0005 33\n200 0.25 400 0.25\n{MASS!r}\n1 -0.5 0 1 1\n",
    FALLS,
    cube([0.6, 0, 0.8], rotation([0, 0, 1], 0)),
    STILL,
)

bend = lambda p: [p[0] * (1 + 0.002 * math.sin(6 * p[2])), p[1], p[2] + 0.004 * p[0] * p[0]]
write(
    "stiff.w", f"RK4\n0.00001 1666\n200000 0.02 400 0.25\n{MASS!r}\n0\n", "0\n",
    cube([0, 0, 0], rotation([0, 0, 1], 0), bend), STILL,
)
