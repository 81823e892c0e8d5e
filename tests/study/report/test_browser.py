"""Pages in a real browser: nothing complains, nothing is empty or runs off a phone, and the keyboard reaches everything.

They need Chromium (Debian: chromium). The browser and the pages are made once.
"""

import base64
import io
import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import nanoslip
from nanoslip.study.report import page

FOUND = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Chromium:
    """One browser with one page. What its console says is kept."""

    def __init__(self, reading: int, writing: int) -> None:
        self._in, self._out = os.fdopen(reading, "rb", 0), os.fdopen(writing, "wb", 0)
        self._buffer, self._number, self._session = b"", 0, ""
        self.complaints: list[Any] = []

    @classmethod
    @contextmanager
    def started(cls, profile: Path) -> Iterator[Self]:
        """The browser, with an empty page; it ends with the block."""
        (theirs_in, writing), (reading, theirs_out) = os.pipe(), os.pipe()
        options = (
            "--headless=new --no-sandbox --disable-gpu --remote-debugging-pipe --no-first-run --disable-extensions"
        )
        command = f'exec "{FOUND}" {options} --user-data-dir="{profile}" 3<&{theirs_in} 4>&{theirs_out}'
        process = subprocess.Popen(
            ["bash", "-c", command],
            pass_fds=(theirs_in, theirs_out),
            stderr=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
        )
        os.close(theirs_in)
        os.close(theirs_out)
        browser = cls(reading, writing)
        try:
            target = browser.call("Target.createTarget", url="about:blank")["targetId"]
            browser._session = browser.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
            for domain in ("Page", "Runtime", "Log"):
                browser.call(f"{domain}.enable")
            yield browser
        finally:
            process.kill()
            process.wait()
            browser._in.close()
            browser._out.close()

    def call(self, method: str, **given: Any) -> Any:
        """The answer to one command."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": given}
        self._out.write(json.dumps(message | ({"sessionId": self._session} if self._session else {})).encode() + b"\0")
        while (answer := self._next()).get("id") != self._number:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            chunk = self._in.read(1 << 20)
            assert chunk, "the browser has ended"
            self._buffer += chunk
        line, self._buffer = self._buffer.split(b"\0", 1)
        answer: dict[str, Any] = json.loads(line)
        if answer.get("method") in ("Runtime.exceptionThrown", "Runtime.consoleAPICalled", "Log.entryAdded"):
            self.complaints.append(answer["params"])
        return answer

    def show(self, path: Path, width: int, dark: bool = False) -> None:
        """Open a file in a window so wide, and wait until it is there."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call("Page.navigate", url=path.resolve().as_uri())
        while self._next().get("method") != "Page.loadEventFired":
            pass

    def value(self, script: str) -> Any:
        """What an expression of JavaScript gives on the page."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def picture(self) -> NDArray[np.uint8]:
        """The colours of the window, (height, width, 3)."""
        with Image.open(io.BytesIO(base64.b64decode(self.call("Page.captureScreenshot")["data"]))) as shot:
            return np.asarray(shot.convert("RGB"))

    def press(self, key: str) -> None:
        """Press a key on the keyboard: Tab, Enter."""
        code = {"Tab": 9, "Enter": 13}[key]
        text = {"text": "\r"} if key == "Enter" else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code, **text)


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


def test_the_table_is_sorted_by_number_with_the_keyboard(browser: Chromium, pages: dict[str, Path]) -> None:
    browser.show(pages["failing"], 1200)
    column = '[...document.querySelectorAll("#cases tbody tr")].map(each => parseFloat(each.cells[0].textContent))'
    names = browser.value('[...document.querySelectorAll("#cases th")].map(each => each.textContent)')
    assert names[0] == "R/Lx"
    before = browser.value(column)
    browser.value('document.querySelector("#cases th button").focus()')
    browser.press("Enter")
    assert browser.value(column) == sorted(before)
    browser.press("Enter")
    assert browser.value(column) == sorted(before, reverse=True)
    assert browser.value('document.querySelector("#cases th").getAttribute("aria-sort")') == "descending"


@pytest.mark.parametrize("width", [390, 1200])
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_a_row_is_a_line_and_no_cell_covers_another(
    browser: Chromium, pages: dict[str, Path], name: str, width: int
) -> None:
    browser.show(pages[name], width)
    heights = browser.value('[...document.querySelectorAll("#cases tbody tr")].map(each => each.clientHeight)')
    assert max(heights) < 35  # a line of 0.85 × 16 pixels at 1.5 and its padding are 30
    gaps = browser.value(
        '[...document.querySelectorAll("#cases tbody tr")].flatMap(row => [...row.cells].slice(1).map((cell, number) =>'
        " cell.getBoundingClientRect().left - row.cells[number].getBoundingClientRect().right))"
    )
    assert max(map(abs, gaps), default=0.0) < 1.0


def test_the_menu_leads_to_every_section_and_the_filter_leaves_matching_rows(
    browser: Chromium, pages: dict[str, Path]
) -> None:
    browser.show(pages["failing"], 390)
    titles = browser.value('[...document.querySelectorAll("section[id] > h2")].map(each => each.textContent)')
    assert browser.value('[...document.querySelectorAll("nav a")].map(each => each.textContent)') == titles
    assert browser.value('[...document.querySelectorAll("nav a")].every(each => document.querySelector(each.hash))')
    shown = '[...document.querySelectorAll("#cases tbody tr")].filter(each => each.offsetHeight).length'
    typed = 'document.querySelector("input").value = "{}"; document.querySelector("input").dispatchEvent(new Event("input"))'
    every = browser.value(shown)
    browser.value(typed.format("Invalid"))
    assert 0 < browser.value(shown) < every
    browser.value(typed.format("no such case"))
    assert browser.value(shown) == 0
    browser.value(typed.format(""))
    assert browser.value(shown) == every


def test_single_cases_open_with_the_keyboard(browser: Chromium, pages: dict[str, Path]) -> None:
    browser.show(pages["driven"], 1200)
    browser.value('document.querySelector(".small summary").focus()')
    small = browser.value('document.querySelector(".small img").clientWidth')
    browser.press("Enter")
    assert browser.value('document.querySelector(".small details").open')
    assert browser.value('document.querySelector(".small img").clientWidth') > 2 * small
