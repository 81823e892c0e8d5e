"""Every relative link and picture in a Markdown file leads to a file, and to a heading of it where it names one; no merge is
half done."""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("study", "solver", "campaigns", "docs", "tests", "slurm")
PAGES = sorted([*ROOT.glob("*.md"), *(page for folder in FOLDERS for page in (ROOT / folder).rglob("*.md"))])
WRITTEN = ("docs/generated", "docs/examples")
"""Folders that the site's build writes."""
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    """Names of a page's headings in links to them: GitHub's rule."""
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_a_heading_is_found_by_its_words_and_a_conflict_by_its_marker(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# `[axes]`, and ± what?\n<<<<<<< HEAD\n[here](#axes-and--what)\n")
    assert anchors(page) == {"axes-and--what"}
    assert list(broken(page)) == [f"{page}: <<<<<<< HEAD"]


def broken(page: Path) -> Iterator[str]:
    """Links of a page that lead nowhere, and markers of a conflict."""
    text = page.read_text("utf-8")
    yield from (f"{page}: {marker}" for marker in re.findall(r"^(?:<{7}|>{7}) .*", text, re.MULTILINE))
    for link in LINK.findall(CODE.sub("", text)):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            yield f"{page}: {link}"


def test_links_lead_somewhere() -> None:
    pages = (page for page in PAGES if not page.relative_to(ROOT).as_posix().startswith(WRITTEN))
    found = [link for page in pages for link in broken(page)]
    assert not found, "\n".join(found)
