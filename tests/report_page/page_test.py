#!/usr/bin/env python3
"""Opens a report page in headless Chromium and compares what it shows with the report inside it.

    page_test.py --chromium chromium --page index.html [--damaged]

What is expected is computed here, from the JSON in the page and without its script: points, Pareto fronts, players,
pictures, rows, and the number in every cell of the tables. Prints what differs; the exit status is then 1.
"""
import argparse
import base64
import html.parser
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# In the page's order: the first that any variant can be plotted by is shown.
MEASURES = ["waveform_error", "aligned_waveform_error", "local_waveform_error", "event_time_error.rms", "impulse_error.rms", "band_error_db",
            "energy_drift", "position_error"]
RELATIVE = {"waveform_error", "aligned_waveform_error", "band_error_db", "position_error"}  # of which the reference has none by definition
WORDS = {"label", "group"}
PREFIXES = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "µ": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}
SUPERSCRIPT = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


class Page(html.parser.HTMLParser):
    """What is looked at: attributes of <html>, the JSON elements, the tables' cells, and whatever could reach a network."""

    def __init__(self):
        super().__init__()
        self.root, self.json, self.cells, self.headers, self.reaching = {}, {}, {}, 0, []
        self.text, self.alert = None, ""
        self.scene, self.row, self.cell, self.in_alert = None, None, None, False

    def handle_starttag(self, tag, attributes):
        at = dict(attributes)
        if tag == "html":
            self.root = at
        if tag == "script" and at.get("type") == "application/json":
            self.text = (at.get("id"), [])
        if tag == "table":
            self.scene = at.get("data-scene")
        if tag == "tr":
            self.row = at.get("data-id")
        if tag == "th" and "aria-sort" in at:
            self.headers += 1
        if tag in ("td", "th") and "data-value" in at:
            self.cell = (self.scene, self.row, at["data-key"])
            self.cells[self.cell] = [at["data-value"], ""]
        self.in_alert = at.get("role") == "alert"
        self.look_for_network(tag, at)

    def look_for_network(self, tag, at):
        for name in ("src", "href", "srcset", "data", "poster", "action", "background"):
            value = at.get(name) or ""
            if value and not value.startswith(("data:", "#", "view_")):  # view_: the pages beside it
                self.reaching.append(f"<{tag} {name}={value[:80]!r}>")
        self.reaching += [f"<{tag} {name}> (a handler in an attribute)" for name in at if name.startswith("on")]

    def handle_endtag(self, tag):
        if tag == "script" and self.text:
            self.json[self.text[0]] = "".join(self.text[1])
            self.text = None
        if tag in ("td", "th"):
            self.cell = None
        self.in_alert = False

    def handle_data(self, data):
        if self.text:
            self.text[1].append(data)
        if self.cell:
            self.cells[self.cell][1] += data
        if self.in_alert:
            self.alert += data


def parse(text):
    page = Page()
    page.feed(text)
    page.close()
    return page


def at(value, path):
    for key in path.split("."):
        value = value.get(key) if isinstance(value, dict) else None
    return value


def points(scene, measure):
    """(id, run time, error) of whatever could be on the plot or is exact."""
    found = []
    for variant in scene["variants"]:
        error, time = at(variant, measure), at(variant, "run_time.total")
        if error is None and measure in RELATIVE and variant["id"] == scene["reference"]:
            error = 0
        if error is not None and time:
            found.append((variant["id"], time, abs(error)))
    return found


def plot(scene):
    """The points of the error that is shown first, and the Pareto front among them."""
    for measure in MEASURES:
        known = points(scene, measure)
        plotted = [p for p in known if p[2] > 0]
        if plotted:
            beaten = lambda p: any(q[1] <= p[1] and q[2] <= p[2] and q[1:] != p[1:] for q in known)
            return plotted, sorted((p for p in plotted if not beaten(p)), key=lambda p: p[1])
    return [], []


def pictures(media):
    """How many of the two pictures of a variant there are, and are whole."""
    wave, spectrum = media.get("waveform"), media.get("spectrogram")
    good = bool(wave) and len(wave["low"]) == len(wave["high"]) == wave["columns"]
    whole = bool(spectrum) and len(base64.b64decode(spectrum["data"])) == spectrum["columns"] * spectrum["rows"]
    return good + whole


def selected(scene, front):
    if front:
        return front[-1][0]
    others = [v["id"] for v in scene["variants"] if v["id"] != scene["reference"]]
    return others[0] if others else scene["reference"]


def canvases(scene, media, plotted, front):
    chosen = selected(scene, front)
    bands = next(v for v in scene["variants"] if v["id"] == chosen).get("bands")
    return bool(plotted) + bool(bands) + sum(pictures(media.get(f"{scene['name']}/{v}") or {}) for v in {scene["reference"], chosen})


def expected(report, media):
    scenes = report["scenes"]
    plots = {scene["name"]: plot(scene) for scene in scenes}
    variants = [(scene, variant) for scene in scenes for variant in scene["variants"]]
    return {
        "selftest": "done", "errors": "", "sorted": "ok",
        "scenes": len(scenes), "variants": len(variants), "rows": len(variants),
        "plotted": sum(len(plotted) for plotted, _ in plots.values()),
        "front": sum(len(front) for _, front in plots.values()),
        "clicks": sum(bool(plotted) for plotted, _ in plots.values()),
        "players": sum(bool((media.get(f"{s['name']}/{v['id']}") or {}).get("audio")) for s, v in variants),
        "canvases": sum(canvases(s, media, *plots[s["name"]]) for s in scenes),
    }, plots


def number(text):
    """The number that a cell shows, its unit (s, B, m, %, dB) taken into account."""
    match = re.fullmatch(r"([−\d.]+)(?:·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?(?:\u202f(dB|%|([fpnµmkMGT]?)(?:s|B|m)))?", text)
    if not match:
        return None
    mantissa, power, unit, prefix = match.groups()
    value = float(mantissa.replace("−", "-")) * 10.0 ** int((power or "0").translate(SUPERSCRIPT))
    return value / 100 if unit == "%" else value * PREFIXES[prefix or ""]


def shows(value, text, key):
    if key in WORDS:
        return text == value
    if value is None:
        return text == "–"
    read = number(text)
    return read is not None and abs(read - value) <= 0.0051 * abs(value)


def wrong_cells(page, report):
    """Every cell against the report; and no value may be without a cell."""
    wrong = []
    variants = {(scene["name"], variant["id"]): variant for scene in report["scenes"] for variant in scene["variants"]}
    for (scene, row, key), (held, text) in page.cells.items():
        value = at(variants.get((scene, row)), key)
        if json.loads(held) != value or not shows(value, text, key):
            wrong.append(f"{scene}, {row}, {key}: the page shows {text!r} (and holds {held}), the report has {value!r}")
    keys = {"run_time.total", "memory", *MEASURES}
    for (scene, row), variant in variants.items():
        wrong += [f"{scene}, {row}: {key} is not in the table" for key in keys if at(variant, key) is not None and (scene, row, key) not in page.cells]
    return wrong


def compare(page, original):
    report, media = (json.loads(original.json[name]) for name in ("carom-report", "carom-media"))
    wanted, plots = expected(report, media)
    wanted["sorts"] = 2 * page.headers
    wrong = [f"{name}: {page.root.get('data-' + name)!r}, expected {str(value)!r}" for name, value in wanted.items() if page.root.get("data-" + name) != str(value)]
    for name, index in (("plotted-ids", 0), ("front-ids", 1)):
        shown = json.loads(page.root.get("data-" + name) or "{}")
        for scene, lists in plots.items():
            ids = [point[0] for point in lists[index]]
            if sorted(shown.get(scene, [])) != sorted(ids):
                wrong.append(f"{name} of {scene}: {shown.get(scene)}, expected {ids}")
    wrong += [f"{name}: a picture is damaged" for name, item in media.items() if pictures(item) != bool(item.get("waveform")) + bool(item.get("spectrogram"))]
    return wrong + wrong_cells(page, report)


def dump(chromium, page, seconds):
    """The page's DOM after its self test. In a profile of its own, and no name resolves."""
    with tempfile.TemporaryDirectory(prefix="carom_page_") as profile:
        command = [chromium, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-dev-shm-usage", f"--user-data-dir={profile}",
                   "--host-resolver-rules=MAP * ~NOTFOUND", "--autoplay-policy=no-user-gesture-required", "--window-size=1280,1000",
                   "--virtual-time-budget=1000000", "--dump-dom", page.resolve().as_uri() + "#selftest"]
        # Chromium writes into its home, too.
        run = subprocess.run(command, capture_output=True, timeout=seconds, env={**os.environ, "HOME": profile}, check=False)
    if run.returncode != 0 or not run.stdout:
        sys.exit(f"{chromium} ended with {run.returncode}: {run.stderr.decode(errors='replace')[-600:]}")
    return run.stdout.decode("utf-8")


def check(arguments):
    text = arguments.page.read_text(encoding="utf-8")
    original = parse(text)
    wrong = [f"not self-contained: {what}" for what in original.reaching]
    wrong += [f"nothing was put in place of {what}" for what in re.findall(r"<!--carom:\w+-->", text)]
    if re.search(r"@import|url\(\s*['\"]?(?!data:)\w+:", "".join(re.findall(r"<style>.*?</style>", text, re.S))):
        wrong.append("not self-contained: its style loads something")
    page = parse(dump(arguments.chromium, arguments.page, arguments.timeout))
    if page.alert:
        return wrong + [f"the page says: {page.alert}"]
    try:
        return wrong + compare(page, original)
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        return wrong + [f"the report in the page is damaged: {error!r}"]


# What is done to a page, and what it then has to say.
DAMAGES = [
    ('"format":"carom report 1"', '"format":"carom report 9"', "format"),
    ('"format":"carom report 1"', '"format":', "not JSON"),
    ('"total":', '"total":"x","was":', "not a number"),
    ('id="carom-media"', 'id="carom-other"', "carom-media"),
]


def check_damaged(arguments):
    """A damaged page says so in one sentence, and shows nothing else."""
    text = arguments.page.read_text(encoding="utf-8")
    wrong = []
    for old, new, words in DAMAGES:
        if old not in text:
            wrong.append(f"{old!r} is not in the page: nothing was damaged")
            continue
        with tempfile.TemporaryDirectory(prefix="carom_page_") as folder:
            damaged = Path(folder) / "index.html"
            damaged.write_text(text.replace(old, new, 1), encoding="utf-8")
            alert = parse(dump(arguments.chromium, damaged, arguments.timeout)).alert
        if words not in alert:
            wrong.append(f"{old!r} made {new!r}: the page says {alert!r}, expected something of {words!r}")
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--chromium", default="chromium")
    parser.add_argument("--page", type=Path, required=True)
    parser.add_argument("--timeout", type=float, default=120, help="seconds for Chromium")
    parser.add_argument("--damaged", action="store_true", help="damage copies of the page, and look whether they say so")
    arguments = parser.parse_args()
    try:
        wrong = check_damaged(arguments) if arguments.damaged else check(arguments)
    except subprocess.TimeoutExpired:
        wrong = [f"Chromium did not end within {arguments.timeout:g} s"]
    for line in wrong[:40]:
        print(line)
    print(f"{arguments.page}: {len(wrong)} differences" if wrong else f"{arguments.page}: as expected")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
