#!/usr/bin/env python3
"""Draws the cost of sound over ordinary worlds, from a full run of ./bench.

    python3 tests/bench/plot_worlds.py tests/bench/baseline.json docs/figures/worlds.png

Needs matplotlib.
"""

import json
import sys

import plot_style as style
from plot_style import plt

RATE = "60"
BAR = 60.0  # %, of everything


def shares(path):
    """Of each world at RATE: ms of Bullet in a second, % of the bridge, % of everything."""
    with open(path, encoding="utf-8") as file:
        figures = json.load(file)["benchmarks"]["worlds"]["figures"]
    worlds = {}
    for figure in figures:
        world, rate, name = figure["name"].split(".")
        if rate == RATE:
            worlds.setdefault(world, {})[name] = figure["value"]
    return {world: (all["bullet_ms_per_s"], all["bridge_percent"], all["all_percent"])
            for world, all in worlds.items()}


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    worlds = sorted(shares(sys.argv[1]).items(), key=lambda world: world[1][2])
    names = [f"{name.replace('_', ' ')}, {bullet:.0f} ms" for name, (bullet, _, _) in worlds]
    bridge = [max(share, 0) for _, (_, share, _) in worlds]
    everything = [share for _, (_, _, share) in worlds]
    places = range(len(names))
    figure, axes = plt.subplots(figsize=(9, 6), layout="constrained")
    axes.barh(places, bridge, color=style.BLUE, height=0.72, label="finding the collisions (the bridge)")
    axes.barh(places, [all - part for all, part in zip(everything, bridge)], left=bridge, color=style.SKY, height=0.72,
              label="making their sound, rendering included")
    axes.axvline(BAR, color=style.INK, linestyle=":", linewidth=1.4, zorder=1.5)
    axes.annotate(f"wanted: below {BAR:.0f} %", (BAR, -0.6), (0, 5), textcoords="offset points", ha="center", annotation_clip=False)
    for place, share in zip(places, everything):
        axes.text(share + 2, place, f"{share:.0f} %", va="center", color=style.SOFT,
                  bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})
    axes.set_yticks(list(places), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.tick_params(axis="y", length=0, labelcolor=style.INK)
    axes.set_xlabel("time for sound, in percent of the time of Bullet's own steps (60 substeps a second)")
    axes.set_ylabel("world, and Bullet's own time for a second of it")
    axes.legend(loc="upper right", bbox_to_anchor=(1.0, 0.99))
    style.tidy(axes, grid="x")
    style.save(figure, sys.argv[2])


if __name__ == "__main__":
    main()
