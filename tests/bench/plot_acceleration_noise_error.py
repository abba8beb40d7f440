#!/usr/bin/python3
"""Draws the table of bench_acceleration_noise_error. The table and the figure in docs are made by

  ./bench acceleration_noise_error -- --csv build/acceleration_noise_error.csv
  /usr/bin/python3 tests/bench/plot_acceleration_noise_error.py \\
      build/acceleration_noise_error.csv docs/figures/acceleration_noise_error.png

in the repository's root. Needs matplotlib (Debian: apt-get install python3-matplotlib). The ending
of the second file decides its format: .png, .svg or .pdf.
"""

import argparse
import csv
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedFormatter, FixedLocator, NullLocator

BAR = -80.0  # dB
FLOOR = -160.0  # dB: what is lower is drawn here
CEILING = 85.0  # dB
RATE = 48000.0  # Hz

# Okabe and Ito's palette, which the colour-blind tell apart.
PULSES = {
    "hertz": ("Hertz", "#000000", "o"),
    "half_sine": ("half-sine", "#E69F00", "s"),
    "gaussian": ("Gaussian", "#0072B2", "^"),
    "mitchell_netravali": ("Mitchell-Netravali", "#009E73", "D"),
    "course_gaussian": ("hand-out's Gaussian", "#D55E00", "v"),
    "dissipative_hertz": ("dissipative Hertz, e = 0.5", "#CC79A7", "P"),
}
RADIATIONS = {"exact": "-", "compact": "--"}
DURATIONS = {1e-6: "1 µs", 1e-5: "10 µs", 1e-4: "100 µs", 1e-3: "1 ms", 1e-2: "10 ms", 0.1: "100 ms"}
COSTS = {1e2: "0.1", 1e3: "1", 1e4: "10", 1e5: "100", 1e6: "1000"}


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in ("sample_rate_hz", "duration_s", "worst_error_db", "cost_ns"):
            row[name] = float(row[name])
        row["shown_db"] = max(row["worst_error_db"], FLOOR)
    return [row for row in rows if row["sample_rate_hz"] == RATE]


def series(rows, **wanted):
    found = [row for row in rows if all(row[name] == value for name, value in wanted.items())]
    return sorted(found, key=lambda row: row["duration_s"])


def draw_line(axes, x, rows, pulse, style, is_filled):
    _, colour, marker = PULSES[pulse]
    axes.plot(
        [row[x] for row in rows],
        [row["shown_db"] for row in rows],
        linestyle=style,
        color=colour,
        marker=marker,
        markerfacecolor=colour if is_filled else "white",
        markersize=4.5,
        linewidth=1.2,
        clip_on=False,
    )


def draw_durations(axes, rows, sampling, title):
    for pulse in PULSES:
        for radiation, style in RADIATIONS.items():
            found = series(rows, pulse=pulse, sampling=sampling, radiation=radiation)
            draw_line(axes, "duration_s", found, pulse, style, radiation == "exact")
    axes.set_title(title, fontsize=11)
    axes.set_xlabel("contact duration")
    set_scale(axes, DURATIONS, 0.7e-6, 0.15)
    sample = 1.0 / RATE
    axes.axvline(sample, color="0.6", linewidth=0.8, zorder=0)


def draw_costs(axes, rows):
    for pulse in PULSES:
        for sampling in ("band_limited", "naive"):
            found = series(rows, pulse=pulse, sampling=sampling, radiation="exact")
            draw_line(axes, "cost_ns", found, pulse, "", sampling == "band_limited")
    for sampling, style in (("band_limited", "-"), ("naive", ":")):
        found = series(rows, pulse="hertz", sampling=sampling, radiation="exact")
        draw_line(axes, "cost_ns", found, "hertz", style, sampling == "band_limited")
    label_durations(axes, rows)
    axes.set_title("Error against run time, exact radiation", fontsize=11)
    axes.set_xlabel("CPU time per click, µs")
    set_scale(axes, COSTS, 2e2, 2e6)


def set_scale(axes, ticks, low, high):
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.xaxis.set_major_locator(FixedLocator(list(ticks)))
    axes.xaxis.set_major_formatter(FixedFormatter(list(ticks.values())))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.axhline(BAR, color="0.35", linewidth=1.6, zorder=1)
    axes.grid(color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def label_durations(axes, rows):
    for row in series(rows, pulse="hertz", sampling="band_limited", radiation="exact"):
        if row["duration_s"] > 0.5e-3:
            name = DURATIONS[row["duration_s"]]
            place = (row["cost_ns"], row["shown_db"])
            axes.annotate(name, place, (0, 7), textcoords="offset points", fontsize=8.5)
    for row in series(rows, pulse="hertz", sampling="naive", radiation="exact"):
        if row["duration_s"] in (1e-6, 1e-5, 1e-4, 1e-3):
            name = DURATIONS[row["duration_s"]]
            place = (row["cost_ns"], row["shown_db"])
            axes.annotate(name, place, (9, 0), textcoords="offset points", fontsize=8.5, va="center")


def level_text(level):
    text = f"{level:.0f}".replace("-", "\N{MINUS SIGN}")
    return f"\N{LESS-THAN OR EQUAL TO} {text}" if level == FLOOR else text


def add_legends(figure):
    def line(label, colour="0.2", **how):
        return Line2D([], [], label=label, color=colour, markersize=5, linewidth=1.2, **how)

    pulses = [line(name, colour, marker=marker) for name, colour, marker in PULSES.values()]
    kinds = [
        line("exact radiation", linestyle="-", marker="o"),
        line("compact radiation", linestyle="--", marker="o", markerfacecolor="white"),
    ]
    samplings = [
        line("band-limited", linestyle="-", marker="o"),
        line("naive", linestyle=":", marker="o", markerfacecolor="white"),
    ]
    style = {"loc": "lower center", "frameon": False, "fontsize": 9, "handlelength": 2.6}
    figure.legend(handles=pulses, ncol=6, bbox_to_anchor=(0.5, 0.052), columnspacing=1.6, **style)
    figure.legend(handles=kinds, ncol=2, bbox_to_anchor=(0.365, 0.0), **style)
    figure.legend(handles=samplings, ncol=2, bbox_to_anchor=(0.845, 0.0), **style)


def draw(rows):
    plt.rcParams.update({"font.family": "DejaVu Sans", "font.size": 9.5})
    figure, (limited, naive, costs) = plt.subplots(1, 3, sharey=True, figsize=(12.5, 5.0))
    draw_durations(limited, rows, "band_limited", "Band-limited sampling")
    draw_durations(naive, rows, "naive", "Naive sampling")
    draw_costs(costs, rows)
    limited.set_ylim(FLOOR, CEILING)
    limited.set_ylabel("worst error in the band, dB")
    limited.yaxis.set_major_locator(FixedLocator([FLOOR, -120, BAR, -40, 0, 40, 80]))
    limited.yaxis.set_major_formatter(lambda level, _: level_text(level))
    limited.text(0.8e-6, BAR + 3, "bar, \N{MINUS SIGN}80 dB", color="0.25", fontsize=9)
    limited.text(1.1 / RATE, CEILING - 8, "one sample", color="0.4", fontsize=9)
    figure.subplots_adjust(left=0.073, right=0.985, top=0.93, bottom=0.235, wspace=0.08)
    add_legends(figure)
    return figure


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("csv", help="what bench_acceleration_noise_error --csv wrote")
    parser.add_argument("figure", help="the file to be written")
    arguments = parser.parse_args()
    pathlib.Path(arguments.figure).parent.mkdir(parents=True, exist_ok=True)
    draw(read(arguments.csv)).savefig(arguments.figure, dpi=100)


if __name__ == "__main__":
    main()
