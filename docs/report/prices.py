#!/usr/bin/env python3
"""Reads a report.json and prints, for each simplification of the hand-out, what it costs in error and saves in run time.

    prices.py report.json

A Markdown table: medians over the scenes of the report, with the range.
"""
import json
import math
import statistics
import sys

# What it is; the variant in which it stands alone; the reason that it has the same mechanics as the reference.
SOUND = [
    ("The pulse of an elastic contact, (2) to (5), for one that loses energy", "pulse_hertz"),
    ("Half a sine for Hertz's pulse, (3)", "pulse_half_sine"),
    ("The Gaussian for half a sine, (9), with pi/2 in (6)", "pulse_hand_out"),
    ("A Gaussian of the right impulse instead", "pulse_gaussian"),
    ("Mitchell and Netravali's bump instead", "pulse_mitchell_netravali"),
    ("The pulse's value at each sample, (10), for what the band holds", "naive"),
    ("A compact dipole far away, (1), for a sphere of its size", "compact"),
    ("A distance that stands still while a contact lasts, (7)", "no_doppler"),
    ("All of these together", "course_gaussian"),
]
TIMES = [
    ("Event times of steps, at 1/60 s", "bullet_60_step"),
    ("Event times of steps, at 1/240 s", "bullet_240_step"),
    ("Event times of steps, at 1/1000 s", "bullet_1000_step"),
    ("Straight lines within a step of 1/60 s", "bullet_60_back_dated"),
    ("Straight lines within a step of 1/240 s", "bullet_240_back_dated"),
    ("Straight lines within a step of 1/1000 s", "bullet_1000_back_dated"),
]


def decibels(ratio):
    return 20.0 * math.log10(ratio)


def span(values, digits):
    values = sorted(values)
    if not values:
        return "–"
    text = f"{statistics.median(values):.{digits}f}"
    return text if len(values) == 1 else f"{text} ({values[0]:.{digits}f} to {values[-1]:.{digits}f})"


def seconds(values):
    values = sorted(values)
    if not values:
        return "–"
    return f"{1e6 * statistics.median(values):.3g} us ({1e6 * values[0]:.3g} to {1e6 * values[-1]:.3g})"


def variants(report, name):
    """(reference, variant) in every scene that has it."""
    for scene in report["scenes"]:
        by_id = {one["id"]: one for one in scene["variants"]}
        if name in by_id:
            yield by_id[scene["reference"]], by_id[name]


def sound_row(report, title, name):
    pairs = list(variants(report, name))
    plain = [decibels(v["waveform_error"]) for _, v in pairs if v["waveform_error"]]
    aligned = [decibels(v["aligned_waveform_error"]) for _, v in pairs if v["aligned_waveform_error"]]
    bands = [v["band_error_db"] for _, v in pairs if v["band_error_db"] is not None]
    saved = [1.0 - v["run_time"]["sound"] / r["run_time"]["sound"] for r, v in pairs]
    return f"| {title} | {span(plain, 1)} | {span(aligned, 1)} | {span(bands, 2)} | {span([100.0 * s for s in saved], 0)} |"


def time_row(report, title, name):
    pairs = list(variants(report, name))
    errors = [v["event_time_error"]["rms"] for _, v in pairs if v["event_time_error"]]
    local = [decibels(v["local_waveform_error"]) for _, v in pairs if v["local_waveform_error"]]
    return f"| {title} | {seconds(errors)} | {span(local, 1)} |"


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        report = json.load(file)
    names = ", ".join(scene["name"] for scene in report["scenes"])
    print(f"Medians over the scenes that have the variant, and ranges, of: {names}.\n")
    print("| simplification | waveform, dB | aligned, dB | third octaves, dB | run time of the sound saved, % |")
    print("|---|---|---|---|---|")
    for title, name in SOUND:
        print(sound_row(report, title, name))
    print("\n| of times | error, rms | waveform on the same path, dB |")
    print("|---|---|---|")
    for title, name in TIMES:
        print(time_row(report, title, name))


if __name__ == "__main__":
    main()
