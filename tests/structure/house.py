#!/usr/bin/env python3
"""Measures what CONTRIBUTING.md and the structure tests ask of the sources, and prints one line each:
files in the largest folder, functions over 40 lines, the class with most private functions, comments
that begin without a subject. Needs Universal Ctags (Debian: universal-ctags).

    python3 tests/structure/house.py [--verbose]
"""

import collections
import json
import os
import re
import subprocess
import sys

LAYERS = ["audio", "native", "modal", "bullet_bridge", "plugin", "web", "scenes", "lab", "command"]
LONG = 40
SUBJECTLESS = re.compile(r"^\s*//+<? *(Of|Likewise|As above|What|Whether)\b")


def sources():
    listed = subprocess.run(["git", "ls-files", *LAYERS], capture_output=True, text=True, check=True)
    return [name for name in listed.stdout.split() if name.endswith((".h", ".cpp", ".c"))]


def tags(files):
    command = ["ctags", "--languages=C++", "--langmap=C++:+.h.c", "--kinds-C++=fp",
               "--fields=+neasS", "--output-format=json", "-f", "-", *files]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return [json.loads(line) for line in output.splitlines()]


def main():
    files = sources()
    folders = collections.Counter(os.path.dirname(name) for name in files)
    functions = []
    private = collections.Counter()
    for tag in tags(files):
        if tag.get("kind") == "function" and "end" in tag:
            functions.append((tag["end"] - tag["line"] + 1, f"{tag['path']}:{tag['line']} {tag['name']}"))
        if tag.get("access") == "private" and tag["path"].endswith((".h", ".cpp")):
            if tag["kind"] == "prototype" or (tag["kind"] == "function" and "scope" in tag):
                private[(tag["path"], tag.get("scope", ""))] += 1
    long = sorted((found for found in functions if found[0] > LONG), reverse=True)
    comments = []
    for name in files:
        with open(name, encoding="utf-8") as file:
            comments += [f"{name}:{number + 1}" for number, line in enumerate(file) if SUBJECTLESS.match(line)]
    folder, count = folders.most_common(1)[0]
    print(f"files in a folder, at most: {count} ({folder})")
    print(f"functions over {LONG} lines: {len(long)} of {len(functions)}, {100 * len(long) / len(functions):.2f} %")
    (path, scope), most = private.most_common(1)[0]
    print(f"private functions of a class, at most: {most} ({scope} in {path})")
    print(f"comments that begin with Of, Likewise, As above, What or Whether: {len(comments)}")
    if "--verbose" in sys.argv:
        for length, where in long:
            print(f"  {length} lines: {where}")
        for (path, scope), number in private.most_common(8):
            print(f"  {number} private functions: {scope} in {path}")
        for where in comments:
            print(f"  comment: {where}")


if __name__ == "__main__":
    main()
