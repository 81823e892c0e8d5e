"""Pages in a real browser: nothing complains, nothing is empty or runs off a phone, and the keyboard reaches everything.

They need Chromium (Debian: chromium). The browser and the pages are made once.
"""

import io
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import pytest
from PIL import Image

import nanoslip
from nanoslip.study.report import page

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

playwright = pytest.importorskip("playwright.sync_api", reason="no playwright here: it comes with the extra dev")
FOUND = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
Show: TypeAlias = "Callable[..., Page]"


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(FOUND is None, reason="no Chromium here: install the package chromium to look at pages"),
]


CAMPAIGNS = {
    "driven": {
        "title": "Drives over stiffness, with members of an ensemble",
        "axes": {"intrinsic_friction": [0.25, 0.5]},
        "limits": {"events": 120},
        "ensemble": {"members": 2},
        "drive_axes": {"spring_stiffness": [1e5, 4e5]},
    },
    "failing": {
        "title": "Cases that are refused, or have no plateau",
        "axes": {"rows": [4, 7], "n_x": [17, 65], "radius": [50.0, 100.0]},
        "numerics": {"scheme": "biquadratic"},
        "limits": {"events": 40},
    },
    "pressed": {
        "title": "AVeryLongTitleOfOneWordThatNobodyCanBreakAtASpaceBecauseThereIsNoneInIt, pressed alone",
        "stages": ["contact"],
        "axes": {"radius": [50.0, 100.0]},
        "outputs": {"subsurface": True, "tractions": True},
    },
}


OFF_THE_PAGE = """
[...document.querySelectorAll("body *")].filter(each =>
  each.getBoundingClientRect().right > document.documentElement.clientWidth + 1 && !each.closest(".wide, pre")
).map(each => each.outerHTML.slice(0, 80))
"""


EMPTY = "[...document.images].filter(each => !each.naturalWidth || each.getBoundingClientRect().width < 60).length"


TABLE = 'document.querySelector(".wide")'


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = {}
    for name, campaign in CAMPAIGNS.items():
        out = tmp_path_factory.mktemp(name)
        numerics = {} if "n_x" in campaign["axes"] else {"n_x": 17}
        with nanoslip.run({**campaign, "numerics": {**numerics, **campaign.get("numerics", {})}}, out) as dataset:
            made[name] = page.write_page(dataset, out)
    return made


@pytest.fixture(scope="module")
def browser() -> "Iterator[Browser]":
    with playwright.sync_playwright() as player:
        yield player.chromium.launch(executable_path=FOUND, args=["--no-sandbox"])


@pytest.fixture
def show(browser: "Browser", pages: dict[str, Path]) -> Iterator[Show]:
    """Open a page in a window so wide; nothing may complain until the test ends."""
    complaints: list[object] = []

    def complain(said: object) -> None:
        complaints.append(said)

    def shown(name: str, width: int, dark: bool = False) -> "Page":
        opened = browser.new_page(
            viewport={"width": width, "height": 900}, color_scheme="dark" if dark else "light", is_mobile=width < 600
        )
        for event in ("console", "pageerror", "requestfailed"):
            opened.on(event, complain)  # type: ignore[call-overload]
        opened.goto(pages[name].resolve().as_uri())
        return opened

    yield shown
    for context in browser.contexts:
        context.close()
    assert complaints == []


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [390, 1200])
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_page_is_whole(show: Show, name: str, width: int, dark: bool) -> None:
    seen = show(name, width, dark)
    assert seen.evaluate("document.images.length") > 0
    assert seen.evaluate(EMPTY) == 0
    assert seen.evaluate(OFF_THE_PAGE) == []
    assert seen.evaluate("document.documentElement.scrollWidth") <= width
    assert seen.evaluate("[...document.images].every(each => each.alt)")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_shadow_shows_at_each_end_of_a_table_beyond_which_there_is_more(show: Show, dark: bool) -> None:
    seen = show("failing", 390, dark)
    hidden = seen.evaluate(f"{TABLE}.scrollWidth - {TABLE}.clientWidth")
    assert hidden > 100  # both ends have shadows in the middle
    for place, shaded in ((0, (False, True)), (hidden / 2, (True, True)), (hidden, (True, False))):
        seen.evaluate(f"{TABLE}.scrollLeft = {place}")
        assert tuple(shadows(seen)) == shaded
    seen = show("pressed", 1200, dark)
    assert tuple(shadows(seen)) == (False, False)


def shadows(seen: "Page") -> Iterator[bool]:
    """Whether the left end of the first table is darker than its middle, and the right one, in a row without text."""
    left, right, top = seen.evaluate(
        f'{TABLE}.scrollIntoView({{block: "center"}}), (b => [b.left, b.right, b.top])({TABLE}.getBoundingClientRect())'
    )
    with Image.open(io.BytesIO(seen.screenshot())) as shot:
        picture = np.asarray(shot.convert("RGB"))
    row = picture[round(top) + 2, round(left) : round(right)]  # above the words of its header
    row = row.sum(axis=1, dtype=int)
    for end in (row[1], row[-2]):
        yield bool(end != row[len(row) // 2])


def test_the_table_is_sorted_by_number_with_the_keyboard(show: Show) -> None:
    seen = show("failing", 1200)
    column = '[...document.querySelectorAll("#cases tbody tr")].map(each => parseFloat(each.cells[0].textContent))'
    names = seen.evaluate('[...document.querySelectorAll("#cases th")].map(each => each.textContent)')
    assert names[0] == "R/Lx"
    before = seen.evaluate(column)
    seen.focus("#cases th button")
    seen.keyboard.press("Enter")
    assert seen.evaluate(column) == sorted(before)
    seen.keyboard.press("Enter")
    assert seen.evaluate(column) == sorted(before, reverse=True)
    assert seen.evaluate('document.querySelector("#cases th").getAttribute("aria-sort")') == "descending"


@pytest.mark.parametrize("width", [390, 1200])
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_row_is_a_line_and_no_cell_covers_another(show: Show, name: str, width: int) -> None:
    seen = show(name, width)
    heights = seen.evaluate('[...document.querySelectorAll("#cases tbody tr")].map(each => each.clientHeight)')
    assert max(heights) < 35  # a line of 0.85 × 16 pixels at 1.5 and its padding are 30
    gaps = seen.evaluate(
        '[...document.querySelectorAll("#cases tbody tr")].flatMap(row => [...row.cells].slice(1).map((cell, number) =>'
        " cell.getBoundingClientRect().left - row.cells[number].getBoundingClientRect().right))"
    )
    assert max(map(abs, gaps), default=0.0) < 1.0


def test_the_menu_leads_to_every_section_and_the_filter_leaves_matching_rows(show: Show) -> None:
    seen = show("failing", 390)
    titles = seen.evaluate('[...document.querySelectorAll("section[id] > h2")].map(each => each.textContent)')
    assert seen.evaluate('[...document.querySelectorAll("nav a")].map(each => each.textContent)') == titles
    assert seen.evaluate('[...document.querySelectorAll("nav a")].every(each => document.querySelector(each.hash))')
    shown = '[...document.querySelectorAll("#cases tbody tr")].filter(each => each.offsetHeight).length'
    every = seen.evaluate(shown)
    seen.fill("input", "Invalid")
    assert 0 < seen.evaluate(shown) < every
    seen.fill("input", "no such case")
    assert seen.evaluate(shown) == 0
    seen.fill("input", "")
    assert seen.evaluate(shown) == every
