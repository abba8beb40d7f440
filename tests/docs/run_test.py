#!/usr/bin/env python3
"""Runs the commands of the pages as a reader would, page by page from top to bottom, each page in a folder of its own
in which the folders of the repository stand. A command must end well, or be refused in the words that the page shows
below it, or be one of NOT_RUN.

    python3 tests/docs/run_test.py --carom build/check/carom [--page cli.md] [--verbose]
"""

import argparse
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from commands_test import LANGUAGES, command_lines
from pages import ROOT, pages, split

SECONDS = 120  # for one command
BUILDS = ("demo", "check", "release")  # in whose folders the pages find the command

# What a page takes for granted: made before its first command.
BEFORE = {
    "docs/cli.md": [
        "carom modes scenes/library/meshes/wrench.obj --material carbon_steel --modes 2 -o wrench.carom_modes",
    ],
    "docs/getting_started.md": ["carom record wood_blocks -o game.carom"],
    "docs/plugin.md": ["carom record scenes/library/marbles_in_a_box.json -o crash.carom"],
}

# Which commands are not run, and why.
NOT_RUN = [
    (r"\b(SCENE|FILE|WORLD|MODEL|TAP|PROGRAM|NAME|COMMAND|MESH)\b", "has a word for what is the reader's"),
    (r"\[[A-Z]|plan\|run|bash\|zsh", "lists what there is to choose from"),
    (r"\bcarom (video|view) ", "takes a browser or the page: tests of their own"),
    (r"\bcarom fit ", "takes a recording of the reader's: tests of its own"),
    (r"\bcarom report ", "takes minutes: tests of its own"),
    (r"\bcarom stability( --short)?$", "takes a minute: a test of its own"),
    (r"\bcarom-plugin\b", "takes Carom as it is installed: tests of their own"),
]

# The page says "--from 12", of a run that is longer than the one that is made here.
CHANGED = {"--from 12": "--from 0.5"}


def reason_not_to_run(text):
    return next((reason for pattern, reason in NOT_RUN if re.search(pattern, text)), None)


def shown_below(block, number):
    """Returns what the page shows below the command in that line, up to the next one."""
    lines = block.text.splitlines()[number - block.line + 1:]
    end = next((i for i, line in enumerate(lines) if re.match(r"\s*\$ ", line)), len(lines))
    return "\n".join(lines[:end]).strip()


def commands_of(page):
    """Returns line number, text and what is shown below it of each command of `carom`, and of each run of a compiler,
    of a page."""
    for block in split(page)[0]:
        if block.language not in LANGUAGES:
            continue
        for number, text in command_lines(block, also_refused=True):
            text = re.split(r"\s+#|\s+\| |\s{2,}", text)[0]
            if re.match(r"(?:build/[a-z]+/)?carom(?: |$)|g\+\+ ", text):
                yield number, text, shown_below(block, number)


def files_of(page):
    """Returns the files that the page tells its reader to write: "Put this into `NAME`:" and a block."""
    text = page.read_text(encoding="utf-8")
    return dict(re.findall(r"Put this into `([\w.]+)`:\n\n```\w*\n(.*?)```", text, re.S))


def prepare(folder, carom, page):
    """Makes the folder as the repository's own is after a build, with the files that the page takes for granted."""
    for name in ("scenes", "plugin", "docs", "tests"):
        (folder / name).symlink_to(ROOT / name)
    for name in BUILDS:
        (folder / "build" / name).mkdir(parents=True)
        (folder / "build" / name / "carom").symlink_to(carom)
    for name, text in files_of(page).items():
        (folder / name).write_text(text, encoding="utf-8")


def run(folder, text, shown):
    """Returns what went wrong, or None."""
    for words, instead in CHANGED.items():
        text = text.replace(words, instead)
    environment = {**os.environ, "PATH": f"{folder / 'build' / BUILDS[0]}:{os.environ['PATH']}"}
    try:
        done = subprocess.run(["bash", "-c", text], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                              capture_output=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return f"takes more than {SECONDS} s"
    said = done.stderr.decode(errors="replace").strip()
    if done.returncode == 0 or (done.returncode == 2 and said == shown):
        return None
    return f"exit status {done.returncode}: {said[-300:]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--carom", required=True, type=pathlib.Path, help="the command")
    parser.add_argument("--page", help="this page only")
    parser.add_argument("--verbose", action="store_true", help="prints each command with its seconds")
    options = parser.parse_args()
    ran, wrong, left = 0, 0, 0
    assert run(pathlib.Path.cwd(), f"{options.carom} rendr", "other words"), "a refusal goes unnoticed"
    for page in pages():
        name = str(page.relative_to(ROOT))
        if options.page and not name.endswith(options.page):
            continue
        with tempfile.TemporaryDirectory() as made:
            folder = pathlib.Path(made)
            prepare(folder, options.carom.resolve(), page)
            lines = [(0, text, "") for text in BEFORE.get(name, [])] + list(commands_of(page))
            for number, text, shown in lines:
                if reason_not_to_run(text):
                    left += 1
                    continue
                begin = time.monotonic()
                sentence = run(folder, text, shown)
                ran += 1
                if options.verbose:
                    print(f"{time.monotonic() - begin:6.1f} s  {name}:{number}: {text}", flush=True)
                if sentence:
                    print(f"{name}:{number}: {text}\n    {sentence}")
                    wrong += 1
    print(f"{ran} commands ran, {wrong} of them wrong; {left} are not run")
    if not options.page and ran < 40:
        raise SystemExit("few commands were found: has the form of the pages changed?")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
