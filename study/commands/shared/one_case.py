"""One case of a dataset on the terminal: how it ended, its numbers, its lines in text; or its lines as a picture."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import click
import xarray as xr

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.dataset.access import one_case
from nanoslip.study.dataset.variables import MEMBERS
from nanoslip.study.figures.shared.canvas import column, format_of, image
from nanoslip.study.figures.shared.files import write_files
from nanoslip.study.manifest.parameters import STANDARD
from nanoslip.study.report.console import console, print_sentences, print_table, say, whole
from nanoslip.study.report.curves import MARGIN, WIDTH, Curve, curves, text_plot
from nanoslip.study.report.summary import case_table, ending_lines, failure_summary, scalar_table, words

_NAMES: Final = ("case_id", "case")
"""Coordinates that are no parameters."""


def show_case(dataset: xr.Dataset, given: Mapping[str, str], picture: Path | None) -> None:
    """Print the case that parameters single out, or write its picture besides. Raises Refusal where it is not one case."""
    try:
        case = one_case(dataset, given)
    except (KeyError, ValueError) as error:
        raise Refusal(str(error.args[0])) from None
    _print_numbers(case, dataset)
    lines = list(curves(case))
    if lines and MEMBERS.name in case and int(case[MEMBERS.name].max()) > 1:
        say("lines are those of the first member")
    if picture:
        with refusals():
            write_files({picture: _drawn(lines, format_of(picture))})
        say(whole(f"written: {picture}"))
        return
    width = min(WIDTH, console().width - MARGIN)
    for line in lines:
        click.echo(text_plot(line.x, line.y, (line.x_label, line.y_label), width))


def _print_numbers(case: xr.Dataset, dataset: xr.Dataset) -> None:
    """Print what a case is, how it ended and what is known of it; drives as rows where they are several."""
    print_sentences([f"case {_label(case, dataset)}", *ending_lines(case)])
    table, missing = case_table(case)
    if table.rows:
        print_table(table)
    if missing:
        say(f"not known here: {', '.join(missing)}")
    if "drive_outcome" in case and case["drive_outcome"].dims:
        say("several drives; drive=NAME, or values of their parameters, shows one:")
        print_table(scalar_table(case, why=False))
        print_sentences(failure_summary(case), "failed")


def _label(case: xr.Dataset, dataset: xr.Dataset) -> str:
    """The parameters that tell a case from the dataset's others; the standard ones always."""
    names = [str(name) for name, each in case.coords.items() if not each.dims and name not in _NAMES]
    told = [name for name in names if name in STANDARD or len(set(dataset[name].values.ravel().tolist())) > 1]
    if "pin" in case and case["pin"].item() == "flat_punch":  # which has no radius
        told = [
            "pin",
            *("half_width" if name == "radius" else name for name in told if name not in ("pin", "half_width")),
        ]
    return words({name: case[name].item() for name in told if not case[name].isnull()})


def _drawn(lines: Sequence[Curve], form: str) -> bytes:
    """A picture of the lines, one above the other. Raises Refusal where there is none."""
    if not lines:
        raise Refusal("this case has no friction record, motion or contact to be drawn: see [outputs] and stages")
    with column(height=2.2 * len(lines)) as figure:
        for axes, line in zip(figure.subplots(len(lines), squeeze=False).ravel(), lines, strict=True):
            axes.plot(line.x, line.y)
            axes.set(xlabel=line.x_label, ylabel=line.y_label)
        return image(figure, form)
