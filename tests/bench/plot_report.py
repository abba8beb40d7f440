#!/usr/bin/python3
"""Draws error against run time of each scene of a report, as its page does, with the fastest and most exact variants by name.

    /usr/bin/python3 tests/bench/plot_report.py docs/report/report.json docs/figures

in the repository's root writes docs/figures/report_SCENE.png for each scene. Needs matplotlib.
"""

import json
import pathlib
import sys
import textwrap

import plot_style as style
from plot_style import plt

GROUPS = {  # colour and marker, as close to the page's as the palette has them
    "mechanics": (style.BLUE, "o"), "sound": (style.ORANGE, "s"), "modes": (style.GREEN, "^"), "jello": (style.PURPLE, "D"), "presets": (style.YELLOW, "X"),
}
PREFIXES = [(1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns")]


def points(scene):
    """(variant, run time in s, error) of whatever has both, and the run time of the reference."""
    found, reference = [], None
    for variant in scene["variants"]:
        time, error = variant["run_time"]["total"], variant["waveform_error"]
        if variant["id"] == scene["reference"]:
            reference = time
        elif time and error:
            found.append((variant, time, error))
    return found, reference


def exact_times(scene):
    """Run times of variants without any error: the reference, and those with its very sound."""
    return [v["run_time"]["total"] for v in scene["variants"] if v["id"] == scene["reference"] or v["waveform_error"] == 0]


def front_of(found, exact):
    """The points that no other beats in both, from the fastest to the most exact."""
    def beaten(time, error):
        better = any(t <= time and e <= error and (t, e) != (time, error) for _, t, e in found)
        return better or any(t <= time for t in exact)
    return sorted((point for point in found if not beaten(*point[1:])), key=lambda point: point[1])


def seconds(value, _=None):
    scale, unit = next(((scale, unit) for scale, unit in PREFIXES if value >= 0.9995 * scale), PREFIXES[-1])
    return f"{value / scale:.3g} {unit}"


def percent(value, _=None):
    return f"{100 * value:.3g} %"


def ticks(low, high, every):
    return [m * 10.0**power for power in range(-9, 4) for m in every if low < m * 10.0**power < high]


def key(front):
    lines = []
    for number, (variant, time, error) in enumerate(front, 1):
        lines += [f"{number}  {line}" if i == 0 else f"    {line}" for i, line in enumerate(textwrap.wrap(variant["label"], 31))]
        lines += [f"    {seconds(time)}, {percent(error)}", ""]
    return "\n".join(lines)


def draw(scene):
    found, reference = points(scene)
    exact = exact_times(scene)
    front = front_of(found, exact)
    figure = plt.figure(figsize=(9.4, 5.2))
    axes = figure.add_axes([0.09, 0.115, 0.585, 0.79])
    axes.set_xscale("log")
    axes.set_yscale("log")
    times = [time for _, time, _ in found] + [reference]
    errors = [error for _, _, error in found]
    low, high, least, most = min(times) / 1.7, max(times) * 1.7, min(errors) / 2.2, max(errors) * 2.2
    axes.set_xlim(low, high)
    axes.set_ylim(least, most)
    for group, (colour, marker) in GROUPS.items():
        chosen = [(time, error) for variant, time, error in found if variant["group"] == group]
        if chosen:
            axes.plot(*zip(*chosen), marker, color=colour, markersize=7, markeredgecolor="white", markeredgewidth=0.6, label=group)
    draw_front(axes, front, exact, (low, high, least, most))
    for time, text in ((reference, "reference"), (1.0, "real time")):
        if low < time < high:
            axes.axvline(time, color=style.SOFT, linestyle="--" if text == "reference" else ":", linewidth=1.2, zorder=1)
            axes.annotate(text, (time, most), (0, 4), textcoords="offset points", ha="center", color=style.SOFT, annotation_clip=False)
    decades = [1] if high / low > 3e3 else [1, 2, 5] if high / low < 60 else [1, 3]
    style.log_ticks(axes.xaxis, ticks(low, high, decades), seconds)
    style.log_ticks(axes.yaxis, ticks(least, most, [1]), percent)
    axes.set_xlabel("run time for a second of the scene")
    axes.set_ylabel("error of the waveform")
    axes.legend(title="what is changed", loc="lower left", alignment="left", fontsize=9.5)
    figure.text(0.012, 0.985, scene["name"].replace("_", " ").replace("newtons", "Newton's"), va="top", fontsize=13, weight="bold")
    style.tidy(axes)
    curves = [[(time, error), (time * 1.0001, error)] for _, time, error in found]
    curves += [list(zip(*path)) for path in [front_path(front, exact, (low, high, least, most))] if path[0]]
    style.label_points(axes, [(time, error, str(i), style.INK) for i, (_, time, error) in enumerate(front, 1)], curves, fontsize=11)
    figure.text(0.70, 0.905, "Best for their run time", va="top", fontsize=10.5, weight="bold")
    figure.text(0.70, 0.855, key(front), va="top", fontsize=9.5, linespacing=1.35)
    return figure


def front_path(front, exact, ends):
    """The stepped line through the front: down from above, and to where an exact variant takes over."""
    if not front:
        return [], []
    _, high, least, most = ends
    xs, ys = [front[0][1]], [most]
    for (_, time, error) in front:
        xs += [time, time]
        ys += [ys[-1], error]
    end = min([time for time in exact], default=high)
    return xs + [end, end], ys + [ys[-1], least]


def draw_front(axes, front, exact, ends):
    xs, ys = front_path(front, exact, ends)
    axes.plot(xs, ys, color=style.SOFT, linewidth=1.3, zorder=1.5)


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    for scene in report["scenes"]:
        style.save(draw(scene), pathlib.Path(sys.argv[2]) / f"report_{scene['name']}.png")


if __name__ == "__main__":
    main()
