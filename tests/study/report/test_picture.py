"""A picture follows the page's colours: none of them is fixed, and each has its value for light and for dark."""

import base64
import re
from xml.etree import ElementTree

from nanoslip.study.figures.shared import COLORS, column, image
from nanoslip.study.figures.view import View
from nanoslip.study.report.page import DARK, picture, themed


def drawn() -> object:
    with column() as figure:
        axes = figure.add_subplot()
        for number in range(len(COLORS)):
            axes.plot([0, 1], [0, number], "o-", label=f"line {number}")
        axes.legend()
    return figure


def test_every_colour_is_a_variable_with_a_light_and_a_dark_value() -> None:
    text = themed(image(drawn(), "svg").decode())
    ElementTree.fromstring(text)
    style, _, rest = text.partition("</style>")
    assert not re.findall(rf"(?:fill|stroke): ?(?:{'|'.join(COLORS)}|#000000)", rest)
    used = set(re.findall(r"var\(--(\w+)\)", rest))
    light, dark = style.split("@media(prefers-color-scheme:dark)")
    assert used >= {f"c{number}" for number in range(len(COLORS))}
    for name in used:
        assert f"--{name}:" in light
        assert f"--{name}:" in dark
    assert len(DARK) == len(COLORS)


def test_a_picture_holds_its_drawing_and_its_numbers() -> None:
    found = picture(View("name", "What it is.", drawn, dict))
    kind, _, text = found.source.partition(";base64,")
    assert kind == "data:image/svg+xml"
    assert base64.b64decode(text).startswith(b"<svg")
    assert found.width == round(96 * 3.35)
    assert found.data.startswith("data:text/csv;base64,")
