#!/usr/bin/env python3
"""Puts the figures of a full run of ./bench into docs/benchmarks.md: those of worlds as a table with
a row for each world and rate, all others as one table.

    ./bench --json > tests/bench/baseline.json
    python3 tests/bench/figures_table.py tests/bench/baseline.json docs/benchmarks.md

With --check nothing is written: the exit status is 1 if the document shows other figures than the run.
"""

import json
import sys

BEGIN = "<!-- figures: tests/bench/figures_table.py -->\n"
END = "<!-- end of figures -->\n"
WORLDS_BEGIN = "<!-- worlds: tests/bench/figures_table.py -->\n"
WORLDS_END = "<!-- end of worlds -->\n"
HEAD = """| benchmark | figure | value | +- | yardstick | its value | ratio | bar | |
|---|---|---|---|---|---|---|---|---|
"""


def number(value):
    return "-" if value is None else f"{value:.4g}"


def spread(figure):
    if not figure["value"] or figure["value_low"] is None:
        return "-"
    return f"{50 * abs((figure['value_high'] - figure['value_low']) / figure['value']):.1f} %"


def bar(figure):
    if figure["bar"] is None:
        return ""
    sign = ">=" if figure["better"] == "higher" else "<="
    return f"{sign} {figure['bar']:g}" + (" x" if figure["bar_of"] == "ratio" else "")


def verdict(figure):
    return {True: "holds", False: "**falls short**", None: ""}[figure["holds"]]


def table(run):
    lines = [HEAD]
    for name, benchmark in run["benchmarks"].items():
        if benchmark is None:
            raise SystemExit(f"benchmark '{name}' gave no result in that run; a complete one is wanted")
        if benchmark["short"]:
            raise SystemExit("that run is a short one; what is published comes of a full one, ./bench --json")
        if name == "worlds":
            continue
        for figure in benchmark["figures"]:
            cells = [f"`{name}`", figure["name"], f"{number(figure['value'])} {figure['unit']}",
                     spread(figure), figure["yardstick"], number(figure["yardstick_value"]),
                     number(figure["ratio"]), bar(figure), verdict(figure)]
            lines.append("| " + " | ".join(cells) + " |\n")
    return "".join(lines)


def worlds_table(run):
    rows = {}
    columns = []
    for figure in run["benchmarks"]["worlds"]["figures"]:
        world, rate, column = figure["name"].split(".")
        if column not in columns:
            columns.append(column)
        short = figure["holds"] is False
        text = number(figure["value"])
        rows.setdefault((world, rate), {})[column] = f"**{text}**" if short else text
    lines = ["| world | Hz | " + " | ".join(f"`{column}`" for column in columns) + " |\n",
             "|---" * (len(columns) + 2) + "|\n"]
    for (world, rate), cells in rows.items():
        lines.append("| " + " | ".join([world, rate] + [cells[column] for column in columns]) + " |\n")
    return "".join(lines)


def parts(document, begin, end, path):
    if document.count(begin) != 1 or document.count(end) != 1:
        raise SystemExit(f"{path}: one line '{begin.strip()}' and one '{end.strip()}' are wanted")
    before, rest = document.split(begin)
    shown, after = rest.split(end)
    return before, shown, after


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--check"]
    if len(arguments) != 2:
        raise SystemExit(__doc__)
    with open(arguments[0], encoding="utf-8") as file:
        run = json.load(file)
    with open(arguments[1], encoding="utf-8") as file:
        document = file.read()
    for begin, end, wanted in ((BEGIN, END, table(run)), (WORLDS_BEGIN, WORLDS_END, worlds_table(run))):
        before, shown, after = parts(document, begin, end, arguments[1])
        if "--check" in sys.argv and shown != wanted:
            raise SystemExit(f"{arguments[1]} shows other figures than {arguments[0]}; "
                             "python3 tests/bench/figures_table.py puts them in")
        document = before + begin + wanted + end + after
    if "--check" not in sys.argv:
        with open(arguments[1], "w", encoding="utf-8") as file:
            file.write(document)


if __name__ == "__main__":
    main()
