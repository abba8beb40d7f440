#!/usr/bin/env python3
"""Every command line of the pages that a reader can copy names what there is: commands and options of `carom`,
by its own help; scripts, their benchmarks, presets, and files of the repository.

    python3 tests/docs/commands_test.py --carom build/check/carom
"""

import argparse
import functools
import glob
import json
import re
import shlex
import subprocess
import sys

from pages import ROOT, pages, split

OPTION = re.compile(r"(?<![\w-])(--?[A-Za-z][\w-]*)")
LANGUAGES = ("", "sh", "bash", "console", "text")


class Help:
    """The help of the command, asked for once for each subcommand."""

    def __init__(self, carom):
        self.carom = carom

    @functools.cache
    def text(self, *command):
        run = subprocess.run([self.carom, *command, "--help"], capture_output=True, text=True, timeout=60)
        return run.stdout if run.returncode == 0 else ""

    @functools.cache
    def commands(self, *command):
        return set(re.findall(r"^ {2,4}([a-z_]+) {2,}[A-Z]", self.text(*command), re.M))

    @functools.cache
    def options(self, *command):
        found = set()
        for line in self.text(*command).splitlines():
            if re.match(r" {2,6}-", line):  # what stands before the explanation
                found.update(OPTION.findall(re.split(r" {2,}", line.strip())[0]))
        return found | {"-h", "--help"}


def command_lines(block, also_refused=False):
    """Returns the lines of the block that are commands, with their line numbers, continuations joined. Where some
    begin with a prompt, the others are what is printed; a command whose refusal stands below it is left out unless it
    is asked for."""
    lines, number = block.text.splitlines(), block.line
    prompts = any(re.match(r"\s*\$ ", line) for line in lines)
    index = 0
    while index < len(lines):
        text, first = lines[index], number + index
        while text.endswith("\\") and index + 1 < len(lines):
            index += 1
            text = text[:-1] + " " + lines[index].strip()
        index += 1
        refused = index < len(lines) and re.match(r"carom[^$]*: unknown ", lines[index])
        if (also_refused or not refused) and (not prompts or re.match(r"\s*\$ ", text)):
            yield first, re.sub(r"^\s*\$ ", "", text).strip()


def words(text):
    try:
        text = re.split(r"\s+#|\s+[|>&]+\s|\s{2,}", text)[0]  # comments, what follows a pipe, explanations
        return shlex.split(text, comments=False)
    except ValueError:  # prose with an apostrophe
        return []


def check_carom(help_of, arguments):
    """Returns what is wrong with the arguments of `carom`, one sentence each."""
    command, rest = [], list(arguments)
    while rest and rest[0] in help_of.commands(*command):
        command.append(rest.pop(0))
    if not command and rest and not rest[0].startswith("-"):
        return [f"carom has no command {rest[0]}"]
    wrong = []
    for word in rest:
        if word == "--":
            break
        for name in re.findall(r"^\[?(--?[A-Za-z][\w-]*)", word):
            if name not in help_of.options(*command) and not (not command and name == "--version"):
                wrong.append(f"carom {' '.join(command)} has no option {name}")
    return wrong


def check_files(arguments):
    """Returns which of the arguments name files of the repository that are not there."""
    folders = ("scenes/", "plugin/", "tests/", "docs/", "scripts/")
    return [f"there is no {word}" for word in arguments
            if word.startswith(folders) and not re.search(r"[A-Z<>{]{3}", word)
            and not glob.glob(str(ROOT / word))]


def presets():
    listed = json.loads((ROOT / "CMakePresets.json").read_text(encoding="utf-8"))
    return {preset["name"] for kind in ("configurePresets", "buildPresets", "testPresets")
            for preset in listed.get(kind, [])}


def check_bench(arguments):
    text = (ROOT / "bench").read_text(encoding="utf-8")
    names = set(" ".join(re.findall(r'^(?:names|tables)="([^"]*)"', text, re.M)).split()) | {"tables"}
    wrong, skip = [], False
    for word in arguments:
        if word == "--":
            break
        if skip:
            skip = False
        elif word in ("--compare", "--gate", "--preset"):
            skip = True
        elif not word.startswith("-") and word not in names and word.isidentifier() and word != "NAME":
            wrong.append(f"./bench has no benchmark {word}")
    return wrong


def check_line(help_of, text):
    """Returns what is wrong with a line, or None if it is no command that this test knows."""
    arguments = words(text)
    if not arguments:
        return None
    program, rest = arguments[0], arguments[1:]
    if re.fullmatch(r"(build/[a-z-]+/)?carom", program):
        if not rest or rest[0].startswith("COMMAND"):
            return []
        return check_carom(help_of, rest) + check_files(rest)
    if program == "./bench":
        return check_bench(rest)
    if program == "cmake" and "--preset" in rest:
        name = rest[rest.index("--preset") + 1]
        return [] if name in presets() else [f"there is no preset {name}"]
    if program in ("python3", "./demo", "./check", "bash"):
        return check_files(rest)
    if program.startswith(("tests/", "docs/", ".ci/")):
        return [] if (ROOT / program).exists() else [f"there is no {program}"]
    return None


def spans(prose):
    """Returns the commands within sentences, as `carom render SCENE`, with their line numbers."""
    for number, text in prose:
        for span in re.findall(r"(?<!`)`((?:build/[a-z-]+/)?carom [^`]*|\./bench [^`]*)`(?!`)", text):
            yield number, span


def check_checks(help_of):
    """Asserts that the parts of this test find what they are to find."""
    assert check_line(help_of, "carom rendr a.json") == ["carom has no command rendr"]
    assert check_line(help_of, "carom render a.json --stpper bullet") == ["carom render has no option --stpper"]
    assert check_line(help_of, "Carom is a word") is None
    assert check_line(help_of, "carom info scenes/library/nothing.json") == ["there is no scenes/library/nothing.json"]
    assert check_line(help_of, "./bench natve") == ["./bench has no benchmark natve"]
    assert check_line(help_of, "cmake --preset dmo") == ["there is no preset dmo"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--carom", required=True, help="the command")
    help_of = Help(parser.parse_args().carom)
    if not help_of.commands():
        raise SystemExit("the help of the command lists no commands")
    check_checks(help_of)
    count, wrong = 0, 0
    for page in pages():
        blocks, prose = split(page)
        lines = [line for block in blocks if block.language in LANGUAGES for line in command_lines(block)]
        for number, text in [*lines, *spans(prose)]:
            found = check_line(help_of, text)
            count += found is not None
            for sentence in found or []:
                print(f"{page.relative_to(ROOT)}:{number}: {sentence}: {text}")
                wrong += 1
    print(f"{count} commands, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
