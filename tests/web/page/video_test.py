#!/usr/bin/env python3
"""Makes films by `carom video`, and measures them in the file.

    video_test.py --carom CAROM --template carom_view.html

The picture of a touch and its sound are at most a picture apart; the length is right to the picture; what is missing is one
sentence; and nothing stays, however the command ends.
"""
import argparse
import json
import os
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

SCENES = Path(__file__).resolve().parents[3] / "scenes/library"
RATE = 60
SIDE = (160, 240)
# Near the floor, so that the ball is large enough to be measured.
CAMERA = [{"time": 0, "position": [0, 0.1, 0.7], "looks_at": [0, 0.1, 0]}]
TO = 0.5        # s: the ball touches the floor once, at 0.319 s
SOUND_RATE = 48000


class Claims:
    def __init__(self):
        self.count, self.wrong = 0, []

    def that(self, holds, words):
        self.count += 1
        if not holds:
            self.wrong.append(words)


class Films:
    """Films in a folder of their own, with another one for what is temporary."""

    def __init__(self, options, folder):
        self.options, self.folder, self.scratch = options, folder, folder / "scratch"
        self.scratch.mkdir()

    def words(self, name, *more, scene="bouncing_ball", template=None):
        return [self.options.carom, "video", str(SCENES / f"{scene}.json"), "-o", str(self.folder / name), "--template", template or self.options.template,
                "--browser", self.options.chromium, *more]

    def environment(self, **more):
        return {**os.environ, "TMPDIR": str(self.scratch), **more}

    def make(self, name, *more, **given):
        done = subprocess.run(self.words(name, "--json", *more, **given), capture_output=True, text=True, env=self.environment())
        if done.returncode:
            raise RuntimeError(f"{name}: {done.stderr.strip()}")
        return json.loads(done.stdout)

    def left(self):
        """What stays of a film beside its file: temporary files, partial ones, and programs that know the folder."""
        files = [path.name for path in self.scratch.iterdir()] + [path.name for path in self.folder.glob("*.partial*")]
        for process in Path("/proc").glob("[0-9]*"):
            try:
                if str(self.scratch).encode() in (process / "cmdline").read_bytes():
                    files.append(f"process {process.name}")
            except OSError:
                continue
        return files


def probe(path, *entries):
    done = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-of", "json", "-show_entries", ":".join(entries), str(path)], capture_output=True, check=True)
    return json.loads(done.stdout)


def decoded(path, *words):
    return subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), *words, "-"], capture_output=True, check=True).stdout


def pictures(path):
    """The grey pictures, each as rows of bytes."""
    width, height = SIDE
    data = decoded(path, "-map", "0:v", "-f", "rawvideo", "-pix_fmt", "gray", "-fps_mode", "passthrough")
    return [[data[at + row * width:at + (row + 1) * width] for row in range(height)] for at in range(0, len(data), width * height)]


def lowest_picture(shown):
    """The index of the picture in which the upper edge of what moves is lowest."""
    width, height = SIDE
    ground = [bytes(map(min, *(picture[row] for picture in shown))) for row in range(height)]
    tops = []
    for picture in shown:
        rows = [row for row in range(height) if sum(value - still > 50 for value, still in zip(picture[row], ground[row])) >= 4]
        tops.append(rows[0] if rows else -1)
    return max(range(len(tops)), key=lambda index: tops[index]), tops


def click_time(path):
    """The time (s) of the first sample above half of the peak."""
    data = decoded(path, "-map", "0:a", "-f", "f32le", "-ac", "1", "-ar", str(SOUND_RATE))
    samples = [abs(value) for (value,) in struct.iter_unpack("<f", data)]
    peak = max(samples)
    return next(index for index, value in enumerate(samples) if value > 0.5 * peak) / SOUND_RATE, len(samples) / SOUND_RATE


def check_film(films, claims, name, codecs):
    camera = films.folder / "camera.json"
    camera.write_text(json.dumps(CAMERA), encoding="utf-8")
    told = films.make(name, "--size", f"{SIDE[0]}x{SIDE[1]}", "--rate", str(RATE), "--to", str(TO), "--camera", str(camera), "--listener", "listener")
    path = films.folder / name
    frames = round(TO * RATE)
    claims.that((told["frames"], told["rate_hz"], told["duration_s"]) == (frames, RATE, TO), f"{name}: the JSON says {told}")
    found = probe(path, "stream=codec_name,nb_read_frames,r_frame_rate,width,height,start_time")["streams"]
    claims.that([stream["codec_name"] for stream in found] == codecs, f"{name}: its streams are {found}")
    video = found[0]
    claims.that((int(video["nb_read_frames"]), video["r_frame_rate"]) == (frames, f"{RATE}/1"), f"{name}: {video['nb_read_frames']} pictures at {video['r_frame_rate']}")
    claims.that((video["width"], video["height"]) == SIDE, f"{name}: {video['width']}x{video['height']}")
    shown = pictures(path)
    claims.that(len(shown) == frames, f"{name}: {len(shown)} pictures are decoded")
    lowest, tops = lowest_picture(shown)
    click, lasts = click_time(path)
    claims.that(abs(lasts - TO) <= 1 / RATE, f"{name}: the sound lasts {lasts} s")
    apart = click - lowest / RATE
    claims.that(abs(apart) <= 1 / RATE, f"{name}: the ball is lowest at {lowest / RATE} s, and heard at {click} s (upper edges: {tops})")
    claims.that(films.left() == [], f"{name}: {films.left()} stays")
    print(f"{name}: lowest in picture {lowest} ({1000 * lowest / RATE:.1f} ms), click at {1000 * click:.1f} ms: {1000 * apart:+.1f} ms; sound of {lasts:.6f} s, {frames} pictures")


def check_missing(films, claims):
    empty = films.folder / "empty"
    empty.mkdir()
    nowhere = str(films.folder / "nowhere")
    bare = [word for word in films.words("none.mp4") if word not in ("--browser", films.options.chromium)]
    cases = [
        ("ffmpeg", bare, films.environment(PATH=str(empty)), "apt-get install ffmpeg"),
        ("ffmpeg by name", [*bare, "--ffmpeg", nowhere], films.environment(), "apt-get install ffmpeg"),
        ("browser", [*bare, "--browser", nowhere], films.environment(), "apt-get install chromium"),
        ("browser in PATH", [*bare, "--ffmpeg", "/bin/true"], films.environment(PATH=str(empty)), "apt-get install chromium"),
        ("template", films.words("none.mp4", template=nowhere), films.environment(), "template"),
        ("a browser that is none", [*bare, "--browser", "/bin/false"], films.environment(), "browser"),
        ("an ffmpeg that is none", [*films.words("none.mp4"), "--ffmpeg", "/bin/false", "--size", "64x64", "--to", "0.1"], films.environment(), "ffmpeg"),
    ]
    for name, words, environment, expected in cases:
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        said = done.stderr.strip()
        claims.that(done.returncode == 1 and said.count("\n") == 0 and expected in said, f"without {name}: exit code {done.returncode}, {said!r}")
        claims.that(not (films.folder / "none.mp4").exists() and films.left() == [], f"without {name}: {films.left()} stays")
    for word in ("ball.avi", "ball"):
        done = subprocess.run(films.words(word), capture_output=True, text=True, env=films.environment())
        claims.that(done.returncode == 2 and "FILE.mp4 or FILE.webm" in done.stderr, f"{word}: {done.stderr.strip()!r}")


def waits(condition, seconds=60):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False


def check_ends(films, claims):
    """By a signal in the middle of the pictures."""
    for number in (signal.SIGINT, signal.SIGKILL):
        film = subprocess.Popen(films.words("cut.mp4", "--size", "64x64"), stderr=subprocess.PIPE, text=True, env=films.environment())
        begun = waits(lambda: any(films.scratch.glob("*/encoder.txt")) or film.poll() is not None)
        claims.that(begun and film.poll() is None, f"{number.name}: the film has not come to its pictures")
        film.send_signal(number)
        film.wait()
        film.stderr.close()
        claims.that(film.returncode == -number, f"{number.name}: exit code {film.returncode}")
        if number == signal.SIGKILL:   # the next film of that name removes what it leaves: docs/cli.md
            for path in films.folder.glob("cut.mp4.*.partial"):
                path.unlink()
        claims.that(waits(lambda: films.left() == []), f"{number.name}: {films.left()} stays")
        claims.that(not (films.folder / "cut.mp4").exists(), f"{number.name}: there is half a film")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--carom", required=True)
    options.add_argument("--template", required=True)
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--only", choices=["mp4", "webm", "missing", "ends"])
    chosen = options.parse_args()
    claims = Claims()
    checks = {"mp4": lambda films: check_film(films, claims, "ball.mp4", ["h264", "aac"]), "webm": lambda films: check_film(films, claims, "ball.webm", ["vp9", "opus"]),
              "missing": lambda films: check_missing(films, claims), "ends": lambda films: check_ends(films, claims)}
    for name, check in checks.items():
        if chosen.only not in (None, name):
            continue
        with tempfile.TemporaryDirectory(prefix="carom_film_") as folder:
            try:
                check(Films(chosen, Path(folder)))
            except (RuntimeError, subprocess.CalledProcessError) as error:
                claims.wrong.append(str(error))
    for line in claims.wrong:
        print(line)
    print(f"{len(claims.wrong)} differences" if claims.wrong else f"as expected: {claims.count} claims")
    sys.exit(1 if claims.wrong else 0)


if __name__ == "__main__":
    main()
