"""What a sound looks like: its pressure and its levels over time and frequency, on the same scales in all figures.

Imported by plot_scenes.py. Needs numpy, scipy and matplotlib.
"""

import warnings

import numpy as np
import scipy.fft
import scipy.io.wavfile

import plot_style as style

REFERENCE = 20e-6  # Pa, of 0 dB SPL
LOW, HIGH = 50.0, 20000.0  # Hz
BANDS_PER_OCTAVE = 24
WIDTH = 1.0 / 12.0  # octaves, of a band at half of its power
LEAST_WIDTH = 40.0  # Hz: narrower bands would smear a click over more than a fiftieth of a second
TICKS = [50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000]


def read(path, full_scale):
    """The samples in Pa, one row for each channel, and their rate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of chunks that scipy does not know
        rate, samples = scipy.io.wavfile.read(path)
    if samples.dtype.kind == "i":
        samples = samples / -float(np.iinfo(samples.dtype).min)
    return rate, full_scale * np.atleast_2d(samples.T.astype(float))


def frequencies():
    count = int(np.floor(BANDS_PER_OCTAVE * np.log2(HIGH / LOW))) + 1
    return LOW * 2.0 ** (np.arange(count) / BANDS_PER_OCTAVE)


def levels(pressure, rate, columns):
    """dB SPL in bands around frequencies(), one row each: the mean power of each of so many columns of time.

    Each band is a Gaussian on the spectrum of the whole, and its power that of the analytic signal: a tone in its middle has its own level.
    """
    size = len(pressure)
    padded = scipy.fft.next_fast_len(size + rate // 4)
    spectrum = scipy.fft.fft(pressure, padded)[: padded // 2]
    grid = np.arange(padded // 2) * rate / padded
    edges = np.linspace(0, size, columns + 1).astype(int)
    rows = []
    for frequency in frequencies():
        half = max(frequency * (2.0 ** (WIDTH / 2.0) - 1.0), LEAST_WIDTH / 2.0)
        reach = slice(*np.searchsorted(grid, [frequency - 6.5 * half, frequency + 6.5 * half]))
        band = np.zeros(padded, complex)
        # The power of a Gaussian is halved at `half` from its middle.
        band[reach] = 2.0 * spectrum[reach] * np.exp(-0.5 * np.log(2.0) * ((grid[reach] - frequency) / half) ** 2)
        power = 0.5 * np.abs(scipy.fft.ifft(band)[:size]) ** 2
        rows.append(np.add.reduceat(power, edges[:-1]) / np.diff(edges))
    return 10.0 * np.log10(np.array(rows) / REFERENCE**2 + 1e-12)


def draw_wave(axes, pressure, rate, until, columns=1600, colour=style.BLUE):
    """The least and the largest pressure of each column, so that no peak is lost."""
    edges = np.linspace(0, int(until * rate), columns + 1).astype(int)
    time = (edges[:-1] + edges[1:]) / (2.0 * rate)
    low, high = np.minimum.reduceat(pressure, edges[:-1]), np.maximum.reduceat(pressure, edges[:-1])
    axes.fill_between(time, low, high, color=colour, linewidth=0.5)
    axes.set_xlim(0, until)


def draw_levels(axes, pressure, rate, until, columns):
    """A spectrogram on the one scale of level; returns the image, for a colour bar."""
    level = levels(pressure[: int(until * rate)], rate, columns)
    ratio = 2.0 ** (0.5 / BANDS_PER_OCTAVE)
    edges = np.append(frequencies() / ratio, frequencies()[-1] * ratio)
    image = axes.pcolormesh(np.linspace(0, until, columns + 1), edges, level, vmin=style.LOWEST, vmax=style.HIGHEST, cmap=style.LEVELS, rasterized=True)
    axes.set_yscale("log")
    axes.set_ylim(LOW, HIGH)
    axes.set_xlim(0, until)
    style.log_ticks(axes.yaxis, TICKS)
    return image


def write(path, rate, samples):
    """A WAV file of 32-bit floating point, one row for each channel."""
    scipy.io.wavfile.write(path, rate, samples.T.astype(np.float32))
