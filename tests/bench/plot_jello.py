"""Draws docs/figures/jello_costs.png and jello_limits.png from the table of bench_jello_accuracy.

    python3 tests/bench/plot_jello.py build/release/tests/bench/bench_jello_accuracy docs/figures

Needs matplotlib.
"""

import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

NAMES = ["explicit_euler", "symplectic_euler", "midpoint", "rk4", "backward_euler", "leapfrog"]
COLOURS = dict(zip(NAMES, ["#c44e52", "#4c72b0", "#dd8452", "#55a868", "#8172b3"]))


def sections(text):
    """First line of each part, and the lines after it."""
    for part in text.split("\n\n"):
        lines = part.strip().splitlines()
        yield lines[0], lines[1:]


def draw_costs(lines, path):
    figure, axes = plt.subplots(figsize=(7, 4.5), dpi=110)
    for name in NAMES:
        rows = [line.split() for line in lines if line.startswith(name + " ")]
        points = [(float(r[2]), float(r[3])) for r in rows if r[2] != "-"]
        axes.loglog(*zip(*points), "o-", color=COLOURS[name], label=name, markersize=4)
    axes.set_xlabel("processor time for 0.2 s of 8 x 8 x 8 points, s")
    axes.set_ylabel("error, m (rms)")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path)


def draw_limits(lines, path):
    figure, axes = plt.subplots(figsize=(7, 4.5), dpi=110)
    rows = [line.split() for line in lines[1:] if line[:1].isdigit()]
    for ratio, style in [("0.0", "-"), ("0.2", "--"), ("3.0", ":")]:
        chosen = [r for r in rows if r[0] == ratio]
        for which, name in enumerate(NAMES[:4]):
            points = [
                (float(r[1]), float(r[2 + 2 * which]), float(r[3 + 2 * which]))
                for r in chosen
                if r[2 + 2 * which] not in ("never", "any")
            ]
            if not points:
                continue
            k, predicted, found = zip(*points)
            axes.loglog(k, predicted, style, color=COLOURS[name], linewidth=1)
            axes.loglog(k, found, "o", color=COLOURS[name], markersize=3)
    for name in NAMES[:4]:
        axes.plot([], [], color=COLOURS[name], label=name)
    for ratio, style in [("no damping", "-"), ("d w / k = 0.2", "--"), ("d w / k = 3", ":")]:
        axes.plot([], [], style, color="black", linewidth=1, label=ratio)
    axes.plot([], [], "o", color="black", markersize=3, label="found")
    axes.set_xlabel("stiffness of a spring, N/m (4 x 4 x 4 points, 1 kg)")
    axes.set_ylabel("largest stable step, ms")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=8)
    figure.tight_layout()
    figure.savefig(path)


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    text = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    print(text, end="")
    for title, lines in sections(text):
        if title.startswith("error against run time"):
            draw_costs(lines, folder / "jello_costs.png")
        if title.startswith("largest stable step"):
            draw_limits(lines, folder / "jello_limits.png")


if __name__ == "__main__":
    main()
