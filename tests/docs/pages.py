"""Reads the pages: README.md, CONTRIBUTING.md, CHANGELOG.md and docs. Shared by the tests beside it."""

import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
FENCE = re.compile(r"^(```+|~~~+)\s*(\S*)(.*)$")


def pages():
    """Returns the pages as a list of paths, README.md first."""
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")]
    return [page for page in top if page.exists()] + sorted((ROOT / "docs").rglob("*.md"))


class Block:
    """A block of code: its language ('' if it is indented or names none), its text, its first line."""

    def __init__(self, page, language, lines, line):
        self.page = page
        self.language = language
        self.text = "\n".join(lines) + "\n"
        self.line = line

    def place(self):
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def split(page):
    """Returns the page's blocks of code, and its prose as pairs of line number and text."""
    blocks, prose, fenced, indented = [], [], None, []
    blank_before = True

    def end_indented():
        nonlocal indented
        while indented and not indented[-1][1].strip():
            indented.pop()
        if indented:
            blocks.append(Block(page, "", [text[4:] for _, text in indented], indented[0][0]))
        indented = []

    for number, text in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        fence = FENCE.match(text)
        if fenced is not None:
            if fence and fence.group(1) == fenced[0] and not fence.group(2):
                blocks.append(Block(page, fenced[1], fenced[2], fenced[3]))
                fenced = None
            else:
                fenced[2].append(text)
        elif fence:
            end_indented()
            fenced = (fence.group(1), fence.group(2), [], number + 1)
        elif text.startswith("    ") and (indented or blank_before):
            indented.append((number, text))
        elif not text.strip() and indented:
            indented.append((number, text))
        else:
            end_indented()
            prose.append((number, text))
        blank_before = not text.strip()
    end_indented()
    if fenced is not None:
        raise SystemExit(f"{page.relative_to(ROOT)}:{fenced[3]}: the block does not end")
    return blocks, prose
