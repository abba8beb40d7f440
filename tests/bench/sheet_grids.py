#!/usr/bin/env python3
"""Bodies without a closed form: the first 20 modes at the defaults of `carom modes` beside those on a grid of more
unknowns.

    sheet_grids.py --carom build/release/carom [--unknowns 40000] [--modes] [--short]

A plate of 60 mm by 160 mm that is bent by a right angle, and a spoon; and bodies of boards with sharp corners inside: a
tray, a closed crate, a table, shelves, a channel, a bracket. Of steel, and turned at random. Minutes each; docs/modal.md
has the table.
"""
import argparse
import itertools
import json
import math
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

MODES = 20
TURN = (0.9, (0.6, -0.3, 0.74))  # rad, about that axis


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    size = math.sqrt(sum(part * part for part in a))
    return [part / size for part in a]


def turned(place):
    """Rodrigues' formula."""
    angle, axis = TURN[0], unit(TURN[1])
    along = sum(a * b for a, b in zip(axis, place))
    across = cross(axis, place)
    return [p * math.cos(angle) + c * math.sin(angle) + a * along * (1 - math.cos(angle)) for p, c, a in zip(place, across, axis)]


def sheet(middle, rows, columns, thickness):
    """The OBJ text of a sheet about a middle surface, which is given at shares from 0 to 1 of its length and its width."""
    step = 1e-5

    def offset(u, v, side):
        du = [b - a for a, b in zip(middle(u - step, v), middle(u + step, v))]
        dv = [b - a for a, b in zip(middle(u, v - step), middle(u, v + step))]
        return [p + side * 0.5 * thickness * n for p, n in zip(middle(u, v), unit(cross(du, dv)))]

    vertices = [turned(offset(row / rows, column / columns, side)) for side in (-1, 1) for row in range(rows + 1) for column in range(columns + 1)]

    def index(side, row, column):
        return 1 + side * (rows + 1) * (columns + 1) + row * (columns + 1) + column

    quads = []
    for row in range(rows):
        for column in range(columns):
            corners = [(row, column), (row + 1, column), (row + 1, column + 1), (row, column + 1)]
            quads.append([index(1, *corner) for corner in corners])
            quads.append([index(0, *corner) for corner in reversed(corners)])
    rim = ([(row, 0) for row in range(rows)] + [(rows, column) for column in range(columns)]
           + [(row, columns) for row in range(rows, 0, -1)] + [(0, column) for column in range(columns, 0, -1)])
    for here, there in zip(rim, rim[1:] + rim[:1]):
        quads.append([index(0, *here), index(0, *there), index(1, *there), index(1, *here)])
    lines = ["v {:.9g} {:.9g} {:.9g}".format(*vertex) for vertex in vertices]
    for a, b, c, d in quads:
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    return "\n".join(lines) + "\n"


def bent_plate():
    flat, radius, width = 0.075, 0.006, 0.06
    arc = radius * math.pi / 2

    def middle(u, v):
        along, y = u * (2 * flat + arc), (v - 0.5) * width
        if along < flat:
            return [along - flat, y, 0.0]
        if along > flat + arc:
            return [radius, y, along - flat - arc + radius]
        angle = (along - flat) / radius
        return [radius * math.sin(angle), y, radius * (1 - math.cos(angle))]

    return sheet(middle, 120, 12, 0.002)


def spoon():
    def middle(u, v):
        along, across = 0.17 * u, 2 * v - 1
        bowl = min(max((along - 0.11) / 0.06, 0.0), 1.0)  # 0 along the handle, 1 at the tip
        swell = math.sin(math.pi * min(bowl, 0.93)) if bowl > 0 else 0.0
        half = 0.005 + 0.016 * swell
        deep = 0.009 * swell
        return [along, half * across, -deep * (1 - across * across) - 0.01 * math.sin(math.pi * u)]

    return sheet(middle, 160, 24, 0.0016)


def boards(lines, is_solid):
    """The OBJ text of all boxes between lines along x, y and z (m) whose middle is solid."""
    count = [len(along) - 1 for along in lines]

    def middle(place):
        return [0.5 * (along[at] + along[at + 1]) for along, at in zip(lines, place)]

    solid = {place for place in itertools.product(*map(range, count)) if is_solid(*middle(place))}
    numbers, quads = {}, []
    for place in sorted(solid):
        for axis, far in itertools.product(range(3), (0, 1)):
            beside = list(place)
            beside[axis] += 2 * far - 1
            if tuple(beside) in solid:
                continue
            corners = []
            for one, other in ((0, 0), (1, 0), (1, 1), (0, 1)):
                corner = list(place)
                corner[axis] += far
                corner[(axis + 1) % 3] += one
                corner[(axis + 2) % 3] += other
                corners.append(numbers.setdefault(tuple(corner), len(numbers) + 1))
            quads.append(corners if far else corners[::-1])
    places = [turned([along[at] for along, at in zip(lines, corner)]) for corner in numbers]
    text = ["v {:.12g} {:.12g} {:.12g}".format(*place) for place in places]
    for a, b, c, d in quads:
        text += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    return "\n".join(text) + "\n"


def walls(half, board):
    return [-half, board - half, half - board, half]


def tray():
    return boards((walls(0.1, 0.003), walls(0.075, 0.003), [0, 0.003, 0.05]), lambda x, y, z: z < 0.003 or abs(x) > 0.097 or abs(y) > 0.072)


def crate():
    return boards((walls(0.15, 0.004), walls(0.1, 0.004), walls(0.1, 0.004)),
                  lambda x, y, z: abs(x) > 0.146 or abs(y) > 0.096 or abs(z) > 0.096)


def table():
    return boards((walls(0.4, 0.04), walls(0.3, 0.04), [0, 0.45, 0.47]), lambda x, y, z: z > 0.45 or (abs(x) > 0.36 and abs(y) > 0.26))


def shelves():
    boards_at = [0, 0.15, 0.3, 0.45]
    return boards((walls(0.2, 0.008), [0, 0.008, 0.12], [z for at in boards_at for z in (at, at + 0.008)]),
                  lambda x, y, z: abs(x) > 0.192 or y < 0.008 or any(at < z < at + 0.008 for at in boards_at))


def channel():
    return boards((walls(0.03, 0.003), [-0.2, 0.2], [0, 0.003, 0.04]), lambda x, y, z: z < 0.003 or abs(x) > 0.027)


def bracket():
    return boards(([0, 0.005, 0.08], [-0.02, 0.02], [0, 0.005, 0.08]), lambda x, y, z: x < 0.005 or z < 0.005)


BODIES = {"bent plate": bent_plate, "spoon": spoon, "tray": tray, "crate": crate, "table": table, "shelves": shelves, "channel": channel,
          "bracket": bracket}


def modes_of(carom, mesh, folder, *more):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([carom, "modes", mesh, "--material", "carbon_steel", "--modes", str(MODES), "--no-radiation", "--no-cache", "--json",
                           "-o", folder / "model.carom_modes", *more], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"sheet_grids: {done.stderr.strip()}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = json.loads(done.stdout)
    answer["cpu_s"] = after.ru_utime - before.ru_utime
    return answer


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--carom", type=Path, required=True)
    options.add_argument("--unknowns", type=int, default=40000, help="of the grid that the defaults are compared with")
    options.add_argument("--modes", action="store_true", help="list them all")
    options.add_argument("--short", action="store_true", help="two bodies, grids of 1000 and 2000 unknowns, to see that all of it runs")
    chosen = options.parse_args()
    if not chosen.carom.is_file():
        options.error(f"{chosen.carom}: there is no such program; expected carom as it was built")
    print("body         unknowns  beside  CPU, s  worst, %  told, %  within")
    for name, make in BODIES.items():
        with tempfile.TemporaryDirectory(prefix="carom_sheet_") as folder:
            folder = Path(folder)
            mesh = folder / f"{name.replace(' ', '_')}.obj"
            mesh.write_text(make(), encoding="utf-8")
            if chosen.short and name not in ("bent plate", "bracket"):
                continue
            usual = modes_of(chosen.carom, mesh, folder, *(["--dofs", "1000"] if chosen.short else []))
            fine = modes_of(chosen.carom, mesh, folder, "--dofs", "2000" if chosen.short else str(chosen.unknowns))
        errors = [one["frequency_hz"] / other["frequency_hz"] - 1 for one, other in zip(usual["modes"], fine["modes"])]
        told = [mode["frequency_error"] for mode in usual["modes"]]
        within = sum(abs(error) <= bound for error, bound in zip(errors, told))
        print(f"{name:12} {usual['degrees_of_freedom']:8} {fine['degrees_of_freedom']:7} {usual['cpu_s']:7.1f} "
              f"{100 * max(map(abs, errors)):9.3f} {100 * max(told):8.3f}  {within} of {len(errors)}", flush=True)
        if chosen.modes:
            for one, other, error, bound in zip(usual["modes"], fine["modes"], errors, told):
                print(f"    {one['frequency_hz']:10.2f} Hz  {other['frequency_hz']:10.2f}  {100 * error:+.3f} %  told {100 * bound:.3f} %")


if __name__ == "__main__":
    main()
