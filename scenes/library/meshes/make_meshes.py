#!/usr/bin/env python3
"""Writes the meshes of the library's scenes: closed surfaces, in metres, y up.

    python3 scenes/library/meshes/make_meshes.py
"""
import math
import pathlib


def write(name, vertices, faces):
    lines = [f"# made by make_meshes.py\n"]
    lines += ["v " + " ".join(f"{x:.6f}" for x in vertex) + "\n" for vertex in vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) + "\n" for face in faces]
    (pathlib.Path(__file__).parent / name).write_text("".join(lines))


def revolved(profile, segments):
    """A closed profile (radius, height), counter-clockwise with the axis at its left, about y.
    Points on the axis become one vertex."""
    vertices, rings = [], []
    for radius, height in profile:
        if radius == 0.0:
            rings.append([len(vertices)] * segments)
            vertices.append((0.0, height, 0.0))
            continue
        rings.append(list(range(len(vertices), len(vertices) + segments)))
        for k in range(segments):
            angle = 2.0 * math.pi * k / segments
            vertices.append((radius * math.cos(angle), height, -radius * math.sin(angle)))
    faces = []
    for lower, upper in zip(rings, rings[1:]):
        for k in range(segments):
            n = (k + 1) % segments
            face = [lower[k], lower[n], upper[n], upper[k]]
            face = [v for i, v in enumerate(face) if v != face[i - 1]]
            if len(face) > 2:
                faces.append(face)
    return vertices, faces


def extruded(outline, thickness):
    """A polygon in x, z, counter-clockwise seen from above, as a plate about y = 0."""
    n = len(outline)
    vertices = [(x, -thickness / 2, -z) for x, z in outline] + [(x, thickness / 2, -z) for x, z in outline]
    faces = [list(range(n - 1, -1, -1)), list(range(n, 2 * n))]
    faces += [[k, (k + 1) % n, n + (k + 1) % n, n + k] for k in range(n)]
    return vertices, faces


def arc(x, z, radius, begin, end, count):
    return [(x + radius * math.cos(math.radians(begin + (end - begin) * k / count)),
             z + radius * math.sin(math.radians(begin + (end - begin) * k / count)))
            for k in range(count + 1)]


# A tumbler: 3 mm of wall, 8 mm of base.
write("tumbler.obj", *revolved(
    [(0.0, 0.0), (0.030, 0.0), (0.0312, 0.020), (0.0324, 0.040), (0.0336, 0.060), (0.0348, 0.080),
     (0.036, 0.100), (0.033, 0.100), (0.0318, 0.080), (0.0306, 0.060), (0.0294, 0.040), (0.0282, 0.020),
     (0.0275, 0.008), (0.0, 0.008)], 48))

# A dinner plate, 5 mm thick, with a rim.
write("plate.obj", *revolved(
    [(0.0, 0.0), (0.04, 0.0), (0.08, 0.0), (0.10, 0.008), (0.13, 0.018), (0.1285, 0.0228), (0.098, 0.0128),
     (0.079, 0.005), (0.04, 0.005), (0.0, 0.005)], 64))

# An open-ended wrench, 0.18 m long, 6 mm thick: a handle between two jaws.
def wrench():
    half = 0.18 / 2
    right = arc(half - 0.018, 0.0, 0.018, -150, -35, 8) + [(half - 0.014, -0.0065), (half - 0.014, 0.0065)] \
        + arc(half - 0.018, 0.0, 0.018, 35, 150, 8)
    left = [(-x * 1.0, -z) for x, z in right]
    return right + left


write("wrench.obj", *extruded(wrench(), 0.006))
