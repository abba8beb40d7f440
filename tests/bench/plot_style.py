"""The one style of all figures of the docs: colours, sizes, axes, and how a picture is written.

Imported by the plot_*.py beside it. Needs matplotlib; pictures get a palette if Pillow is there, which comes with matplotlib.
"""

import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.patheffects
import matplotlib.pyplot as plt
import matplotlib.ticker
import matplotlib.transforms
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator
from PIL import Image

# Okabe and Ito's palette, which the colour-blind tell apart. A thing keeps its colour over all figures by its place in the list.
BLUE, ORANGE, GREEN, PURPLE, SKY, YELLOW, BLACK = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#1a1a1a"
INK, SOFT, FAINT = "#1a1a1a", "0.35", "0.9"
LEVELS = "magma"  # colours of levels
LOWEST, HIGHEST = 0.0, 110.0  # dB SPL: the ends of the one scale of all spectrograms
MINUS = "\N{MINUS SIGN}"
HALO = [matplotlib.patheffects.withStroke(linewidth=2.2, foreground="#1a0a2a")]  # behind white text on levels

plt.rcParams.update({
    "font.family": "DejaVu Sans", "font.size": 10.5, "axes.titlesize": 11.5, "axes.edgecolor": SOFT, "axes.labelcolor": INK,
    "xtick.color": SOFT, "ytick.color": SOFT, "axes.axisbelow": True, "legend.frameon": False, "axes.linewidth": 0.8,
})


def plain(value, _=None):
    """A number as people write it: 0.01, 1, 20, 1000."""
    return f"{value:.10g}".replace("-", MINUS)


def short(value, _=None):
    """With k for thousands: 500, 2k, 9.6k."""
    return f"{value / 1000:.2g}k" if value >= 1000 else f"{value:g}"


def power_of_ten(value, _=None):
    """As 1, 10, 0.1, and as a power where that is long."""
    return plain(value) if 1e-4 <= value <= 1e4 else matplotlib.ticker.LogFormatterMathtext()(value)


def tidy(axes, grid="both"):
    """Only the two axes that carry numbers, and a faint grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis=grid, color=FAINT, linewidth=0.7)


def log_ticks(axis, ticks, text=plain):
    """Ticks of a logarithmic axis exactly at these values, without minor ones."""
    axis.set_major_locator(FixedLocator(list(ticks)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value)))


def save(figure, path, dpi=100, still=0):
    """Writes a PNG with a palette, which has a third of the bytes; other endings as matplotlib writes them.

    The upper `still` pixels are a picture, and below are levels by colour.
    """
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=dpi)
    plt.close(figure)
    if path.suffix == ".png":
        with Image.open(path) as file:
            image = file.convert("RGB")
        (with_levels(image, still) if still else few_colours(image)).save(path, optimize=True)


def few_colours(image):
    found = image.quantize(256, method=Image.Quantize.MEDIANCUT)
    colours = found.getpalette()
    for i in range(0, len(colours), 3):
        if min(colours[i : i + 3]) >= 250:  # paper, which medians make grey
            colours[i : i + 3] = [255, 255, 255]
    found.putpalette(colours)
    return found


def with_levels(image, still, levels=88):
    """256 colours: so many of the scale of levels, which has to stay smooth, those of lines and letters, and else the still's."""
    scale = [matplotlib.colormaps[LEVELS](i / (levels - 1))[:3] for i in range(levels)]
    lines = [matplotlib.colors.to_rgb(colour) for colour in (INK, SOFT, BLUE)]
    faded = [[1.0 - strength * (1.0 - part) for part in colour] for colour in lines for strength in (0.25, 0.5, 0.75, 1.0)] + [(1.0, 1.0, 1.0)]
    fixed = [round(255 * part) for colour in scale + faded for part in colour]
    width, height = image.size
    upper, lower = image.crop((0, 0, width, still)), image.crop((0, still, width, height))
    free = 256 - len(fixed) // 3
    palette = Image.new("P", (1, 1))
    palette.putpalette(fixed + upper.quantize(free, method=Image.Quantize.MAXCOVERAGE, kmeans=1).getpalette()[: 3 * free])
    whole = image.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG)
    whole.paste(lower.quantize(palette=palette, dither=Image.Dither.NONE), (0, still))
    paper = image.convert("L").point(lambda value: 255 if value == 255 else 0)  # which the nearest colour is a little off
    whole.paste(len(fixed) // 3 - 1, (0, 0), paper)
    return whole


def label_points(axes, labels, curves=(), fontsize=9.0):
    """Writes texts beside points, each where it covers the least of other texts, points and curves.

    `labels` are (x, y, text, colour), `curves` lists of (x, y) of what should stay free; all in the units of the axes, whose limits
    have to be final.
    """
    figure = axes.figure
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    taken = [box_around(*axes.transData.transform((x, y)), 5, 5) for x, y, _, _ in labels]
    for curve in curves:
        taken += [box_around(x, y, 2, 2) for x, y in along(axes.transData.transform(curve))]
    frame = axes.get_window_extent()
    for x, y, text, colour in labels:
        trials = []
        for rank, (dx, dy, across, up) in enumerate(PLACES):
            note = axes.annotate(text, (x, y), (dx, dy), textcoords="offset points", ha=across, va=up, fontsize=fontsize, color=colour)
            box = note.get_window_extent(renderer)
            trials.append((cost(box, taken, frame) + 0.5 * rank, rank, note, box))
        best = min(trials, key=lambda trial: trial[:2])
        for trial in trials:
            if trial is not best:
                trial[2].remove()
        taken.append(best[3])


# Where a text may stand: points to the right and up, and how it is aligned; the first are liked best.
PLACES = [(6, 5, "left", "bottom"), (-6, -5, "right", "top"), (6, -5, "left", "top"), (-6, 5, "right", "bottom"), (0, 8, "center", "bottom"),
          (0, -8, "center", "top"), (9, 0, "left", "center"), (-9, 0, "right", "center"), (13, 12, "left", "bottom"), (-13, -12, "right", "top"),
          (13, -12, "left", "top"), (-13, 12, "right", "bottom")]


def box_around(x, y, half_width, half_height):
    return matplotlib.transforms.Bbox([[x - half_width, y - half_height], [x + half_width, y + half_height]])


def along(points, step=4.0):
    """Pixels along a polyline, `step` apart."""
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        count = max(1, int(max(abs(x1 - x0), abs(y1 - y0)) / step))
        yield from ((x0 + (x1 - x0) * i / count, y0 + (y1 - y0) * i / count) for i in range(count + 1))


def cost(box, taken, frame):
    """How much a text covers; far more if it leaves the frame."""
    outside = box.x0 < frame.x0 or box.x1 > frame.x1 or box.y0 < frame.y0 or box.y1 > frame.y1
    return sum(overlap(box, other) for other in taken) + (1e6 if outside else 0.0)


def overlap(a, b):
    width = min(a.x1, b.x1) - max(a.x0, b.x0)
    height = min(a.y1, b.y1) - max(a.y0, b.y0)
    return width * height if width > 0 and height > 0 else 0.0
