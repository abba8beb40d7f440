#!/usr/bin/python3
"""Draws scenes: a still, and below it the sound at the scene's listener. Makes their sounds too.

    /usr/bin/python3 tests/bench/plot_scenes.py build/release/carom docs/figures --sounds docs/sounds [--template PAGE] [--only NAME]...

in the repository's root; the first argument is the command. For each scene below it writes NAME.png, and NAME.flac at 44.1 kHz
whose peak is at -3 dB; besides, first_screen.png, the picture of README. Stills are single pictures of `carom video`, which
needs Chromium, ffmpeg and the page's template (docs/video.md). Needs numpy, scipy and matplotlib. With --keep FOLDER, renderings
and stills are left there and taken from there, for work on the figures.
"""

import argparse
import contextlib
import dataclasses
import json
import pathlib
import subprocess
import tempfile

import numpy as np

import plot_style as style
import sound_picture
from plot_style import plt

ROOT = pathlib.Path(__file__).resolve().parents[2]
FULL_SCALE = 20.0  # Pa, of 1.0 in the files that are read here
PEAK = 10.0 ** (-3.0 / 20.0)  # of the sounds
RATE = 44100  # Hz, of the sounds
SIZE = (1680, 640)  # pixels of a still
PICTURE, LARGE_PICTURE = 320, 530  # pixels: the height of a still in its figure, and in README


@dataclasses.dataclass
class Scene:
    """`until` s are shown and heard, the still is at `moment`; notes are (s, Hz, text, points to the right and up of there)."""

    file: str
    title: str
    until: float
    moment: float
    notes: list
    camera: dict | None = None  # a key frame (docs/scenes.md); else the first view of the page

    @property
    def name(self):
        return pathlib.Path(self.file).stem


SCENES = [
    Scene("library/box_slides_to_rest.json", "A box slides to rest", 0.8, 0.3, [
        (0.008, 9000, "pushed", (30, -30)), (0.4, 2500, "slides, ever slower", (30, 40)), (0.70, 300, "rests", (14, 26))],
        {"position": [0.28, 0.2, 0.36], "looks_at": [-0.03, 0.0, 0], "field_of_view": 28}),
    Scene("library/marble_rolls_on_wood.json", "A marble rolls on wood", 3.4, 1.1, [
        (0.55, 4500, "rolls down a board", (-10, 26)), (1.155, 9000, "over its edge", (18, 12)), (2.3, 2200, "rolls on the next one", (-10, 40)),
        (3.28, 400, "rests", (-4, 40))],
        {"position": [0.2, 0.13, 0.27], "looks_at": [-0.01, 0.01, 0], "field_of_view": 26}),
    Scene("library/coin_spin.json", "A coin spins down", 5.3, 2.0, [
        (0.02, 3000, "let go", (30, -20)), (3.1, 5500, "its rim rolls, ever faster", (-10, -40)), (5.03, 3000, "lies flat", (-44, -24))]),
    Scene("library/pen_scrapes_brick.json", "A pen scrapes over bricks", 1.15, 0.4, [
        (0.036, 9000, "lands", (16, 10)), (0.456, 9000, "ticks at joints", (22, 12)), (0.86, 5000, "scrapes", (-16, 26)), (1.053, 3000, "rests", (4, 44))],
        {"position": [0.06, 0.11, 0.24], "looks_at": [-0.05, 0, 0.03], "field_of_view": 30}),
    Scene("library/jello_and_marbles.json", "Marbles fall on jello", 2.2, 0.3, [
        (0.8, 110, "the jello wobbles", (60, 24)), (0.326, 7000, "steel ball on the table", (40, 22)), (1.9, 3000, "last hops", (-20, 36))],
        {"position": [0.16, 0.2, 0.4], "looks_at": [0.02, 0.055, 0], "field_of_view": 27}),
    Scene("library/jello_stiff.json", "A block as stiff as rubber rings", 0.5, 0.005, [
        (0.006, 12000, "a steel ball hits", (40, 0)), (0.25, 2800, "tones of its own", (20, 34))],
        {"position": [0.1, 0.09, 0.16], "looks_at": [0, 0.005, 0], "field_of_view": 26}),
    Scene("library/marbles_in_a_box.json", "Eighty marbles in a box", 5.0, 0.34, [
        (0.19, 150, "the first land", (40, -6)), (1.1, 9000, "they click on each other and on wood", (30, 10)), (4.1, 2500, "single hops", (0, 40))],
        {"position": [0.2, 0.17, 0.24], "looks_at": [-0.03, 0.06, -0.03], "field_of_view": 40}),
    Scene("shows/ringing_dominoes.json", "Ringing dominoes", 2.9, 1.28, [
        (0.185, 150, "first blow", (26, -14)), (1.4, 1150, "each tile has its tone", (10, -46)), (1.74, 12000, "the last ones", (40, 10)), (2.6, 2000, "they ring on", (0, 40))]),
]
FIRST_SCREEN = "marbles_in_a_box"


class Maker:
    """Renders with the command, and keeps what it rendered in a folder."""

    def __init__(self, carom, template, folder):
        self.carom, self.template, self.folder = carom, template, pathlib.Path(folder)

    def sound(self, scene):
        """All channels in Pa, and the rate."""
        path = self.folder / (scene.name + ".wav")
        if not path.exists():
            subprocess.run([self.carom, "render", ROOT / "scenes" / scene.file, "-o", path, "--full-scale", str(FULL_SCALE), "--json"],
                           check=True, stdout=subprocess.DEVNULL)
        return sound_picture.read(path, FULL_SCALE)

    def still(self, scene):
        """The picture at the scene's moment, height x width x 3."""
        path = self.folder / (scene.name + ".png")
        if not path.exists():
            film = self.folder / (scene.name + ".mp4")
            command = [self.carom, "video", ROOT / "scenes" / scene.file, "-o", film, "--size", "{}x{}".format(*SIZE), "--rate", "20", "--ear", "mono",
                       "--from", str(scene.moment), "--to", str(scene.moment + 0.05), "--lossless", "--json"]
            if scene.camera:
                way = self.folder / (scene.name + ".camera.json")
                way.write_text(json.dumps([{"time": 0, **scene.camera}]))
                command += ["--camera", way]
            subprocess.run(command + (["--template", self.template] if self.template else []), check=True, stdout=subprocess.DEVNULL)
            subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", film, "-frames:v", "1", path], check=True)
        return plt.imread(path)[:, :, :3]


def place(figure, left, bottom, width, height):
    """Axes by pixels from the lower left corner."""
    across, up = figure.get_size_inches() * figure.dpi
    return figure.add_axes([left / across, bottom / up, width / across, height / up])


def show_still(axes, still, scene):
    """The middle of the still, in the shape of the axes."""
    box = axes.get_window_extent()
    height, width = still.shape[:2]
    rows = min(height, round(width * box.height / box.width))
    top = (height - rows) // 2
    axes.imshow(still[top : top + rows], aspect="auto", interpolation="antialiased")
    axes.set_axis_off()
    axes.text(0.985, 0.04, f"at {style.plain(scene.moment)} s", transform=axes.transAxes, color="white", ha="right", alpha=0.9)


def mark(axes, moment, colour):
    axes.axvline(moment, color=colour, linewidth=1.0, linestyle=(0, (4, 3)))


def annotate(axes, notes):
    for time, frequency, text, (right, up) in notes:
        axes.annotate(text, (time, frequency), (right, up), textcoords="offset points", color="white", fontsize=10.5, va="center",
                      ha="left" if right > 0 else "right" if right < -30 else "center", path_effects=style.HALO,
                      arrowprops={"arrowstyle": "-", "color": "white", "linewidth": 0.9, "shrinkA": 2, "shrinkB": 2})


def draw(scene, still, pressure, rate, size=(840, 720), picture=PICTURE, wave=84):
    """A still, the pressure below it and its levels below that; `picture` and `wave` are heights in pixels."""
    width, height = size
    figure = plt.figure(figsize=(width / 100, height / 100), dpi=100)
    left, right, gap, bottom = 88, 84, 12, 50
    across = width - left - right
    top = height - picture
    show_still(place(figure, 0, top, width, picture), still, scene)
    waves = place(figure, left, top - gap - wave, across, wave)
    sound_picture.draw_wave(waves, pressure, rate, scene.until)
    waves.set_ylabel("pressure\nin pascals")
    waves.tick_params(labelbottom=False)
    waves.spines[["top", "right"]].set_visible(False)
    limit = 1.1 * np.abs(pressure[: int(scene.until * rate)]).max()
    waves.set_ylim(-limit, limit)
    waves.set_yticks([-tick(limit), 0, tick(limit)], [style.plain(value) for value in (-tick(limit), 0, tick(limit))])
    tall = top - 2 * gap - wave - bottom
    spectrum = place(figure, left, bottom, across, tall)
    image = sound_picture.draw_levels(spectrum, pressure, rate, scene.until, across)
    spectrum.set_xlabel("time in seconds")
    spectrum.set_ylabel("frequency in hertz")
    spectrum.xaxis.set_major_formatter(style.plain)
    annotate(spectrum, scene.notes)
    mark(waves, scene.moment, style.SOFT)
    mark(spectrum, scene.moment, "white")
    bar = figure.colorbar(image, cax=place(figure, width - right + 12, bottom, 14, tall), extend="both", extendfrac=0.03)
    bar.set_label("level in dB SPL at the listener")
    bar.outline.set_visible(False)
    waves.yaxis.set_label_coords(-53 / across, 0.5)
    spectrum.yaxis.set_label_coords(-58 / across, 0.5)
    return figure


def tick(limit):
    """The largest of 1, 2 and 5 with zeros that is within 0.9 of `limit`."""
    power = 10.0 ** np.floor(np.log10(0.9 * limit))
    return power * max(step for step in (1, 2, 5) if step * power <= 0.9 * limit)


def write_sound(scene, samples, rate, path, folder):
    """16 bits at 44.1 kHz with its title; silence after `until` is left out, with a fade of 10 ms."""
    shown = samples[:, : int(scene.until * rate)].copy()
    fade = rate // 100
    shown[:, -fade:] *= np.linspace(1.0, 0.0, fade)
    shown *= PEAK / np.abs(shown).max()
    source = pathlib.Path(folder) / (scene.name + ".scaled.wav")
    sound_picture.write(source, rate, shown)
    path.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", source, "-map_metadata", "-1", "-metadata", f"TITLE={scene.title}", "-metadata", "ARTIST=Carom",
                    "-fflags", "+bitexact", "-flags:a", "+bitexact", "-ar", str(RATE), "-sample_fmt", "s16", "-compression_level", "12", path], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("carom", help="the command, such as build/release/carom")
    parser.add_argument("figures", type=pathlib.Path, help="the folder for pictures")
    parser.add_argument("--sounds", type=pathlib.Path, help="the folder for sounds; without it none are written")
    parser.add_argument("--template", help="the page without runs, as for carom video")
    parser.add_argument("--only", action="append", metavar="NAME", help="only this scene; may be given several times")
    parser.add_argument("--keep", help="a folder that keeps renderings and stills")
    arguments = parser.parse_args()
    unknown = set(arguments.only or []) - {scene.name for scene in SCENES}
    if unknown:
        parser.error(f"no such scene here: {', '.join(sorted(unknown))}; there are {', '.join(scene.name for scene in SCENES)}")
    with contextlib.nullcontext(arguments.keep) if arguments.keep else tempfile.TemporaryDirectory() as folder:
        maker = Maker(arguments.carom, arguments.template, folder)
        for scene in SCENES:
            if arguments.only and scene.name not in arguments.only:
                continue
            rate, samples = maker.sound(scene)
            still = maker.still(scene)
            style.save(draw(scene, still, samples[0], rate), arguments.figures / (scene.name + ".png"), still=PICTURE)
            if scene.name == FIRST_SCREEN:
                style.save(draw(scene, still, samples[0], rate, (1400, 960), LARGE_PICTURE, 90), arguments.figures / "first_screen.png", still=LARGE_PICTURE)
            if arguments.sounds:
                write_sound(scene, samples, rate, arguments.sounds / (scene.name + ".flac"), folder)


if __name__ == "__main__":
    main()
