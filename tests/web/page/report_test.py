#!/usr/bin/env python3
"""Follows a report's link to the page in which its variants are seen and heard, in headless Chromium.

    report_test.py --chromium chromium --report FOLDER

Prints what is not as it should be; the exit status is then 1.
"""
import argparse
import json
import sys
from pathlib import Path

from browser import Browser
from page_test import Claims

LOUDEST = """(async (index) => {
  const channels = await carom.renderOffline(0, carom.duration, {run: index, listener: 0});
  return channels.map((channel) => [...channel]);
})"""


def difference(one, two):
    """The energy of the difference over that of the first."""
    energy = sum(sample * sample for channel in one for sample in channel)
    return sum((a - b) ** 2 for left, right in zip(one, two) for a, b in zip(left, right)) / energy


def follow(browser, report, variant):
    """Selects a variant in the report, and returns where the link to the player leads."""
    browser.open(report / "index.html")
    browser.run(f"document.querySelector('tr[data-id=\"{variant}\"] [data-pick]').click()")
    return browser.run("document.querySelector('.player a').href")


def check(browser, report, claims):
    scene = json.loads((report / "report.json").read_text(encoding="utf-8"))["scenes"][0]
    ids = [variant["id"] for variant in scene["variants"]]
    claims.that(sorted(scene["shown"]) == sorted(ids), f"not all variants are shown: {scene['shown']}")
    reference, other = scene["reference"], "plain"
    address = follow(browser, report, other)
    claims.that(address.endswith(f"{scene['page']}#runs={reference},{other}"), f"the link leads to {address}")
    browser.open_address(address + "&t=0.25")
    browser.run("carom.ready")
    claims.that([run["id"] for run in browser.run("carom.runs")] == [reference, other], "the address does not choose the runs")
    claims.equal(browser.run("carom.time"), 0.25, "the time of the address")
    sounds = [browser.run(f"{LOUDEST}({index})") for index in (0, 1)]
    claims.that(difference(*sounds) > 0.1, "the two variants sound alike")
    listed = browser.run("[...document.querySelectorAll('#other-runs option')].map((option) => option.value).filter(Boolean)")
    claims.that(sorted(listed + [reference, other]) == sorted(ids), f"other runs: {listed}")
    browser.run("carom.run = 1")
    browser.load_by("const list = document.getElementById('other-runs'); list.value = 'game'; list.dispatchEvent(new Event('change'));")
    browser.run("carom.ready")
    claims.that(browser.run("carom.runs[1].id") == "game", "another run does not take the place of this one")
    claims.that(browser.run("carom.runs[0].id") == reference, "the other run of the two does not stay")
    browser.open(report / scene["page"])
    browser.run("carom.ready")
    claims.that(len(browser.run("carom.runs")) == 2, "without an address, not two runs are shown")
    claims.wrong += [f"on the console: {message[:300]}" for message in browser.messages]


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--chromium", default="chromium")
    options.add_argument("--report", type=Path, required=True)
    chosen = options.parse_args()
    claims = Claims()
    with Browser(chosen.chromium) as browser:
        try:
            check(browser, chosen.report, claims)
        except (RuntimeError, TimeoutError) as error:
            claims.wrong.append(str(error))
    for line in claims.wrong:
        print(line)
    print(f"{len(claims.wrong)} differences" if claims.wrong else f"as expected: {claims.count} claims")
    sys.exit(1 if claims.wrong else 0)


if __name__ == "__main__":
    main()
