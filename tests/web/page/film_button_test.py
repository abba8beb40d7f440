#!/usr/bin/env python3
"""Films a stretch by the page's own button in headless Chromium, and looks at the file.

    film_button_test.py --page marbles.html [--silent]
"""
import argparse
import base64
import json
import subprocess
import sys
import tempfile
from pathlib import Path

from browser import Browser

STRETCH = [0.1, 1.6]   # s
READ = """fetch(document.getElementById('film-file').href).then((answer) => answer.arrayBuffer()).then((buffer) => {
  let text = '';
  for (const byte of new Uint8Array(buffer)) text += String.fromCharCode(byte);
  return btoa(text);
})"""


def streams(path):
    done = subprocess.run(["ffprobe", "-v", "error", "-count_packets", "-of", "json", "-show_entries", "stream=codec_type,codec_name,width,height,nb_read_packets", str(path)],
                          capture_output=True, check=True)
    return {stream["codec_type"]: stream for stream in json.loads(done.stdout)["streams"]}


def length(path, kind):
    """The time (s) from the first packet of a stream to the end of its last."""
    done = subprocess.run(["ffprobe", "-v", "error", "-select_streams", kind, "-of", "json", "-show_entries", "packet=pts_time", str(path)], capture_output=True, check=True)
    times = [float(packet["pts_time"]) for packet in json.loads(done.stdout)["packets"]]
    return max(times) - min(times)


def loudness(path):
    """The largest sample of the sound."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:a", "-f", "s16le", "-ac", "1", "-"], capture_output=True, check=True)
    return max(abs(int.from_bytes(done.stdout[at:at + 2], "little", signed=True)) for at in range(0, len(done.stdout) - 1, 2))


def check(browser, page, silent, folder):
    wrong = []
    browser.open(page)
    browser.run("carom.ready.then(() => true)")
    size = browser.run("[document.getElementById('view').width, document.getElementById('view').height]")
    browser.run(f"carom.seek({STRETCH[0]})")
    browser.key("i")
    browser.run(f"carom.seek({STRETCH[1]})")
    browser.key("o")
    browser.key("f")
    if not browser.wait("document.getElementById('film').getAttribute('aria-pressed') === 'true' || document.getElementById('film-file') !== null", 20):
        return ["the key F does not begin a film"]
    if not browser.wait("document.getElementById('film-file') !== null", 60):
        return [f"there is no film: {browser.run('document.getElementById(`film-card`).textContent')}"]
    if browser.run("carom.playing"):
        wrong.append("the page plays on")
    name = browser.run("document.getElementById('film-file').download")
    if not name.endswith(".webm"):
        wrong.append(f"the film is called {name}")
    film = folder / "film.webm"
    film.write_bytes(base64.b64decode(browser.run(READ)))
    found = streams(film)
    if sorted(found) != (["video"] if silent else ["audio", "video"]):
        return wrong + [f"its streams are {found}"]
    video = found["video"]
    if [video["width"], video["height"]] != size or int(video["nb_read_packets"]) < 1:   # a busy machine drops pictures
        wrong.append(f"{video['nb_read_packets']} pictures of {video['width']}x{video['height']}, not of {size}")
    lasts = STRETCH[1] - STRETCH[0]
    if not silent:
        heard = length(film, "a")
        # It begins before the sound does, and ends after.
        if not lasts - 0.05 <= heard <= lasts + 10:
            wrong.append(f"the sound lasts {heard} s, the stretch {lasts} s")
        if loudness(film) < 1000:
            wrong.append("the film is silent")
    # Without a recorder the page says so.
    browser.run("document.querySelector('#film-card button').click()")
    browser.run("delete globalThis.MediaRecorder")
    browser.key("f")
    if "MediaRecorder" not in browser.run("document.getElementById('film-card').textContent"):
        wrong.append("a browser without MediaRecorder is not told of")
    return wrong + [f"on the console: {message[:300]}" for message in browser.messages]


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--page", type=Path, required=True)
    options.add_argument("--silent", action="store_true", help="the page is without sound")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory(prefix="carom_film_") as folder, Browser(chosen.chromium, size=(640, 400)) as browser:
        try:
            wrong = check(browser, chosen.page, chosen.silent, Path(folder))
        except (RuntimeError, TimeoutError, subprocess.CalledProcessError) as error:
            wrong = [str(error)]
    print("\n".join(wrong) or "as expected")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
