#!/usr/bin/env python3
"""Every relative link and anchor of the pages leads somewhere, and every page is reached from docs/README.md,
which names each page of docs once.

    python3 tests/docs/links_test.py
"""

import collections
import re
import sys

from pages import ROOT, pages, split

LINK = re.compile(r"(?<!\\)\[(?:[^\[\]]|\[[^\[\]]*\])*\]\(\s*<?([^()\s<>]+(?:\([^()\s]*\)[^()\s<>]*)?)>?(?:\s+\"[^\"]*\")?\s*\)")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$")
SPAN = re.compile(r"(`+)(.+?)\1")


def anchor(heading):
    """Returns the anchor that GitHub gives a heading."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").replace("*", "")
    text = re.sub(r"[^\w\- ]", "", text.lower())
    return text.replace(" ", "-")


def anchors(prose):
    found, counts = set(), collections.Counter()
    for _, text in prose:
        match = HEADING.match(text)
        if match:
            name = anchor(match.group(1))
            found.add(name if counts[name] == 0 else f"{name}-{counts[name]}")
            counts[name] += 1
        found.update(re.findall(r"<a\s+(?:name|id)=\"([^\"]+)\"", text))
    return found


def links(prose):
    for number, text in prose:
        for target in LINK.findall(SPAN.sub("", text)):
            if not re.match(r"[a-z][a-z0-9+.-]*:", target):
                yield number, target


def check_links(read):
    """Returns what is wrong with links, and which pages each page leads to."""
    named = {page: anchors(prose) for page, (_, prose) in read.items()}
    wrong, leads = [], collections.defaultdict(list)
    for page, (_, prose) in read.items():
        for number, target in links(prose):
            path, _, fragment = target.partition("#")
            aim = (page.parent / path).resolve() if path else page
            if not aim.exists():
                wrong.append(f"{page.relative_to(ROOT)}:{number}: there is no {target}")
            elif fragment and aim in named and fragment not in named[aim]:
                wrong.append(f"{page.relative_to(ROOT)}:{number}: no heading of {path or 'this page'} is #{fragment}")
            elif aim in named:
                leads[page].append(aim)
    return wrong, leads


def check_index(leads):
    """Returns what is wrong with docs/README.md as the index of all pages of docs."""
    index = ROOT / "docs" / "README.md"
    counts = collections.Counter(leads[index])
    wrong = []
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if page != index and counts[page] != 1:
            wrong.append(f"docs/README.md: names {page.relative_to(ROOT)} {counts[page]} times; once is expected")
    if index not in leads[ROOT / "README.md"]:
        wrong.append("README.md: does not lead to docs/README.md")
    return wrong


def check_checks():
    """Asserts that the parts of this test find what they are to find."""
    assert anchor("What `tune` does, and *when*") == "what-tune-does-and-when"
    assert anchor('`"type": "solid"`') == "type-solid"
    assert [target for _, target in links([(1, "![a](b.png) [c](d.md#e) `[f](g)` [h](https://i)")])] == ["b.png", "d.md#e"]
    assert anchors([(1, "## A"), (2, "## A")]) == {"a", "a-1"}


def main():
    check_checks()
    read = {page: split(page) for page in pages()}
    wrong, leads = check_links(read)
    wrong += check_index(leads)
    for sentence in wrong:
        print(sentence)
    print(f"{sum(len(list(links(prose))) for _, prose in read.values())} links of {len(read)} pages, {len(wrong)} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
