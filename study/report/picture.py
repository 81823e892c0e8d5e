"""A figure as part of a page: an SVG that follows the page's light or dark colours, and its numbers as a link to a file."""

import base64
import re
from dataclasses import dataclass
from typing import Final

from study.figures.shared.canvas import COLORS, image
from study.figures.views.view import View, csv_of
from study.garbage import all_kept

DARK: Final = ("#7db8f0", "#f08c74", "#7cc46c", "#e3b341", "#b39ddb", "#b0b0b0")
"""The colours of lines on a dark page, in the order of COLORS."""
_INK: Final = (("#000000", "ink", "#e6e6e6"), ("#ffffff", "paper", "#16181c"), ("#c00000", "bad", "#ff6b6b"))
"""Colour on a light page, its name, colour on a dark page."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure of a page. source and data: the drawing and its numbers, as addresses that hold them. width, height: pixels."""

    name: str
    caption: str
    source: str
    width: int
    height: int
    data: str
    label: str
    """Short, for a thumbnail."""


def picture(view: View) -> Picture:
    """Draw a view for a page."""
    with all_kept():  # a figure is many thousand objects, which all go when it is drawn
        figure = view.draw()
        drawn = themed(image(figure, "svg").decode())
    width, height = (round(96 * inches) for inches in figure.get_size_inches())
    data = address(csv_of(view.columns()), "text/csv")
    return Picture(view.name, view.caption, address(drawn, "image/svg+xml"), width, height, data, view.label)


def themed(svg: str) -> str:
    """An SVG whose lines, text and background follow `prefers-color-scheme`."""
    names = [
        *_INK,
        *((light, f"c{number}", dark) for number, (light, dark) in enumerate(zip(COLORS, DARK, strict=True))),
    ]
    for light, name, _ in names:
        svg = re.sub(rf"((?:fill|stroke): ?){light}", rf"\1var(--{name})", svg)
    lights = "".join(f"--{name}:{light};" for light, name, _ in names)
    darks = "".join(f"--{name}:{dark};" for _, name, dark in names)
    style = f"svg{{{lights}fill:var(--ink)}}@media(prefers-color-scheme:dark){{svg{{{darks}}}}}"
    style += "#patch_1 path{fill:none!important}"  # the page's own background
    head, _, rest = svg[svg.index("<svg") :].partition(">")
    return f"{head}><style>{style}</style>{rest}"


def address(text: str, kind: str) -> str:
    """Text as an address that holds it, of this media type."""
    return f"data:{kind};base64,{base64.b64encode(text.encode()).decode()}"
