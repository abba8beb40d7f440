#!/usr/bin/env python3
"""Makes the page of every scene of the library, opens each in headless Chromium, and tells what it does. By hand: it takes some minutes.

    library_pages.py --carom build/demo/carom --template build/web/web/carom_view.html --out FOLDER [SCENE...] [--light] [--phone]

A line for each scene: bytes; ms until it is ready; five seeks, ms; events that came late; s to render all of it without drawing;
requests and messages, of which there may be none. FOLDER gets a picture of each, where most is to be seen.
"""
import argparse
import base64
import subprocess
import sys
from pathlib import Path

from browser import Browser

LIBRARY = Path(__file__).resolve().parents[3] / "scenes" / "library"
BUSIEST = "(() => { const e = carom.events(); return e.length ? e[Math.floor(e.length / 3)].time : carom.duration / 3; })()"


def look(page, picture, chosen):
    size = (390, 844) if chosen.phone else (1280, 800)
    with Browser(chosen.chromium, size=size, dark=not chosen.light, touch=chosen.phone, seconds=120, scale=2 if chosen.phone else 1) as browser:
        browser.open(page)
        browser.run("carom.ready")
        ready = browser.run("performance.now()")
        duration = browser.run("carom.duration")
        busiest = browser.run(BUSIEST)
        seeks = []
        if browser.run("carom.sounds"):
            browser.run("carom.seek(0); carom.play()")
            browser.wait("carom.playing && carom.seekDelay !== null")
            for share in (0.6, 0.3, 0.8, 0.1, 0.5):
                browser.run(f"carom.seek({share * duration})")
                browser.run("new Promise((done) => setTimeout(done, 400))")
                seeks.append(browser.run("carom.seekDelay"))
        late = browser.run("carom.late")
        browser.run(f"carom.seek({busiest})")
        browser.run("new Promise((done) => setTimeout(done, 1500))")
        browser.run("carom.pause()")
        took = browser.run(f"""(async () => {{ const begin = performance.now(); await carom.renderOffline(0, {duration});
                           return (performance.now() - begin) / 1000; }})()""")
        shot = browser.call("Page.captureScreenshot", format="png")
        picture.write_bytes(base64.b64decode(shot["data"]))
        outside = [address for address in browser.requests if not address.startswith(("file:", "data:", "blob:"))]
        return {"ready": ready, "seeks": seeks, "late": late, "render": took, "of": duration,
                "wrong": [f"request {address[:60]}" for address in outside] + [f"console: {text[:120]}" for text in browser.messages]}


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("scenes", nargs="*", help="names; default: all of the library")
    options.add_argument("--carom", required=True)
    options.add_argument("--template", required=True, type=Path)
    options.add_argument("--out", required=True, type=Path)
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--light", action="store_true")
    options.add_argument("--phone", action="store_true")
    options.add_argument("--compare", action="store_true", help="both runs of each scene, where it has two")
    chosen = options.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    failed = False
    for scene in chosen.scenes or sorted(path.stem for path in LIBRARY.glob("*.json")):
        page = chosen.out / f"{scene}.html"
        command = [chosen.carom, "view", str(LIBRARY / f"{scene}.json"), "--template", str(chosen.template), "--no-open", "-o", str(page)]
        made = subprocess.run(command + ["--compare"] * chosen.compare, capture_output=True, text=True)
        if made.returncode:
            print(f"{scene}: {made.stderr.strip().splitlines()[-1]}", flush=True)
            failed = failed or not chosen.compare
            continue
        told = look(page, chosen.out / f"{scene}.png", chosen)
        failed = failed or bool(told["wrong"]) or told["late"] > 0
        seeks = " ".join(f"{ms:.0f}" for ms in told["seeks"])
        print(f"{scene}: {page.stat().st_size / 1e6:.2f} MB, ready {told['ready']:.0f} ms, seeks {seeks} ms, {told['late']} late, "
              f"{told['render']:.2f} s to render {told['of']:.1f} s{''.join('; ' + text for text in told['wrong'])}", flush=True)
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
