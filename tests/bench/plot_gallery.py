#!/usr/bin/env python3
"""Draws the waveform and the spectrogram of some scenes of the library.

    python3 tests/bench/plot_gallery.py CAROM docs/figures

CAROM is the command (build/release/carom). Needs numpy, scipy and matplotlib.
"""

import os
import subprocess
import sys
import tempfile
import warnings

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import scipy.io.wavfile
import scipy.signal

SCENES = [
    "pen_scrapes_brick", "marble_rolls_on_wood", "coin_spin", "box_slides_to_rest",
    "jello_and_marbles", "jello_stiff",
]
HIGHEST = {"jello_stiff": 8}  # kHz, of the picture; 20 otherwise
FULL_SCALE = 20.0  # Pa, of 1.0 in the file
RANGE = 70.0  # dB


def rendered(carom, scene, folder):
    """The left channel in Pa, and its rate."""
    path = os.path.join(folder, scene + ".wav")
    source = os.path.join(os.path.dirname(__file__), "../../scenes/library", scene + ".json")
    subprocess.run([carom, "render", source, "-o", path], check=True, stdout=subprocess.DEVNULL)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of chunks that scipy does not know
        rate, samples = scipy.io.wavfile.read(path)
    if samples.dtype.kind == "i":
        samples = samples / np.iinfo(samples.dtype).max
    return rate, FULL_SCALE * (samples if samples.ndim == 1 else samples[:, 0]).astype(float)


def draw(scene, rate, pressure, file):
    figure, (wave, spectrum) = plt.subplots(
        2, 1, figsize=(6.4, 4.2), height_ratios=[1, 2.4], sharex=True, layout="constrained"
    )
    wave.plot(np.arange(len(pressure)) / rate, pressure, linewidth=0.4, color="#26547c")
    wave.set_ylabel("Pa")
    wave.set_title(scene, fontsize=10)
    window = 1024
    frequencies, times, power = scipy.signal.spectrogram(
        pressure, rate, nperseg=window, noverlap=window - 256, scaling="spectrum"
    )
    level = 10.0 * np.log10(power / (20e-6) ** 2 + 1e-12)
    top = level.max()
    image = spectrum.pcolormesh(
        times, frequencies / 1000, level, vmin=top - RANGE, vmax=top, cmap="magma", rasterized=True
    )
    spectrum.set_ylim(0, HIGHEST.get(scene, 20))
    spectrum.set_ylabel("kHz")
    spectrum.set_xlabel("s")
    figure.colorbar(image, ax=[wave, spectrum], label="dB SPL, of 47 Hz")
    figure.savefig(file, dpi=75)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            rate, pressure = rendered(sys.argv[1], scene, folder)
            draw(scene, rate, pressure, os.path.join(sys.argv[2], scene + ".png"))


if __name__ == "__main__":
    main()
