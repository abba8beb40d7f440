#!/usr/bin/python3
"""Draws the table of bench_modal_accuracy. The table and the figure in docs are made by

  ./bench modal_accuracy -- --csv docs/figures/data/modal_accuracy.csv
  /usr/bin/python3 tests/bench/plot_modal_accuracy.py docs/figures/data/modal_accuracy.csv docs/figures/modal_accuracy.png

in the repository's root. Needs matplotlib (Debian: apt-get install python3-matplotlib). The ending
of the second file decides its format: .png, .svg or .pdf.
"""

import argparse
import csv

import plot_style as style
from plot_style import plt

BAR = 1.0  # %

BODIES = {
    "beam": ("beam, beside Timoshenko's theory", style.BLUE, "o"),
    "plate": ("thin plate, beside Leissa's theory", style.ORANGE, "s"),
    "sphere": ("sphere, beside Lamb's solution", style.GREEN, "^"),
    "brick": ("brick, beside three-dimensional elasticity", style.BLACK, "D"),
}


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def points(rows, body):
    """CPU time, error in percent and degrees of freedom of each grid of a body."""
    return [(float(row["cpu_s"]), 100.0 * abs(float(row["worst_error"])), int(row["degrees_of_freedom"])) for row in rows if row["body"] == body]


def draw(rows):
    figure, axes = plt.subplots(figsize=(8.4, 5.6), layout="constrained")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.axhline(BAR, color=style.SOFT, linewidth=1.6, zorder=1)
    labels, curves = [], []
    for body, (name, colour, marker) in BODIES.items():
        found = points(rows, body)
        curve = [(time, error) for time, error, _ in found]
        axes.plot(*zip(*curve), color=colour, marker=marker, markersize=5.5, linewidth=1.5, label=name)
        curves.append(curve)
        labels += [(time, error, style.short(count), colour) for time, error, count in found]
    axes.set_xlabel("processor time of the analysis in seconds (one thread)")
    axes.set_ylabel("worst error of the first ten frequencies in percent")
    axes.set_xlim(0.03, 45)
    axes.set_ylim(2e-5, 300)
    style.log_ticks(axes.xaxis, [0.1, 1, 10])
    style.log_ticks(axes.yaxis, [1e-4, 1e-3, 0.01, 0.1, 1, 10, 100])
    axes.text(0.995, BAR * 1.12, "wanted: below 1 %", color=style.SOFT, transform=axes.get_yaxis_transform(), ha="right")
    style.tidy(axes)
    axes.legend(title="numbers beside the points: degrees of freedom", loc="lower left", alignment="left", borderaxespad=0.8)
    style.label_points(axes, labels, curves)
    return figure


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("csv", help="what bench_modal_accuracy --csv wrote")
    parser.add_argument("figure", help="the file to be written")
    arguments = parser.parse_args()
    style.save(draw(read(arguments.csv)), arguments.figure)


if __name__ == "__main__":
    main()
