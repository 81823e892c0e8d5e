"""Pages in a real browser: nothing complains, nothing is empty or runs off a phone, and the keyboard reaches everything.

They need Chromium (Debian: chromium). The browser and the pages are made once.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

import nanoslip
from nanoslip.study.report import page
from tests.study.report.chromium import FOUND, Chromium

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

REACH = """
Object.values([...document.querySelectorAll("main > section")].filter(each => each.querySelector("img")).reduce((rows, each) => {
  const top = Math.round(each.getBoundingClientRect().top);
  const ends = [...each.querySelectorAll("img, figcaption, p")].map(part => part.getBoundingClientRect().right);
  return {...rows, [top]: Math.max(rows[top] || 0, ...ends)};
}, {}))
"""
"""How far right each row of sections with figures reaches, in pixels."""


TABLE = 'document.querySelector(".wide")'


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    made = {}
    for name, campaign in CAMPAIGNS.items():
        out = tmp_path_factory.mktemp(name)
        numerics = {} if "n_x" in campaign["axes"] else {"n_x": 17}
        with nanoslip.run({**campaign, "numerics": {**numerics, **campaign.get("numerics", {})}}, out) as dataset:
            made[name] = page.write(dataset, out)
    return made


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    with Chromium.started(tmp_path_factory.mktemp("profile")) as started:
        yield started


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [390, 1200])
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_page_is_whole(browser: Chromium, pages: dict[str, Path], name: str, width: int, dark: bool) -> None:
    browser.complaints.clear()
    browser.show(pages[name], width, dark)
    assert browser.value("document.images.length") > 0
    assert browser.value(EMPTY) == 0
    assert browser.value(OFF_THE_PAGE) == []
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert browser.value("[...document.images].every(each => each.alt)")
    assert browser.complaints == []


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_shadow_shows_at_each_end_of_a_table_beyond_which_there_is_more(
    browser: Chromium, pages: dict[str, Path], dark: bool
) -> None:
    browser.show(pages["failing"], 390, dark)
    hidden = browser.value(f"{TABLE}.scrollWidth - {TABLE}.clientWidth")
    assert hidden > 100  # both ends have shadows in the middle
    for place, shaded in ((0, (False, True)), (hidden / 2, (True, True)), (hidden, (True, False))):
        browser.value(f"{TABLE}.scrollLeft = {place}")
        assert tuple(shadows(browser)) == shaded
    browser.show(pages["pressed"], 1200, dark)
    assert tuple(shadows(browser)) == (False, False)


def shadows(browser: Chromium) -> Iterator[bool]:
    """Whether the left end of the first table is darker than its middle, and the right one, in a row without text."""
    left, right, top = browser.value(
        f'{TABLE}.scrollIntoView({{block: "center"}}), (b => [b.left, b.right, b.top])({TABLE}.getBoundingClientRect())'
    )
    row = browser.picture()[round(top) + 2, round(left) : round(right)]  # above the words of its header
    row = row.sum(axis=1, dtype=int)
    for end in (row[1], row[-2]):
        yield bool(end != row[len(row) // 2])


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_no_row_of_a_broad_page_is_half_empty(browser: Chromium, pages: dict[str, Path], name: str) -> None:
    browser.show(pages[name], 1200)
    assert min(browser.value(REACH)) > 700


@pytest.mark.parametrize("name", CAMPAIGNS)
def test_every_link_leads_to_numbers(browser: Chromium, pages: dict[str, Path], name: str) -> None:
    browser.show(pages[name], 1200)
    count = browser.value("document.images.length")
    decoded = 'atob(each.href.split("base64,")[1]).split("\\n")'
    lengths = browser.value(f"[...document.links].map(each => {decoded}.length)")
    assert len(lengths) == count
    assert min(lengths) > 2  # a line of names, one of numbers, and the end


def test_the_table_is_sorted_by_number_with_the_keyboard(browser: Chromium, pages: dict[str, Path]) -> None:
    browser.show(pages["failing"], 1200)
    column = '[...document.querySelectorAll("#cases tbody tr")].map(each => each.cells[0].textContent)'
    names = browser.value('[...document.querySelectorAll("#cases th")].map(each => each.textContent)')
    assert names[0] == "R/Lx"
    before = browser.value(column)
    browser.value('document.querySelector("#cases th button").focus()')
    browser.press("Enter")
    assert browser.value(column) == sorted(before, key=float)
    browser.press("Enter")
    assert browser.value(column) == sorted(before, key=float, reverse=True)
    assert browser.value('document.querySelector("#cases th").getAttribute("aria-sort")') == "descending"


def test_single_cases_open_with_the_keyboard(browser: Chromium, pages: dict[str, Path]) -> None:
    browser.show(pages["driven"], 1200)
    browser.value('document.querySelector(".small summary").focus()')
    small = browser.value('document.querySelector(".small img").clientWidth')
    browser.press("Enter")
    assert browser.value('document.querySelector(".small details").open')
    assert browser.value('document.querySelector(".small img").clientWidth') > 2 * small


def test_a_page_needs_no_script(browser: Chromium, pages: dict[str, Path]) -> None:
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.show(pages["driven"], 1200)
    finally:
        browser.call("Emulation.setScriptExecutionDisabled", value=False)
    assert browser.value('document.querySelectorAll("#cases th button").length') == 0
    assert browser.value(EMPTY) == 0
