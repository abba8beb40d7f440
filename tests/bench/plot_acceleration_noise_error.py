#!/usr/bin/python3
"""Draws the table of bench_acceleration_noise_error. The table and the figure in docs are made by

  ./bench acceleration_noise_error -- --csv docs/figures/data/acceleration_noise_error.csv
  /usr/bin/python3 tests/bench/plot_acceleration_noise_error.py \\
      docs/figures/data/acceleration_noise_error.csv docs/figures/acceleration_noise_error.png

in the repository's root. Needs matplotlib (Debian: apt-get install python3-matplotlib). The ending
of the second file decides its format: .png, .svg or .pdf.
"""

import argparse
import csv

import plot_style as style
from plot_style import plt

BAR = -80.0  # dB
FLOOR, CEILING = -150.0, 85.0  # dB, of the picture
RATE = 48000.0  # Hz

PULSES = {  # name and colour
    "hertz": ("Hertz", style.BLACK),
    "half_sine": ("half a sine", style.YELLOW),
    "gaussian": ("Gaussian", style.BLUE),
    "mitchell_netravali": ("Mitchell and Netravali", style.GREEN),
    "course_gaussian": ("course Gaussian", style.ORANGE),
    "dissipative_hertz": ("dissipative Hertz, restitution 0.5", style.PURPLE),
}
DURATIONS = {1e-6: "1 µs", 1e-5: "10 µs", 1e-4: "100 µs", 1e-3: "1 ms", 1e-2: "10 ms", 0.1: "100 ms"}
OFFSETS = {  # where durations stand beside the points of a sampling, of shorter and of longer contacts
    ("band_limited", True): ((4, -13), "center"), ("band_limited", False): ((0, 7), "center"),
    ("naive", True): ((8, -1), "left"), ("naive", False): ((-8, -3), "right"),
}
COSTS = {1e2: "0.1", 1e3: "1", 1e4: "10", 1e5: "100", 1e6: "1000"}


def read(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in ("sample_rate_hz", "duration_s", "worst_error_db", "cost_ns"):
            row[name] = float(row[name])
    return [row for row in rows if row["sample_rate_hz"] == RATE]


def series(rows, **wanted):
    found = [row for row in rows if all(row[name] == value for name, value in wanted.items())]
    return sorted(found, key=lambda row: row["duration_s"])


def draw_durations(axes, rows, radiation, title):
    """All band-limited pulses as one band from the best to the worst; each naive one by itself."""
    limited = [series(rows, pulse=pulse, sampling="band_limited", radiation=radiation) for pulse in PULSES]
    durations = [row["duration_s"] for row in limited[0]]
    errors = [[row["worst_error_db"] for row in rows] for rows in limited]
    worst, best = [max(some) for some in zip(*errors)], [min(some) for some in zip(*errors)]
    axes.fill_between(durations, best, worst, color=style.SKY, alpha=0.55, linewidth=0)
    axes.plot(durations, worst, color=style.BLUE, linewidth=1.2)
    axes.text(1e-6, -113, "band-limited, all six", color=style.BLUE, fontsize=9.5, va="center")
    for pulse, (name, colour) in PULSES.items():
        found = series(rows, pulse=pulse, sampling="naive", radiation=radiation)
        axes.plot([row["duration_s"] for row in found], [row["worst_error_db"] for row in found], color=colour, marker="o", markersize=4,
                  linewidth=1.4, label=name)
    axes.set_title(title)
    axes.set_xlabel("duration of the contact")
    set_scale(axes, DURATIONS, 0.8e-6, 0.125)
    axes.axvline(1.0 / RATE, color="0.6", linewidth=0.8, zorder=0)
    axes.text(1.1 / RATE, CEILING - 4, "one sample", color="0.4", fontsize=9, va="top")


def draw_costs(axes, rows):
    for sampling, name, colour in (("naive", "naive", style.BLACK), ("band_limited", "band-limited", style.BLUE)):
        found = series(rows, pulse="hertz", sampling=sampling, radiation="exact")
        curve = [(row["cost_ns"], row["worst_error_db"]) for row in found]
        axes.plot(*zip(*curve), color=colour, marker="o", markersize=4.5, linewidth=1.4)
        axes.text(*({"naive": (900, 40), "band_limited": (2500, -110)}[sampling]), name + " sampling", color=colour)
        for row in found:
            if row["duration_s"] in DURATIONS and is_apart(sampling, row["duration_s"]):
                offset, side = OFFSETS[sampling, row["duration_s"] < 5e-3]
                axes.annotate(DURATIONS[row["duration_s"]], (row["cost_ns"], row["worst_error_db"]), offset, textcoords="offset points", fontsize=9,
                              color=colour, ha=side)
    axes.set_title("Error against run time: Hertz, exact radiation")
    axes.set_xlabel("processor time of a click in microseconds")
    set_scale(axes, COSTS, 1.5e2, 2e6)


def is_apart(sampling, duration):
    """Short contacts cost the same, so that band-limited ones, which are as exact, lie upon each other."""
    return duration < 0.05 if sampling == "naive" else duration > 5e-4


def set_scale(axes, ticks, low, high):
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    style.log_ticks(axes.xaxis, ticks, lambda value: min(ticks.items(), key=lambda tick: abs(tick[0] / value - 1))[1])
    axes.axhline(BAR, color=style.SOFT, linewidth=1.6, zorder=1)
    side = 0.01 if ticks is DURATIONS else 0.99
    axes.text(side, BAR + 2.5, f"wanted: < {style.plain(BAR)} dB", color=style.SOFT, fontsize=9, transform=axes.get_yaxis_transform(),
              ha="left" if side < 0.5 else "right")
    style.tidy(axes)


def draw(rows):
    figure, (exact, compact, costs) = plt.subplots(1, 3, sharey=True, figsize=(13.2, 5.6))
    draw_durations(exact, rows, "exact", "Exact radiation")
    draw_durations(compact, rows, "compact", "Compact radiation")
    draw_costs(costs, rows)
    exact.set_ylim(FLOOR, CEILING)
    exact.set_ylabel("worst error in the band in dB")
    exact.set_yticks([-120, BAR, -40, 0, 40, 80], [style.plain(level) for level in (-120, BAR, -40, 0, 40, 80)])
    figure.subplots_adjust(left=0.065, right=0.985, top=0.93, bottom=0.2, wspace=0.12)
    handles, names = exact.get_legend_handles_labels()
    figure.text(0.065, 0.035, "naive sampling of", fontsize=10.5)
    figure.legend(handles, names, ncol=6, loc="lower left", bbox_to_anchor=(0.17, 0.015), fontsize=10, columnspacing=1.4, handlelength=1.8)
    return figure


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("csv", help="what bench_acceleration_noise_error --csv wrote")
    parser.add_argument("figure", help="the file to be written")
    arguments = parser.parse_args()
    style.save(draw(read(arguments.csv)), arguments.figure)


if __name__ == "__main__":
    main()
