"""Error of plateau, static and kinetic friction against time, for records of several lengths and ensembles of several sizes.

`python -m study.accuracy.lengths` writes tables and diagram, study/accuracy/lengths.md and lengths.png: of records of so many
node spacings, and of means over so many of them that start evenly spread within one, those without a plateau left out. The
reference is the mean of three times as many long records that start between all of these.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from solver.case import Case
from solver.dynamics.coefficients import measured
from solver.dynamics.friction_limit import NoPlateauError
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.sliding.events import slide
from solver.sliding.plateau import plateau_of
from study.accuracy.digits import CASES, DRIVE, KINETIC, PLATEAU
from study.accuracy.timing import machine, timed
from study.execution.launch import pin_threads
from study.figures.shared.canvas import COLORS, PAGE, column, image

STATIC: Final = "μ_s"
OBSERVABLES: Final = (PLATEAU, STATIC, KINETIC)
SPACINGS: Final = (0.25, 0.5, 1.0, 2.0, 4.0)
MEMBERS: Final = (1, 2, 4, 8, 16)
ERRORS: Final = (0.03, 0.01, 0.003, 0.001)
"""Relative; of each the cheapest way to it is shown."""

Numbers = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


@dataclass(frozen=True, slots=True)
class Bought:
    """Error and time of one record length and number of members."""

    observable: str
    spacings: float
    members: int
    seconds: float
    """Processor time of all records, and of all drives for what drives measure, on average."""
    error: float
    """Relative difference from the reference, root mean square over sets of so many members; NaN where one set has no plateau."""
    known: float
    """Share of records with a plateau."""


def bought(case: Case, spacings: Sequence[float] = SPACINGS, members: Sequence[int] = MEMBERS) -> Iterator[Bought]:
    """Every length with every number of members; the largest number is a multiple of the others."""
    compliance, most = surface_compliance(case.slab), members[-1]
    between = [(number + part) / most for number in range(most) for part in (0.25, 0.5, 0.75)]
    reference = np.mean([_known(_start(case, start, spacings[-1]), compliance)[0] for start in between], 0)
    for length in spacings:
        found = [_known(_start(case, number / most, length), compliance) for number in range(most)]
        values, seconds = (np.array(column) for column in zip(*found, strict=True))
        known = 1.0 - float(np.isnan(values[:, 0]).mean())
        for count in members:
            errors = _sets(values, count) / reference - 1.0
            for place, observable in enumerate(OBSERVABLES):
                error = math.sqrt(float((errors[:, place] ** 2).mean()))
                yield Bought(observable, length, count, count * float(seconds[:, place].mean()), error, known)


def _start(case: Case, start: float, spacings: float) -> Case:
    return replace(case, start=start, max_events=None, max_spacings=spacings)


def _sets(values: Numbers, count: int) -> Numbers:
    """Means (sets, observables) over `count` evenly spread ones of the starts (most, observables), as far as they are known."""
    sets = values.reshape(count, len(values) // count, -1)
    known = ~np.isnan(sets)
    means: Numbers = np.where(known, sets, 0.0).sum(0) / np.where(known.any(0), known.sum(0), np.nan)
    return means


def _known(case: Case, compliance: SurfaceCompliance) -> tuple[list[float], list[float]]:
    """The observables of one start, and the seconds that each took."""
    record, sliding = timed(partial(slide, case, compliance))
    plateau = plateau_of(record)
    try:
        (_, friction), driving = timed(partial(measured, record, plateau, DRIVE))
    except NoPlateauError:
        return [math.nan] * 3, [sliding] * 3
    values = [plateau.mean, friction.static_friction, friction.kinetic_friction]
    return values, [sliding, sliding + driving, sliding + driving]


def cheapest(found: Sequence[Bought], observable: str, error: float) -> Bought | None:
    """The least time that gets an observable so right; None where nothing does."""
    enough = [each for each in found if each.observable == observable and each.error <= error]
    return min(enough, key=lambda each: each.seconds, default=None)


def as_markdown(found: dict[str, list[Bought]]) -> str:
    """Of each case the cheapest ways to an error, and all errors by length and members."""
    lines = [f"# What length and members buy\n\n{machine()['processor']}.\n"]
    for name, rows in found.items():
        lines += [f"## {name}\n", "Cheapest way to an error: node spacings × members, seconds.\n", *_prices(rows), ""]
        lines += ["Errors.\n", *_errors(rows), ""]
    return "\n".join(lines)


def _prices(rows: Sequence[Bought]) -> Iterator[str]:
    yield f"| error | {' | '.join(OBSERVABLES)} |"
    yield "|---" * (len(OBSERVABLES) + 1) + "|"
    for error in ERRORS:
        ways = [cheapest(rows, observable, error) for observable in OBSERVABLES]
        cells = [f"{way.spacings:g} × {way.members}, {way.seconds:.2g} s" if way else "none" for way in ways]
        yield f"| {error:.1%} | {' | '.join(cells)} |"


def _errors(rows: Sequence[Bought]) -> Iterator[str]:
    lengths = sorted({row.spacings for row in rows})
    yield f"| node spacings | | {' | '.join(f'{length:g}' for length in lengths)} |"
    yield "|---" * (len(lengths) + 2) + "|"
    share = {row.spacings: row.known for row in rows}
    yield f"| records with a plateau | | {' | '.join(f'{share[length]:.0%}' for length in lengths)} |"
    table = {(row.observable, row.members, row.spacings): row.error for row in rows}
    for observable in OBSERVABLES:
        for count in sorted({row.members for row in rows}):
            cells = [_percent(table[observable, count, length]) for length in lengths]
            yield f"| {observable} | {_members(count)} | {' | '.join(cells)} |"


def _percent(error: float) -> str:
    return "unknown" if math.isnan(error) else f"{error:.2%}"


def _members(count: int) -> str:
    return f"{count} member{'s'[: count > 1]}"


def draw(found: dict[str, list[Bought]]) -> bytes:
    """Error against time, as PNG: a row for each case, a panel for each observable, a line for each number of members."""
    with column(2.3 * len(found), PAGE) as figure:
        every = figure.subplots(len(found), len(OBSERVABLES), squeeze=False, sharex=True, sharey=True)
        for line, (name, rows) in zip(every, found.items(), strict=True):
            for axes, observable in zip(line, OBSERVABLES, strict=True):
                for color, count in zip(COLORS, sorted({row.members for row in rows}), strict=False):
                    own = [row for row in rows if (row.observable, row.members) == (observable, count)]
                    label = f"{count} member{'s'[: count > 1]}"
                    axes.loglog(
                        [row.seconds for row in own],
                        [row.error for row in own],
                        "o-",
                        color=color,
                        label=label,
                        markersize=3,
                    )
                axes.set_title(f"{observable}, {name}", fontsize=7.0)
        for axes in every[-1]:
            axes.set_xlabel("processor time (s)")
        for axes in every[:, 0]:
            axes.set_ylabel("relative error")
        figure.legend(*every[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=len(MEMBERS))
        return image(figure, "png")


def main() -> None:
    """Measure the paper's case and a coarser one, the coarser once before to have all compiled."""
    pin_threads()
    names = list(CASES)[:2]
    list(bought(CASES[names[0]], (0.25,), (1,)))
    found = {name: list(bought(CASES[name])) for name in names}
    Path(__file__).with_suffix(".md").write_text(as_markdown(found), "utf-8")
    Path(__file__).with_suffix(".png").write_bytes(draw(found))


if __name__ == "__main__":
    main()
