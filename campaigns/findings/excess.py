"""Static excess of many contacts over their number, by preparation, nodes across, μ_i and spread; of a ball, too."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import (
    PAGE,
    CampaignFigure,
    Claim,
    Number,
    average,
    column,
    error_over_starts,
    exponent,
    series_style,
)


class Kind(NamedTuple):
    """Contacts of one kind."""

    ball: bool
    across: int
    """Nodes across a contact."""
    initial_contact: str
    spread: float
    friction: float

    @property
    def body(self) -> str:
        """The pin, with the nodes across."""
        return f"{'ball' if self.ball else 'cylinder'}, {self.across} nodes across"

    @property
    def made(self) -> str:
        """Preparation and nodes."""
        return f"{self.initial_contact}, {f'spread {self.spread:g}' if self.spread else 'equal nodes'}"


class Excess(NamedTuple):
    """Static excess of records of one length and its ± over sliders, over the numbers of contacts."""

    contacts: Any
    value: Any
    error: Any

    @property
    def exponent(self) -> Number:
        """Exponent over the contacts."""
        return Number(*exponent(*self))

    @property
    def last(self) -> Number:
        """What is left at the most contacts."""
        return Number(float(self.value[-1]), float(self.error[-1]))


def of_kinds(dataset: xr.Dataset) -> dict[Kind, Excess]:
    """Excess of each kind of contacts."""
    found, kinds = dataset.squeeze(), {}
    names = ("scheme", "n_x", "initial_contact", "spread", "intrinsic_friction")
    keys = [tuple(found[name].values[case] for name in names) for case in range(found.sizes["case"])]
    width = found["contact_half_width"].groupby("n_x").mean()
    across = {int(n_x): round(2.0 * float(width.sel(n_x=n_x)) * (n_x - 1)) for n_x in width["n_x"].values.tolist()}
    for key in dict.fromkeys(keys):
        here = found.isel(case=[case for case, each in enumerate(keys) if each == key]).sortby("contacts")
        kind = Kind(key[0] == "half_space", across[key[1]], str(key[2]), float(key[3]), float(key[4]))
        # A longer record of few contacts has higher peaks: what is compared here is of one length.
        error = error_over_starts(here, "static_excess")
        kinds[kind] = Excess(here["contacts"].values, here["static_excess"].values, error)
    return kinds


def chosen(dataset: xr.Dataset, which: Callable[[Kind], bool], number: Callable[[Excess], Number]) -> Number:
    """Mean of a number over the kinds that are chosen."""
    return average([number(excess) for kind, excess in of_kinds(dataset).items() if which(kind)])


def draw(dataset: xr.Dataset) -> Figure:
    """Excess over the contacts: a panel for each pin and grid, solid lines of the smaller μ_i, dashed of the larger."""
    kinds = of_kinds(dataset)
    bodies, made, frictions = (
        [*dict.fromkeys(each)] for each in zip(*((kind.body, kind.made, kind.friction) for kind in kinds), strict=True)
    )
    with column(2.6, PAGE) as figure:
        panels = dict(zip(bodies, figure.subplots(1, len(bodies), sharey=True), strict=True))
        for kind, excess in kinds.items():
            second = frictions.index(kind.friction)
            line = {"linestyle": ("-", "--")[second], "label": None if second else kind.made, "capsize": 1.5}
            panels[kind.body].errorbar(*excess, **series_style(made.index(kind.made), **line))
        for body, axes in panels.items():
            (first, *_), contacts = (axes.lines[0].get_ydata(), axes.lines[0].get_xdata())
            axes.plot(contacts, first / np.sqrt(contacts), "k:", label="$N^{-1/2}$")
            axes.set(xscale="log", yscale="log", title=body, xlabel="contacts N")
        panels[bodies[0]].set_ylabel(typeset("excess F_max/F - 1"))
        figure.legend(*panels[bodies[0]].get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Excess of one contact and of the most, and the exponent between."""
    for kind, excess in of_kinds(dataset).items():
        one = with_error(float(excess.value[0]), float(excess.error[0]))
        left = f"{with_error(*excess.last)} of {excess.contacts[-1]}"
        yield Claim(f"{kind.body}: {kind.made}, μ_i = {kind.friction:g}", one, left, with_error(*excess.exponent))


def common(kind: Kind, initial_contact: str) -> bool:
    """True of equal nodes on the finest grid of a cylinder at small μ_i, whose first slips coincide."""
    return (
        not kind.ball
        and kind.across > 50
        and not kind.spread
        and kind.friction < 0.1
        and kind.initial_contact == initial_contact
    )


NUMBERS: Final[Mapping[str, Any]] = {
    "ball, unequal nodes: exponent": partial(
        chosen, which=lambda kind: kind.ball and kind.spread > 0.0, number=lambda excess: excess.exponent
    ),
    "ball, few equal nodes: left": partial(
        chosen,
        which=lambda kind: kind.ball and kind.across < 10 and not kind.spread,
        number=lambda excess: excess.last,
    ),
    "ball, equal nodes: left": partial(
        chosen,
        which=lambda kind: kind.ball and kind.across > 10 and not kind.spread,
        number=lambda excess: excess.last,
    ),
    "cylinder, unequal nodes: exponent": partial(
        chosen, which=lambda kind: not kind.ball and kind.spread > 0.0, number=lambda excess: excess.exponent
    ),
    "cylinder, few equal nodes: left": partial(
        chosen,
        which=lambda kind: not kind.ball and kind.across < 50 and not kind.spread,
        number=lambda excess: excess.last,
    ),
    "cylinder, many equal nodes, small μ_i, stick: left": partial(
        chosen, which=partial(common, initial_contact="stick"), number=lambda excess: excess.last
    ),
    "cylinder, many equal nodes, small μ_i, gradual: left": partial(
        chosen, which=partial(common, initial_contact="gradual"), number=lambda excess: excess.last
    ),
}
EXCESS: Final = CampaignFigure(
    "excess",
    "Static excess of many contacts, in plane strain and under a ball",
    "Highest force over plateau, less 1, of a rigid slider with N contacts: means over 16 sliders and their ±. Solid: μ_i = "
    "0.05, dashed: 0.5. Dotted: average of independent contacts.",
    draw,
    claims,
    ("", "one contact", "many", "exponent"),
)
