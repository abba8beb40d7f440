#!/usr/bin/env python3
"""Plays with live runs in headless Chromium: mouse, keys and window.carom.live, against what mechanics says.

    live_test.py --chromium chromium --carom carom --template carom_view.html

Prints what differs; the exit status is then 1.
"""
import argparse
import base64
import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from browser import Browser

GRAVITY = 9.81
LIBRARY = Path(__file__).resolve().parents[3] / "scenes" / "library"
COURT = {
    "name": "court", "duration": 1,
    "bodies": [{"type": "plane", "name": "floor", "normal": [0, 1, 0], "offset": 0, "material": "wood"},
               {"type": "sphere", "name": "marble", "radius": 0.02, "material": "glass", "position": [0.1, 0.3, 0]},
               {"type": "spheres", "name": "shots", "count": 3, "radius": [0.01, 0.015], "material": ["steel", "ceramic"],
                "min": [-0.4, 0.2, -0.2], "max": [-0.2, 0.5, 0.2]}],
    "listeners": [{"name": "seat", "position": [0, 0.4, 0.8]}],
}
# Keeps what the worklet tells that it has sounded.
LISTEN = """window.heard = [];
window.AudioWorkletNode = class extends AudioWorkletNode {
  constructor(...given) {
    super(...given);
    this.port.addEventListener('message', ({data}) => data.type === 'at' && data.samples.length && heard.push(data));
  }
};"""
# Samples of the latest sound from `begin` on, one after the other.
HEARD = """(() => {
  const {id} = heard.at(-1), parts = heard.filter((item) => item.id === id);
  const samples = parts.flatMap((item) => [...item.samples]);
  return {begin: parts[0].begin, samples};
})()"""


class Claims:
    def __init__(self):
        self.wrong, self.count = [], 0

    def that(self, holds, words):
        self.count += 1
        if not holds:
            self.wrong.append(words)

    def near(self, got, wanted, within, words):
        far = max((abs(one - two) for one, two in zip(got, wanted)), default=math.inf)
        self.that(len(got) == len(wanted) and far <= within, f"{words}: {got}, expected {wanted}, which is {far:.2g} away")


def make_page(chosen, scene, folder):
    page = folder / (scene.stem + ".html")
    subprocess.run([chosen.carom, "view", scene, "--template", chosen.template, "--no-open", "-o", page], check=True, stdout=subprocess.DEVNULL)
    return page


def flight(place, velocity, gravity, seconds):
    return [x + v * seconds + g * seconds * seconds / 2 for x, v, g in zip(place, velocity, (0, -gravity, 0))]


def begin_by_mouse(browser, claims):
    """The button starts the run, which sounds and goes on; nothing is late."""
    box = browser.run("(() => { const {left, top, width, height} = document.getElementById('begin-live').getBoundingClientRect(); return [left + width / 2, top + height / 2]; })()")
    browser.click(*box)
    claims.that(browser.wait("carom.live.running && carom.playing && carom.time > 0.5"), "the button does not start a live run that goes on")
    claims.that(browser.run("carom.live.head > carom.time"), "the mechanics is not ahead of what is seen")
    claims.that(browser.run("carom.live.late") == 0, "events came too late")
    claims.that(browser.run("!document.getElementById('live-bar').hidden"), "the tools are not shown")


def throw(browser, place, velocity, **more):
    given = json.dumps({"shape": "sphere", "size": 0.02, "material": "steel", "position": place, "velocity": velocity, **more})
    return browser.run(f"carom.live.throw({given})")


def pose(browser, body, seconds):
    return browser.run(f"carom.seek({seconds}), carom.pose({body}).slice(0, 3)")


def check_flight(browser, claims, stepper, within):
    """A body that is thrown is where its parabola says, and lands where and when it says."""
    place, velocity = [0, 0.4, 0.3], [0.5, 1.2, 0.1]
    browser.run(f"(async () => {{ carom.pause(); await carom.live.start(); carom.live.set({{stepper: '{stepper}', step: 1 / 1000}}); }})()")
    body = throw(browser, place, velocity)
    browser.run("carom.live.advance(0.8)")
    for seconds in (0.1, 0.25, 0.4):
        claims.near(pose(browser, body, seconds), flight(place, velocity, GRAVITY, seconds), within, f"{stepper}: at {seconds} s")
    landing = (velocity[1] + math.sqrt(velocity[1] ** 2 + 2 * GRAVITY * (place[1] - 0.01))) / GRAVITY
    events = browser.run(f"carom.events().filter((event) => event.body === {body} || event.other === {body})")
    claims.that(bool(events), f"{stepper}: it does not land")
    if not events:
        return
    claims.near([events[0]["time"]], [landing], within / 2, f"{stepper}: the time of its landing")
    x, _, z = flight(place, velocity, GRAVITY, landing)
    claims.near([events[0]["position"][0], events[0]["position"][2]], [x, z], within, f"{stepper}: the place of its landing")


def check_bits(browser, claims):
    same = browser.run("""(async () => {
      const renders = [await carom.renderOffline(0, 0.8), await carom.renderOffline(0, 0.8)];
      carom.seek(0.3);
      renders.push(await carom.renderOffline(0, 0.8));
      const [first] = renders;
      return {loud: first[0].some((sample) => Math.abs(sample) > 1e-4),
              same: renders.every((render) => render.every((plane, channel) => plane.every((sample, at) => sample === first[channel][at])))};
    })()""")
    claims.that(same["loud"], "an offline render of the live run is silent")
    claims.that(same["same"], "two renders of one live run differ")


def check_heard(browser, claims):
    """What sounded while it went on is what a render of it has; a throw on the way is heard, too."""
    browser.run("(async () => { carom.setEar([0.1, 0.4, 0.9]); carom.setFormat('mono'); await carom.live.start(); await carom.play(); })()")
    claims.that(browser.wait("carom.time > 0.4"), "the live run does not go on")
    bodies = browser.run("carom.live.sceneJson().bodies.length")
    browser.run("document.activeElement.blur()")
    browser.key("r")
    claims.that(browser.run("carom.live.sceneJson().bodies.length") == bodies + 1, "the key R throws nothing")
    claims.that(browser.wait("carom.time > 1.5"), "the live run does not go on after a throw")
    browser.run("carom.pause()")
    claims.that(browser.run("carom.live.late") == 0, "events came too late")
    told = browser.run(f"""(async () => {{
      const {{begin, samples}} = {HEARD};
      const [plane] = await carom.renderOffline(0, begin + samples.length / 48000);
      const first = Math.round(begin * 48000);
      let far = 0, peak = 0;
      for (let at = 0; at < samples.length; ++at) {{
        far = Math.max(far, Math.abs(samples[at] - plane[first + at]));
        peak = Math.max(peak, Math.abs(plane[first + at]));
      }}
      return {{begin, count: samples.length, far, peak}};
    }})()""")
    claims.that(told["begin"] == 0 and told["count"] > 48000 and told["peak"] > 1e-4, f"what was heard is {told}")
    claims.that(told["far"] <= 1e-6 * told["peak"], f"what was heard differs from a render: {told}")


def check_gravity(browser, claims):
    browser.run("carom.pause(), carom.live.rewind(0), carom.live.set({gravity: 0})")
    body = throw(browser, [0.3, 0.5, 0.3], [0.2, 0.1, 0])
    browser.run("carom.live.advance(0.5)")
    claims.near(pose(browser, body, 0.4), [0.38, 0.54, 0.3], 1e-5, "without gravity, at 0.4 s")
    browser.run("carom.seek(0.2), carom.live.set({gravity: -5})")
    head = browser.run("carom.live.head")
    claims.that(abs(head - 0.2) < 0.02, f"a change in the past acts at {head} s, expected 0.2")
    browser.run("carom.live.advance(0.3)")
    rise = 2.5 * 0.2 ** 2
    claims.near(pose(browser, body, head + 0.2), [0.3 + 0.2 * (head + 0.2), 0.5 + 0.1 * (head + 0.2) + rise, 0.3], 1e-3, "with gravity upwards")


def check_length(browser, claims):
    """A run that is too long for the page's memory stops with a sentence, and goes on from where it is rewound to."""
    told = browser.run("""(() => {
      const {live} = carom;
      carom.pause();
      live.rewind(0.1);
      const {head, size, most} = live;
      live.most = size + 10000;
      live.advance(100);
      const end = live.head, full = live.size, words = document.getElementById('live-words').textContent;
      live.rewind(0.1);
      const again = live.size;
      live.advance(0.1);
      live.most = most;
      return {words, head, size, end, full, again, later: live.head};
    })()""")
    claims.that(told["words"].startswith("The run is as long as the page can hold."), f"a run that is full: {told['words']}")
    claims.that(told["head"] < told["end"] < 100 and told["size"] + 10000 < told["full"] < told["size"] + 100000, f"it is full at {told}")
    claims.that(told["again"] == told["size"] and told["later"] > told["head"] + 0.09, f"and goes on after a rewind: {told}")


def check_hand(browser, claims):
    """The mouse draws a body; where it is let go it flies on. A scrub into the past and the key G take back what came later."""
    browser.run("carom.live.rewind(0), carom.live.set({gravity: 0}), carom.live.set({gravity: 9.81})")
    # What is pressed is what was drawn last: two pictures later that is the place that is asked for.
    browser.run("(async () => { carom.live.advance(1.5); carom.seek(carom.live.head); for (let i = 0; i < 2; ++i) await new Promise(requestAnimationFrame); })()")
    x, y = browser.run("carom.project(carom.pose(1))")
    before = browser.run("carom.pose(1)")
    browser.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
    for step in range(1, 9):
        browser.mouse("mouseMoved", x + 10 * step, y - 14 * step, button="left", buttons=1)
        time.sleep(0.05)
    lifted = browser.wait(f"carom.pose(1)[1] > {before[1] + 0.05}", 10)
    claims.that(lifted, f"the mouse does not lift a body: {before} {browser.run('carom.pose(1)')}")
    browser.mouse("mouseReleased", x + 80, y - 112, button="left", clickCount=1)
    claims.that(browser.wait(f"carom.pose(1)[1] < {before[1] + 0.02}", 15), "a body that is let go does not fall")
    browser.run("carom.pause()")
    head = browser.run("carom.live.head")
    box = browser.run("(() => { const {left, top, width} = document.getElementById('line').getBoundingClientRect(); return [left, top, width]; })()")
    browser.drag((box[0] + 0.5 * box[2], box[1] + 4), (box[0] + 0.1 * box[2], box[1] + 4))
    claims.that(browser.wait("carom.live.past && !document.getElementById('go-on').hidden"), "there is no way to go on from the past")
    seen = browser.run("carom.time")
    browser.run("document.activeElement.blur()")
    browser.key("g")
    claims.that(browser.wait(f"carom.playing && !carom.live.past && carom.time < {head}"), "the key G does not go on from the past")
    claims.that(browser.wait(f"carom.time > {seen} + 0.2"), "after the key G time stands")
    claims.that(browser.run("carom.live.late") == 0, "events came too late after a rewind")
    browser.run("carom.pause()")


def check_file(browser, claims, chosen, folder):
    data = base64.b64decode(browser.run("(async () => { const bytes = carom.live.runFile(); let text = ''; for (const byte of bytes) text += String.fromCharCode(byte); return btoa(text); })()"))
    claims.that(data.startswith(b"caromrun"), f"the run's file begins with {data[:8]!r}")
    file = folder / "court_live.carom"
    file.write_bytes(data)
    done = subprocess.run([chosen.carom, "replay", file, "-o", folder / "court_live.wav"], capture_output=True, text=True)
    claims.that(done.returncode == 0, f"carom replay refuses the run: {done.stderr.strip()}")


def check_link(browser, claims):
    """A link has the scene as it is: in a fresh page all bodies are where they were."""
    told = browser.run("""(async () => {
      carom.live.set({restitution: 0.5, friction: 0.2});
      const scene = carom.live.sceneJson(), link = await carom.live.link();
      return {scene, link, gravity: carom.live.settings.gravity};
    })()""")
    browser.open_address("about:blank")
    browser.open_address(told["link"])
    browser.run("carom.ready")
    claims.that(browser.run("carom.live.running && carom.runs.length === 1"), "a link does not start its scene live")
    again = browser.run("(carom.pause(), carom.live.rewind(0), carom.live.sceneJson())")
    bodies = [body for body in told["scene"]["bodies"] if "position" in body]
    others = {body["name"]: body for body in again["bodies"]}
    for body in bodies:
        for key in ("position", "velocity"):
            claims.near(others.get(body["name"], {}).get(key, []), body[key], 1e-6, f"{body['name']}: {key} after a link")
    claims.near(again["gravity"], told["gravity"], 1e-12, "gravity after a link")
    claims.that(len(bodies) > 4 and all("(live)" in body["material"] for body in bodies), "the link has not the bodies and settings that were chosen")


def check_jello(browser, claims, page):
    """The mouse draws a jello."""
    browser.open(page)
    browser.run("carom.ready")
    browser.run("(async () => { await carom.live.start(); carom.live.advance(1); carom.seek(0.9); })()")
    found = browser.run(f"""(() => {{
      for (let y = 80; y < innerHeight - 240; y += 20) for (let x = 40; x < innerWidth; x += 20) if (carom.pick(x, y) === 6) return [x, y];
      return null;
    }})()""")
    claims.that(found is not None, "the jello is not seen")
    if not found:
        return
    x, y = found[0] + 30, found[1] + 30
    before = browser.run("carom.live.middle(6)")
    browser.mouse("mousePressed", x, y, button="left", buttons=1, clickCount=1)
    for step in range(1, 7):
        browser.mouse("mouseMoved", x + 40 * step, y, button="left", buttons=1)
        time.sleep(0.1)
    moved = browser.wait(f"Math.hypot(...carom.live.middle(6).map((part, axis) => part - {json.dumps(before)}[axis])) > 0.05", 15)
    claims.that(moved, f"the mouse does not draw the jello: {before}, {browser.run('carom.live.middle(6)')}")
    browser.mouse("mouseReleased", x + 240, y, button="left", clickCount=1)
    claims.that(browser.run("carom.live.late") == 0, "states of the jello came too late")
    browser.run("carom.pause()")


def check_files(browser, claims, page, same):
    """A scene that names meshes moves and rings as the page's own run does; its files' names are kept. The first `same` events are alike."""
    browser.open(page)
    browser.run("carom.ready")
    told = browser.run("""(async () => {
      carom.setEar([0.3, 0.5, 0.8]);
      carom.setFormat('mono');
      const level = ([plane]) => 10 * Math.log10(plane.reduce((sum, sample) => sum + sample * sample, 0) / plane.length);
      const events = () => carom.events().filter(({time}) => time < 1).map(({time, impulse}) => [time, impulse]);
      const own = {events: events(), level: level(await carom.renderOffline(0, 1))};
      await carom.live.start();
      carom.pause();
      carom.live.advance(1.2);
      const live = {events: events(), level: level(await carom.renderOffline(0, 1))};
      const link = await (async () => carom.live.link())().catch((error) => error.message);
      return {own, live, link, file: carom.live.sceneJson().bodies.map(({shape}) => shape?.file).filter((file) => file)};
    })()""")
    own, live = told["own"], told["live"]
    claims.that(min(len(own["events"]), len(live["events"])) >= same, f"{page.stem}: {len(live['events'])} events, expected {len(own['events'])}")
    for one, other in zip(live["events"][:same], own["events"]):
        claims.that(abs(one[0] - other[0]) < 1e-6 and abs(one[1] / other[1] - 1) < 1e-4, f"{page.stem}: an event {one}, expected {other}")
    claims.near([live["level"]], [own["level"]], 0.5, f"{page.stem}: level in dB")
    claims.that(told["file"] and all(file.startswith("meshes/") for file in told["file"]), f"{page.stem}: its JSON names {told['file']}")
    claims.that(told["link"].startswith("A link holds no files"), f"{page.stem}: a link is {told['link'][:60]}")


def check(browser, claims, chosen, folder):
    scene = folder / "court.json"
    scene.write_text(json.dumps(COURT), encoding="utf-8")
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=LISTEN)
    steps = [(begin_by_mouse,), (check_flight, "native", 1e-4), (check_flight, "bullet", 5e-3), (check_bits,), (check_heard,), (check_gravity,), (check_hand,),
             (check_file, chosen, folder), (check_length,), (check_link,)]
    browser.open(make_page(chosen, scene, folder))
    browser.run("carom.ready")
    for step, *given in steps:
        begin = time.monotonic()
        step(browser, claims, *given)
        print(f"{step.__name__}: {time.monotonic() - begin:.1f} s, {len(claims.wrong)} differences")
    check_jello(browser, claims, make_page(chosen, LIBRARY / "jello_drop.json", folder))
    # The tumbler rattles on the plate, where the last digit of a sine, not that of the mesh, soon decides what it meets.
    for name, same in (("dropped_wrench", 6), ("glass_and_plate", 4)):
        check_files(browser, claims, make_page(chosen, LIBRARY / f"{name}.json", folder), same)
    claims.wrong += [f"a request to {address[:80]}" for address in browser.requests if not address.startswith(("data:", "blob:", "file:", "about:"))]
    claims.wrong += [f"on the console: {message[:300]}" for message in browser.messages]


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--template", type=Path, required=True)
    options.add_argument("--carom", type=Path, required=True)
    options.add_argument("--timeout", type=float, default=60, help="seconds for each answer of Chromium")
    chosen = options.parse_args()
    claims = Claims()
    with tempfile.TemporaryDirectory(prefix="carom_live_") as folder, Browser(chosen.chromium, seconds=chosen.timeout) as browser:
        try:
            check(browser, claims, chosen, Path(folder))
        except (RuntimeError, TimeoutError) as error:
            claims.wrong.append(str(error))
    for line in claims.wrong[:40]:
        print(line)
    print(f"{len(claims.wrong)} differences" if claims.wrong else f"as expected: {claims.count} claims")
    sys.exit(1 if claims.wrong else 0)


if __name__ == "__main__":
    main()
