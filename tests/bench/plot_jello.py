#!/usr/bin/python3
"""Draws docs/figures/jello_costs.png and jello_limits.png from the tables of bench_jello_accuracy:

    build/release/tests/bench/bench_jello_accuracy >docs/figures/data/jello_accuracy.txt
    /usr/bin/python3 tests/bench/plot_jello.py docs/figures/data/jello_accuracy.txt docs/figures

in the repository's root. Needs matplotlib.
"""

import sys
from pathlib import Path

import plot_style as style
from plot_style import plt

NAMES = ["explicit_euler", "symplectic_euler", "midpoint", "rk4", "backward_euler", "leapfrog"]
COLOURS = dict(zip(NAMES, [style.ORANGE, style.BLUE, style.YELLOW, style.GREEN, style.PURPLE, style.BLACK]))
WORDS = {name: name.replace("_", " ").replace("euler", "Euler").replace("rk4", "Runge-Kutta 4") for name in NAMES}
MARKERS = dict(zip(NAMES, "v^soPD"))
DAMPINGS = {"0.0": ("no damping", style.BLUE), "0.2": ("weak damping: d w / k = 0.2", style.GREEN), "3.0": ("strong damping: d w / k = 3", style.ORANGE)}
UNDAMPED = 2.0  # symplectic Euler's limit of w h without damping, by theory: it tells w for each stiffness
REASONS = {"never": "grows at any step", "any": "stable at any step"}


def sections(text):
    """First line of each part, and the lines after it."""
    for part in text.split("\n\n"):
        lines = part.strip().splitlines()
        yield lines[0], lines[1:]


def draw_costs(lines, path):
    figure, axes = plt.subplots(figsize=(8.4, 5.2), layout="constrained")
    axes.set_xscale("log")
    axes.set_yscale("log")
    ends, curves = [], []
    for name in NAMES:
        rows = [line.split() for line in lines if line.startswith(name + " ")]
        points = [(float(r[2]), float(r[3])) for r in rows if r[2] != "-"]
        axes.plot(*zip(*points), color=COLOURS[name], marker=MARKERS[name], markersize=5.5, linewidth=1.5)
        curves.append(points)
        ends.append((*points[-1], WORDS[name], COLOURS[name]))
    times, errors = zip(*[point for curve in curves for point in curve])
    axes.set_xlim(min(times) / 1.5, max(times) * 3)
    axes.set_ylim(min(errors) / 4, max(errors) * 4)
    axes.set_xlabel("processor time in seconds for 0.2 s of 8 x 8 x 8 points")
    axes.set_ylabel("error of places in metres (root mean square)")
    style.log_ticks(axes.xaxis, [tick for tick in (1e-3, 0.01, 0.1, 1, 10) if min(times) / 1.5 < tick < max(times) * 3])
    style.log_ticks(axes.yaxis, [10.0**power for power in range(-11, 0, 2)], style.power_of_ten)
    style.tidy(axes)
    style.label_points(axes, ends, curves, fontsize=10.5)
    style.save(figure, path)


def limits(rows, which):
    """Predicted and found steps in ms for each stiffness; instead of them the reason why there are none."""
    chosen = [(r[2 + 2 * which], r[3 + 2 * which]) for r in rows]
    if chosen[0][0] in REASONS:
        return None, REASONS[chosen[0][0]]
    return [(float(predicted), float(found)) for predicted, found in chosen], ""


def draw_limits(lines, path):
    figure, axes = plt.subplots(figsize=(8.4, 6.2), layout="constrained")
    axes.set_xscale("log")
    rows = [line.split() for line in lines[1:] if line[:1].isdigit()]
    undamped = [r for r in rows if r[0] == "0.0"]
    frequency = [UNDAMPED / float(r[4]) for r in undamped]  # of each stiffness, in 1 / ms
    for line, name in enumerate(NAMES):
        for row, (ratio, (_, colour)) in enumerate(DAMPINGS.items()):
            place = line + 0.26 * (row - 1)
            found, reason = limits([r for r in rows if r[0] == ratio], line)
            if found is None:
                axes.text(0.11, place, reason, color=colour, va="center", fontsize=9.5)
                continue
            products = [(w * predicted, w * seen) for w, (predicted, seen) in zip(frequency, found)]
            axes.plot([products[0][0]] * 2, [place - 0.11, place + 0.11], color=colour, linewidth=2)
            axes.plot([seen for _, seen in products], [place] * len(products), "o", color=colour, markersize=5, alpha=0.8)
            axes.text(products[0][0] * 1.07, place, f"{products[0][0]:.2f}", color=colour, va="center", fontsize=9.5)
    axes.set_yticks(range(len(NAMES)), [WORDS[name] for name in NAMES])
    axes.tick_params(axis="y", length=0, labelcolor=style.INK)
    axes.set_ylim(len(NAMES) - 0.5, -0.5)
    axes.set_xlim(0.1, 5)
    style.log_ticks(axes.xaxis, [0.1, 0.2, 0.5, 1, 2, 5])
    axes.set_xlabel("largest stable step h, times the highest angular frequency w of the jello")
    for line in range(1, len(NAMES)):
        axes.axhline(line - 0.5, color=style.FAINT, linewidth=0.8)
    shown = [plt.Line2D([], [], color=colour, marker="o", linestyle="", label=name) for name, colour in DAMPINGS.values()]
    shown += [plt.Line2D([], [], color=style.SOFT, marker="|", linestyle="", markersize=10, markeredgewidth=2, label="predicted"),
              plt.Line2D([], [], color=style.SOFT, marker="o", linestyle="", label="found, for k from 1 to 1,000,000 N/m:\nseven points, one upon the other")]
    axes.legend(handles=shown, ncol=2, loc="lower left", bbox_to_anchor=(-0.02, 1.0), alignment="left", fontsize=9.5, columnspacing=4,
                title="Springs of stiffness k and damping d")
    style.tidy(axes, grid="x")
    style.save(figure, path)


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    folder = Path(sys.argv[2])
    for title, lines in sections(Path(sys.argv[1]).read_text(encoding="utf-8")):
        if title.startswith("error against run time"):
            draw_costs(lines, folder / "jello_costs.png")
        if title.startswith("largest stable step"):
            draw_limits(lines, folder / "jello_limits.png")


if __name__ == "__main__":
    main()
