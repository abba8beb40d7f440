#!/usr/bin/env python3
"""Draws the cost of sound over ordinary worlds, from a full run of ./bench.

    python3 tests/bench/plot_worlds.py tests/bench/baseline.json docs/figures/worlds.png

Needs matplotlib.
"""

import json
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

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
    worlds = shares(sys.argv[1])
    names = [f"{name.replace('_', ' ')}\n({bullet:.0f} ms/s)" for name, (bullet, _, _) in worlds.items()]
    places = range(len(names))
    figure, axes = plt.subplots(figsize=(9, 6), constrained_layout=True)
    axes.barh(places, [all for _, _, all in worlds.values()], color="#4c72b0", label="everything, rendering included")
    axes.barh(places, [max(bridge, 0) for _, bridge, _ in worlds.values()], color="#dd8452", label="of that the bridge")
    axes.axvline(BAR, color="black", linestyle=":", label=f"bar, {BAR:.0f} %")
    axes.set_yticks(list(places), names, fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("% of Bullet's own steps, beyond them (60 substeps a second)")
    axes.legend(loc="lower right")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(sys.argv[2], dpi=110)


if __name__ == "__main__":
    main()
