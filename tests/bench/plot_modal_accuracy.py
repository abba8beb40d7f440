#!/usr/bin/python3
"""Draws the table of bench_modal_accuracy. The table and the figure in docs are made by

  ./bench modal_accuracy -- --csv build/modal_accuracy.csv
  /usr/bin/python3 tests/bench/plot_modal_accuracy.py build/modal_accuracy.csv docs/figures/modal_accuracy.png

in the repository's root. Needs matplotlib (Debian: apt-get install python3-matplotlib). The ending
of the second file decides its format: .png, .svg or .pdf.
"""

import argparse
import csv
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

BAR = 1.0  # %

# Okabe and Ito's palette, which the colour-blind tell apart; where the numbers stand.
BODIES = {
    "beam": ("beam, Timoshenko", "#0072B2", "o", (-6, -10), "right"),
    "plate": ("plate, Leissa", "#D55E00", "s", (-6, -10), "right"),
    "sphere": ("sphere, Lamb", "#009E73", "^", (3, -13), "left"),
    "brick": ("brick, elasticity by Ritz's method", "#000000", "D", (6, 4), "left"),
}


def read(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def draw_body(axes, rows, body):
    name, colour, marker, offset, side = BODIES[body]
    found = [row for row in rows if row["body"] == body]
    times = [float(row["cpu_s"]) for row in found]
    errors = [100.0 * abs(float(row["worst_error"])) for row in found]
    axes.plot(times, errors, color=colour, marker=marker, markersize=5, linewidth=1.3, label=name)
    for row, time, error in zip(found, times, errors):
        text = f"{float(row['degrees_of_freedom']) / 1000:.2g}k"
        axes.annotate(
            text, (time, error), offset, textcoords="offset points", fontsize=7.5, ha=side, color=colour
        )


def draw(rows):
    plt.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9.5})
    figure, axes = plt.subplots(figsize=(7.6, 5.0))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.08)
    axes.axhline(BAR, color="0.35", linewidth=1.6, zorder=1)
    for body in BODIES:
        draw_body(axes, rows, body)
    axes.set_xlabel("CPU time of the analysis, s (one thread)")
    axes.set_ylabel("worst error of the first 10 frequencies, %")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.text(0.99, BAR * 1.06, "bar, 1 %", color="0.25", transform=axes.get_yaxis_transform(), ha="right")
    axes.grid(color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    axes.legend(frameon=False, title="numbers: degrees of freedom", loc="upper right")
    figure.tight_layout()
    return figure


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("csv", help="what bench_modal_accuracy --csv wrote")
    parser.add_argument("figure", help="the file to be written")
    arguments = parser.parse_args()
    pathlib.Path(arguments.figure).parent.mkdir(parents=True, exist_ok=True)
    draw(read(arguments.csv)).savefig(arguments.figure, dpi=110)


if __name__ == "__main__":
    main()
