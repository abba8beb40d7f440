#!/usr/bin/env python3
"""Makes a page by hand from the template, without a simulation: something of every kind that a page can show.

    sample_page.py TEMPLATE OUT.html [--marbles 40] [--runs 2] [--events 0]

Spheres bounce on a plane by the formulas of free fall, a box slides, a hammer (a mesh) turns, a ball hangs on a rod,
another on a spring, and a cube of jello wobbles. There is no sound in it: that takes Carom itself.
"""
import argparse
import base64
import gzip
import json
import math
import struct
from pathlib import Path

GRAVITY = 9.81
DURATION = 3.0
RESTITUTION = 0.72
RATE = 240  # poses in a second, beside those at collisions
LINE = "<!-- carom: runs -->"


class Blobs:
    def __init__(self):
        self.items = []

    def add(self, data):
        self.items.append(base64.b64encode(gzip.compress(data, 6, mtime=0)).decode())
        return len(self.items) - 1

    def table(self, rows, kind):
        """Rows as planes: byte after byte of them, each XOR that of the row above."""
        data = b"".join(struct.pack(f"<{len(row)}{kind}", *row) for row in rows)
        width = len(data) // len(rows) if rows else 0
        planes = bytearray()
        for place in range(width):
            column = data[place::width]
            planes += bytes(one ^ two for one, two in zip(column, b"\0" + column[:-1]))
        return self.add(bytes(planes))

    def doubles(self, rows):
        return self.add(b"".join(struct.pack(f"<{len(row)}d", *row) for row in rows))


class Run:
    """Bodies, and the rows of its tables."""

    def __init__(self):
        self.bodies, self.poses, self.events, self.contacts, self.links, self.meshes = [], [], [], [], [], []

    def body(self, name, material, form, pose, mass=None, moves=True, **more):
        radius = form.get("radius", 0.05)
        self.bodies.append({"id": len(self.bodies), "name": name, "material": material, "mass": mass, "radius": radius, "moves": moves,
                            "rings": False, "textured": False, "pose": pose, "form": form, **more})
        return len(self.bodies) - 1

    def pose(self, time, body, place, turn=(1, 0, 0, 0)):
        self.poses.append((time, body, *place, *turn))

    def collide(self, time, body, other, impulse, speed, place, up=(0, 1, 0)):
        peak = 1.6 * impulse / 0.05 * 2e-1
        for one, two, sign, share in ((body, other, 1, 0.8), (other, body, -1, 0.2)):
            self.events.append((time, one, two, impulse, speed, 3e-5 * max(speed, 1e-3) ** -0.2, share * peak, *place,
                                *(sign * impulse * part for part in up), 0))


def turned(axis, angle):
    length = math.hypot(*axis)
    return (math.cos(angle / 2), *(math.sin(angle / 2) * part / length for part in axis))


def bounce(run, body, floor, radius, start, drift, mass):
    """A sphere that falls from `start` and bounces; exact between bounces, which are rows of their own."""
    time, (x, y, z), speed = 0.0, start, 0.0
    spin = (drift[1] or 0.1, 0.2, -drift[0])
    rate = 9.0
    while time < DURATION:
        flight = (speed + math.sqrt(speed * speed + 2 * GRAVITY * max(0.0, y - radius))) / GRAVITY
        if flight < 0.02:
            break
        end = min(DURATION, time + flight)
        for sample in range(int((end - time) * RATE) + 1):
            at = sample / RATE
            run.pose(time + at, body, (x + drift[0] * at, y + speed * at - GRAVITY * at * at / 2, z + drift[1] * at), turned(spin, rate * (time + at)))
        landing = GRAVITY * flight - speed
        x, y, z, time = x + drift[0] * flight, radius, z + drift[1] * flight, time + flight
        if time > DURATION:
            break
        speed = RESTITUTION * landing
        run.collide(time, body, floor, mass * (landing + speed), landing, (x, 0, z))
    run.pose(min(time, DURATION), body, (x, y, z), turned(spin, rate * min(time, DURATION)))
    if time < DURATION - 0.05:
        run.contacts.append((body, floor, time, DURATION, 0, mass * GRAVITY))


def marbles(run, floor, count):
    materials = ["glass", "steel", "glass", "rubber", "wood", "ceramic"]
    for index in range(count):
        material = materials[index % len(materials)] if count < 30 else ("glass" if index % 3 else "steel")
        radius = 0.05 if count < 30 else 0.018 + 0.004 * (index % 4)
        ring, angle = 0.12 + 0.02 * (index % 7), 2.4 * index
        start = (ring * math.cos(angle) - 0.05, 0.25 + 0.06 * (index % 9), ring * math.sin(angle))
        mass = 4 / 3 * math.pi * radius ** 3 * 2500
        body = run.body(f"{material} ball {index + 1}", material, {"kind": "sphere", "radius": radius}, [*start, 1, 0, 0, 0], mass)
        bounce(run, body, floor, radius, start, (0.12 * math.cos(angle), 0.12 * math.sin(angle)), mass)


def things(run, floor, blobs):
    """A box that slides, a hammer that turns, a cylinder and a capsule that stand, a pendulum and a spring."""
    box = run.body("crate", "wood", {"kind": "box", "half": [0.07, 0.05, 0.06]}, [-0.6, 0.05, 0.15, 1, 0, 0, 0], 0.6)
    for sample in range(201):
        time = DURATION * sample / 200
        slid = min(time, 1.2)
        run.pose(time, box, (-0.6 + 0.5 * slid - 0.5 * slid * slid / 2.4, 0.05, 0.15), turned((0, 1, 0), 0.3 * slid))
    run.contacts.append((box, floor, 0.0, 1.2, 1, 6.0))
    points = [(-.12, -.02, -.02), (.12, -.02, -.02), (.12, .02, -.02), (-.12, .02, -.02), (-.12, -.02, .02), (.12, -.02, .02), (.12, .02, .02), (-.12, .02, .02)]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7), (0, 1, 5), (0, 5, 4), (2, 3, 7), (2, 7, 6), (1, 2, 6), (1, 6, 5), (0, 4, 7), (0, 7, 3)]
    run.meshes.append({"vertices": 8, "triangles": 12, "blob": blobs.add(b"".join(struct.pack("<3f", *p) for p in points) + b"".join(struct.pack("<3I", *f) for f in faces))})
    bar = run.body("bar", "brass", {"kind": "mesh", "mesh": 0}, [0.55, 0.4, -0.1, 1, 0, 0, 0], 0.4, rings=True)
    for sample in range(301):
        time = DURATION * sample / 300
        run.pose(time, bar, (0.55, 0.4 + 0.02 * math.sin(3 * time), -0.1), turned((0.2, 1, 0.4), 2.5 * time))
    run.body("post", "concrete", {"kind": "cylinder", "radius": 0.06, "height": 0.3, "axis": 1}, [0.45, 0.15, 0.25, 1, 0, 0, 0], None, False)
    run.body("roll", "plastic", {"kind": "capsule", "radius": 0.04, "height": 0.16, "axis": 0}, [-0.35, 0.04, 0.35, *turned((0, 1, 0), 0.5)], 0.2, False)
    bob = run.body("bob", "steel", {"kind": "sphere", "radius": 0.045}, [-0.45, 0.45, -0.3, 1, 0, 0, 0], 1.0)
    weight = run.body("weight", "phenolic", {"kind": "sphere", "radius": 0.045}, [-0.2, 0.5, -0.35, 1, 0, 0, 0], 1.0)
    for sample in range(401):
        time = DURATION * sample / 400
        angle = 0.5 * math.cos(4.4 * time)
        run.pose(time, bob, (-0.45 + 0.5 * math.sin(angle), 0.95 - 0.5 * math.cos(angle), -0.3), turned((0, 0, 1), angle))
        run.pose(time, weight, (-0.2, 0.5 + 0.12 * math.cos(6 * time), -0.35))
    run.links += [{"kind": "rod", "ends": [{"body": bob, "at": [0, 0.045, 0]}, {"body": -1, "at": [-0.45, 0.95, -0.3]}]},
                  {"kind": "spring", "ends": [{"body": weight, "at": [0, 0.045, 0]}, {"body": -1, "at": [-0.2, 0.95, -0.35]}]}]


def jello(run, blobs):
    """A cube of 4 by 4 by 4 points that is sheared to and fro."""
    body = run.body("jello", "jello", {"kind": "unknown"}, [0.15, 0.1, 0.38, 1, 0, 0, 0], 0.5)
    side, size = 4, 0.18
    number = lambda i, j, k: (i * side + j) * side + k
    edges, triangles, cells = [], [], range(side)
    for i in cells:
        for j in cells:
            for k in cells:
                for a, b, c in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
                    if i + a < side and j + b < side and k + c < side:
                        edges.append((number(i, j, k), number(i + a, j + b, k + c)))
    for face in (0, side - 1):
        for j in range(side - 1):
            for k in range(side - 1):
                for pick in (lambda u, v: number(face, u, v), lambda u, v: number(u, face, v), lambda u, v: number(u, v, face)):
                    a, b, c, d = pick(j, k), pick(j + 1, k), pick(j + 1, k + 1), pick(j, k + 1)
                    triangles += [(a, b, c), (a, c, d)]
    pictures = 91
    times = [DURATION * picture / (pictures - 1) for picture in range(pictures)]
    places = bytearray()
    for time in times:
        for i in cells:
            for j in cells:
                for k in cells:
                    high = size * j / (side - 1)
                    lean = 0.35 * math.exp(-0.7 * time) * math.sin(9 * time) * high
                    places += struct.pack("<3f", 0.06 + size * i / (side - 1) + lean, high, 0.3 + size * k / (side - 1))
    data = b"".join(struct.pack("<2I", *e) for e in edges) + b"".join(struct.pack("<3I", *t) for t in triangles)
    data += b"".join(struct.pack("<d", t) for t in times) + bytes(places)
    return {"body": body, "points": side ** 3, "edges": len(edges), "triangles": len(triangles), "pictures": pictures, "blob": blobs.add(data)}


def clatter(run, floor, count):
    """Many events, for the time line alone."""
    for index in range(count):
        time = DURATION * ((index * 0.618034) % 1)
        run.collide(time, 1 + index % 3, floor, 1e-4 * math.exp(-3 * ((index * 0.381966) % 1)), 0.1, (0, 0, 0))


def make_run(label, blobs, arguments, late):
    run = Run()
    floor = run.body("floor", "wood", {"kind": "plane", "normal": [0, 1, 0], "offset": 0}, [0, 0, 0, 1, 0, 0, 0], None, False)
    marbles(run, floor, arguments.marbles)
    lattice = None
    if arguments.marbles < 30:
        things(run, floor, blobs)
        lattice = jello(run, blobs)
    clatter(run, floor, arguments.events)
    shift = lambda time: min(DURATION, math.ceil(time * 60 - 1e-9) / 60) if late else time
    events = sorted((shift(row[0]), *row[1:]) for row in run.events)
    # As Carom writes them: both shares of a collision at one time, one after the other.
    poses = sorted(run.poses, key=lambda row: (row[1], row[0]))
    path = [(DURATION * step / 8, 0.5 * math.sin(step / 4), 0.55, 0.9, *turned((0, 1, 0), step / 8)) for step in range(9)]
    made = {
        "label": label, "stepper": "by hand", "duration": DURATION, "sampleRate": 48000, "gravity": [0, -GRAVITY, 0],
        "description": "Balls of several materials bounce on a floor, a crate slides, a bar of brass turns, one weight hangs on a rod and another on a spring, and a cube of jello wobbles. Made by hand, to try the page.",
        "bodies": run.bodies, "meshes": run.meshes, "links": run.links,
        "listeners": [{"name": "seat", "format": "head", "position": [0.1, 0.5, 1.0], "orientation": [1, 0, 0, 0]},
                      {"name": "walker", "format": "mono", "position": [0, 0.55, 0.9], "orientation": [1, 0, 0, 0], "path": blobs.doubles(path), "poses": len(path)}],
        "room": {"walls": [{"normal": [0, 1, 0], "offset": 0}, {"normal": [0, -1, 0], "offset": -1.4}, {"normal": [1, 0, 0], "offset": -1.2},
                           {"normal": [-1, 0, 0], "offset": -1.2}, {"normal": [0, 0, 1], "offset": -0.9}, {"normal": [0, 0, -1], "offset": -1.3}]},
        "events": {"rows": len(events), "blob": blobs.table(events, "d")},
        "poses": {"rows": len(poses), "blob": blobs.table(poses, "f")},
        "contacts": {"rows": len(run.contacts), "blob": blobs.table(run.contacts, "d")},
    }
    if lattice:
        made["jello"] = lattice
    return made


def make_page(template, arguments):
    """The page, and the manifest in it."""
    blobs = Blobs()
    labels = ["exact", "as Bullet tells it"][:arguments.runs]
    manifest = {"format": 1, "version": "0.0.0", "title": "sample_of_everything",
                "runs": [make_run(label, blobs, arguments, late=index > 0) for index, label in enumerate(labels)]}
    lines = [f'<script type="application/json" id="carom-page">{json.dumps(manifest, separators=(",", ":"))}</script>']
    lines += [f'<script type="application/octet-stream" id="carom-blob-{number}">{text}</script>' for number, text in enumerate(blobs.items)]
    if template.count(LINE) != 1:
        raise SystemExit(f"the template has {template.count(LINE)} lines {LINE}, not one")
    return template.replace(LINE, "\n".join(lines)), manifest


def parser():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--marbles", type=int, default=6)
    options.add_argument("--runs", type=int, default=2)
    options.add_argument("--events", type=int, default=0, help="this many more, for the time line")
    return options


if __name__ == "__main__":
    options = parser()
    options.add_argument("template", type=Path)
    options.add_argument("out", type=Path)
    chosen = options.parse_args()
    page, _ = make_page(chosen.template.read_text(encoding="utf-8"), chosen)
    chosen.out.write_text(page, encoding="utf-8")
    print(f"{chosen.out}: {len(page)} bytes")
