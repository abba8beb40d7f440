#!/usr/bin/env python3
"""Opens a page of runs in headless Chromium, from a file, and compares what it does with what is in it.

    page_test.py --chromium chromium --template carom_view.html           the page made by hand (sample_page.py)
    page_test.py --chromium chromium --page marbles.html [--sound]        a page of `carom view`; with sound, if it has to sound

Prints what differs; the exit status is then 1.
"""
import argparse
import base64
import gzip
import json
import re
import struct
import sys
import tempfile
from itertools import accumulate
from operator import xor
from pathlib import Path

import sample_page
from browser import Browser

NEAR = 1e-6
TELL_PIXEL = """(async (places) => {
  const picture = new Image();
  picture.src = carom.screenshot();
  await picture.decode();
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [picture.width, picture.height];
  const pen = canvas.getContext('2d', {willReadFrequently: true});
  pen.drawImage(picture, 0, 0);
  const scale = picture.width / innerWidth;
  return places.map(([x, y]) => [...pen.getImageData(Math.round(x * scale), Math.round(y * scale), 1, 1).data.slice(0, 3)]);
})"""


class Claims:
    """What was expected and did not come true."""

    def __init__(self):
        self.wrong, self.count = [], 0

    def that(self, holds, words):
        self.count += 1
        if not holds:
            self.wrong.append(words)

    def equal(self, got, wanted, words, within=NEAR):
        self.that(isinstance(got, (int, float)) and abs(got - wanted) <= within, f"{words}: {got}, expected {wanted}")


def read_manifest(page):
    text = page.read_text(encoding="utf-8")
    manifest = json.loads(re.search(r'<script type="application/json" id="carom-page">(.*?)</script>', text, re.S).group(1))

    def blob(number):
        found = re.search(rf'<script type="application/octet-stream" id="carom-blob-{number}">(.*?)</script>', text, re.S)
        return gzip.decompress(base64.b64decode(found.group(1)))

    return manifest, blob


def reaches_out(page):
    """Attributes of the page, outside of its scripts, that would load something."""
    text = re.sub(r"<script\b.*?</script>", "", page.read_text(encoding="utf-8"), flags=re.S)
    found = re.findall(r'\b(?:src|href|srcset|data|poster|action)="(?!data:|#)[^"]+"', text)
    return found + re.findall(r"@import|url\((?!['\"]?(?:data:|#))[^)]*\)", text)


def rows_of(planes, width):
    """The rows of a table, which comes byte after byte of them, each XOR that of the row above."""
    count = len(planes) // width
    columns = [accumulate(planes[place * count:(place + 1) * count], xor) for place in range(width)]
    return bytes(value for row in zip(*columns) for value in row)


def expected_events(table):
    """Collisions from the table's rows, of which two shares are one."""
    rows = list(struct.iter_unpack("<14d", rows_of(table, 112)))
    found, seen = [], {}
    for row in rows:
        twin = (row[0], row[2], row[1], row[13])
        if seen.get(twin):
            seen[twin] -= 1
            continue
        key = (row[0], row[1], row[2], row[13])
        seen[key] = seen.get(key, 0) + 1
        found.append(row)
    return found


def check_events(browser, claims, run, blob):
    wanted = expected_events(blob(run["events"]["blob"])) if run.get("events") else []
    shown = browser.run("carom.events()")
    claims.that(len(shown) == len(wanted), f"{len(shown)} events, expected {len(wanted)}")
    for event, row in list(zip(shown, wanted))[:200]:
        claims.that(event["time"] == row[0] and {event["body"], event["other"]} == {int(row[1]), int(row[2])}, f"event {event['index']} is not row {row[:3]}")
    return wanted


def check_time(browser, claims, duration):
    """Seek, play and pause, and what keys do."""
    browser.run(f"carom.seek({duration / 3})")
    claims.equal(browser.run("carom.time"), duration / 3, "the time after a seek")
    browser.run("carom.seek(-1)")
    claims.equal(browser.run("carom.time"), 0, "the time after a seek before the beginning")
    browser.run("document.activeElement.blur()")
    browser.key(" ")
    claims.that(browser.wait("carom.playing && carom.time > 0"), "the space bar does not play")
    browser.key(" ")
    claims.that(browser.wait("!carom.playing"), "the space bar does not pause")
    browser.key(" ", repeats=3)
    claims.that(browser.wait("carom.playing", 3), "a space bar that is held does not play, or pauses again")
    browser.key(" ")
    claims.that(browser.wait("!carom.playing"), "the space bar does not pause again")
    before = browser.run("carom.time")
    claims.equal(browser.run("new Promise((resolve) => setTimeout(() => resolve(carom.time), 150))"), before, "the time goes on in a pause")
    browser.key("End", "End")
    claims.equal(browser.run("carom.time"), duration, "the time after the key End")
    browser.key("Home", "Home")
    claims.equal(browser.run("carom.time"), 0, "the time after the key Home")
    browser.key("ArrowRight")
    claims.equal(browser.run("carom.time"), duration / 50, "the time after an arrow")


def check_steps(browser, claims, wanted):
    """From event to event, by key; the panel tells who and when."""
    times = sorted({row[0] for row in wanted})
    if len(times) < 2:
        return
    browser.run("carom.seek(0)")
    browser.key("]", "BracketRight")
    first = browser.run("carom.time")
    claims.equal(first, times[0], "the time of the first step", 1e-9)
    text = browser.run("document.getElementById('panel').innerText")
    claims.that(f"{times[0]:.6f}"[:5] in text and "dB" in text, f"the panel of an event says {text!r}")
    browser.run(f"carom.select({len(wanted) - 1})")
    claims.equal(browser.run("carom.time"), wanted[-1][0], "the time of the last event", 1e-9)
    browser.key("Escape")
    claims.that(browser.run("document.getElementById('panel').hidden"), "Escape does not close the panel")


def check_speed(browser, claims, duration):
    browser.run("carom.seek(0); carom.speed = 0.01")
    browser.run("carom.play()")
    claims.that(browser.wait("carom.time > 0"), "it does not play slowly")
    moved = browser.run("new Promise((resolve) => { const from = carom.time; setTimeout(() => resolve(carom.time - from), 600); })")
    browser.run("carom.pause(); carom.speed = 1")
    claims.that(0 < moved < 0.05, f"{moved} s went by in 0.6 s at a hundredth of the speed, expected 0.006")


def check_loop(browser, claims, duration):
    """A loop by shift and drag on the time line, and by key."""
    browser.run("carom.seek(0)")
    box = browser.run("(() => { const {left, top, width, height} = document.getElementById('line').getBoundingClientRect(); return [left, top, width, height]; })()")
    y = box[1] + 4
    browser.drag((box[0] + 0.25 * box[2], y), (box[0] + 0.5 * box[2], y), shift=True)
    claims.that(browser.run("!document.getElementById('range').hidden && document.getElementById('loop').getAttribute('aria-pressed') === 'true'"), "shift and drag makes no loop")
    claims.equal(browser.run("carom.time") / duration, 0.25, "the loop's beginning", 0.02)
    browser.run("document.activeElement.blur()")
    browser.key("l")
    claims.that(browser.run("document.getElementById('range').hidden"), "the key L does not end the loop")
    browser.drag((box[0] + 0.1 * box[2], y), (box[0] + 0.8 * box[2], y))
    claims.equal(browser.run("carom.time") / duration, 0.8, "the time after a drag on the time line", 0.02)


def check_picture(browser, claims, run, least):
    """Moving spheres have their own hue where the projection says, unless another body is before them."""
    spheres = [body for body in run["bodies"] if body["form"]["kind"] == "sphere" and body["moves"]][:12]
    if not spheres:
        return
    browser.run("carom.seek(0.1)")
    near, checked = 0, 0
    for body in spheres:
        asked = browser.run(f"""(() => {{
          const pose = carom.pose({body['id']}), [x, y] = carom.project(pose.slice(0, 3));
          return {{x, y, picked: carom.pick(x, y), colour: carom.colour({body['id']})}};
        }})()""")
        if asked["picked"] != body["id"] or not (8 < asked["x"] < 1272 and 8 < asked["y"] < 560):
            continue
        # The marking is darker than the rest: the nearest of several places counts.
        spread = [(asked["x"] + dx, asked["y"] + dy) for dx in (-3, 0, 3) for dy in (-3, 0, 3)]
        pixels = browser.run(f"{TELL_PIXEL}({json.dumps(spread)})")
        checked += 1
        near += min(hue_distance(pixel, asked["colour"]) for pixel in pixels) < 0.2
    claims.that(checked >= min(least, len(spheres)), f"only {checked} of {len(spheres)} spheres are seen")
    claims.that(near >= 0.8 * checked, f"only {near} of {checked} spheres have their colour where they are")


def hue_distance(one, two):
    """How far two colours differ but for lightness."""
    parts = [[value / max(1, sum(colour)) for value in colour] for colour in (one, two)]
    return sum(abs(a - b) for a, b in zip(*parts))


def check_runs(browser, claims, count):
    if count < 2:
        return
    browser.run("carom.seek(0.5)")
    browser.key("2", "Digit2")
    claims.that(browser.wait("carom.run === 1"), "the key 2 does not switch to the second run")
    claims.equal(browser.run("carom.time"), 0.5, "the time after a switch of runs")
    browser.run("carom.run = 0")
    claims.that(browser.wait("carom.run === 0"), "the first run does not come back")


def check_sheets(browser, claims):
    browser.key("?", "Slash", shift=True)
    claims.that(browser.run("document.getElementById('help').open"), "the key ? shows no help")
    browser.key("Escape")
    claims.that(browser.wait("!document.getElementById('help').open", 3), "Escape does not close the help")
    browser.run("document.getElementById('open-about').click()")
    text = browser.run("document.getElementById('about').textContent")
    for name in ("three.js", "LLVM Exceptions", "Highway", "Mozilla Public License", "KEMAR", "Bullet", "JSON for Modern C++", "the Carom authors"):
        claims.that(name in text, f"the notices lack {name}")
    browser.run("document.getElementById('about').close()")
    nameless = browser.run("[...document.querySelectorAll('button, input')].filter((item) => !(item.getAttribute('aria-label') || item.textContent.trim())).length")
    claims.that(nameless == 0, f"{nameless} buttons have no name")


def check_sound(browser, claims, run):
    """Offline renders are finite, repeat, and sound; live sound goes on after a seek, and is never late."""
    sums = browser.run("""(async () => {
      const length = Math.min(0.5, carom.duration);
      const one = await carom.renderOffline(0, length), two = await carom.renderOffline(0, length);
      const all = one.flatMap((channel) => [...channel]);
      return {channels: one.length, frames: one[0].length, finite: all.every(Number.isFinite), same: one.every((channel, at) => channel.every((value, frame) => value === two[at][frame])),
              energy: (await carom.renderOffline(0, Math.min(2, carom.duration))).reduce((sum, channel) => channel.reduce((most, value) => Math.max(most, Math.abs(value)), sum), 0)};
    })()""")
    claims.that(sums["finite"] and sums["same"], f"renders are not finite, or differ: {sums}")
    claims.that(sums["energy"] > 0 and sums["channels"] >= 1, f"a render is silent: {sums}")
    browser.run("carom.seek(0)")
    browser.run("carom.play()")
    claims.that(browser.wait("carom.time > 0.05 && carom.seekDelay !== null", 30), "live sound does not go on")
    delays = []
    for part in (0.2, 0.4, 0.1, 0.3):
        browser.run(f"carom.seek({part} * carom.duration)")
        browser.run("new Promise((resolve) => setTimeout(resolve, 400))")
        delays.append(browser.run("carom.seekDelay"))
    late = browser.run("carom.late")
    browser.run("carom.pause()")
    print(f"a seek sounds after {', '.join(f'{delay:.0f}' for delay in delays)} ms; late: {late}")
    claims.that(late == 0, f"{late} events were late")
    claims.that(all(delay is not None and delay >= 0 for delay in delays), f"a seek does not sound: {delays}")


def check_opening(browser, claims, page, count):
    """What is pressed while the sound opens, of a page that has just been loaded."""
    sounds = "carom.playing && carom.seekDelay !== null && carom.time > 0.02"
    for script, words in (("carom.play(); carom.play()", "a second press while the sound opens ends it"),
                          ("carom.play(); carom.run = 1", "a run that is chosen while the sound opens is not heard")):
        if "run" in script and count < 2:
            continue
        browser.open(page)
        browser.run("carom.ready")
        browser.run("carom.speed = 0.1")
        browser.run(f"{script}; 0")
        claims.that(browser.wait(sounds, 30), words)
        claims.that(browser.run("carom.run") == (1 if "run" in script else 0), "another run is shown than was chosen")
        browser.run("carom.pause()")


def check_silence(browser, claims):
    refused = browser.run("carom.renderOffline(0, 0.1).then(() => '', (error) => error.message)")
    claims.that("without sound" in refused or "no sound" in refused, f"a page without sound renders, or says {refused!r}")
    claims.that("without sound" in browser.run("document.getElementById('heard-words').textContent").lower(), "a page without sound does not say so")


def check(browser, page, sound, claims):
    manifest, blob = read_manifest(page)
    run = manifest["runs"][0]
    claims.wrong += [f"not self-contained: {what}" for what in reaches_out(page)]
    browser.open(page)
    browser.run("carom.ready")
    print(f"ready after {browser.run('performance.now()'):.0f} ms, {page.stat().st_size} bytes")
    claims.that(browser.run("carom.version") == manifest["version"], "the version is another")
    claims.equal(browser.run("carom.duration"), run["duration"], "the duration")
    claims.that(browser.run("document.title").startswith(manifest["title"]), "the title is another")
    wanted = check_events(browser, claims, run, blob)
    check_picture(browser, claims, run, 3)
    check_time(browser, claims, run["duration"])
    check_steps(browser, claims, wanted)
    check_loop(browser, claims, run["duration"])
    check_speed(browser, claims, run["duration"])
    check_runs(browser, claims, len(manifest["runs"]))
    check_sheets(browser, claims)
    if sound:
        check_sound(browser, claims, run)
        check_opening(browser, claims, page, len(manifest["runs"]))
    elif run.get("sound") is None:
        check_silence(browser, claims)
    outside = [address for address in browser.requests if not address.startswith(("file:", "data:", "blob:"))]
    others = [address for address in browser.requests if address.startswith("file:") and not address.startswith(page.resolve().as_uri())]
    claims.wrong += [f"a request to {address[:80]}" for address in outside + others]
    claims.wrong += [f"on the console: {message[:300]}" for message in browser.messages]


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--template", type=Path)
    options.add_argument("--page", type=Path)
    options.add_argument("--sound", action="store_true", help="the page has to sound")
    options.add_argument("--timeout", type=float, default=60, help="seconds for each answer of Chromium")
    chosen = options.parse_args()
    claims = Claims()
    with tempfile.TemporaryDirectory(prefix="carom_page_") as folder, Browser(chosen.chromium, seconds=chosen.timeout) as browser:
        page = chosen.page
        if page is None:
            page = Path(folder) / "sample.html"
            text, _ = sample_page.make_page(chosen.template.read_text(encoding="utf-8"), sample_page.parser().parse_args([]))
            page.write_text(text, encoding="utf-8")
        try:
            check(browser, page, chosen.sound, claims)
        except (RuntimeError, TimeoutError) as error:
            claims.wrong.append(str(error))
    for line in claims.wrong[:40]:
        print(line)
    print(f"{len(claims.wrong)} differences" if claims.wrong else f"as expected: {claims.count} claims")
    sys.exit(1 if claims.wrong else 0)


if __name__ == "__main__":
    main()
