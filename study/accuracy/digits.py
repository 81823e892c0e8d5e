"""Cost of a smaller uncertainty: processor time against the target uncertainty of plateau and kinetic friction.

`python -m study.accuracy.digits` writes the table, study/accuracy/digits.md. Each number is over several starts of the pin within
a node spacing. The error is against the mean of long records from all of them, each start against the others.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from solver.case import Case
from solver.drive import Drive, Scales
from solver.dynamics.coefficients import measured
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.slab import Slab
from solver.sliding.events import slide
from solver.sliding.plateau import plateau_of
from study.accuracy.timing import machine, timed
from study.execution.launch import pin_threads

CASES: Final = {
    "n_x = 65": Case(slab=Slab(65)),
    "n_x = 129, the paper's": Case(),
    "n_x = 129, μ_i = 0.25, half the load": Case(intrinsic_friction=0.25, normal_load=5e-4),
}
TARGETS: Final = (0.03, 0.01, 0.003, 0.001, 0.0003)
STARTS: Final = 8
LONGEST: Final = 16.0
"""Node spacings that a record may take to a target."""
REFERENCE: Final = 6.0
"""Node spacings of the records that errors are held against; further on the contact comes to another part of the slab."""
OF_RECORD: Final = 0.7
"""Share of a drive's uncertainty that its record may have."""
DRIVE: Final = Drive.from_si(Scales(), stage_travel=2e-3)
"""The paper's, over twice the width of the slab."""
PLATEAU, KINETIC = "plateau", "μ_k"


@dataclass(frozen=True, slots=True)
class Price:
    """Time and error of one target uncertainty."""

    observable: str
    target: float
    reached: float
    """Share of starts."""
    spacings: float
    """Of the record, on average."""
    seconds: float
    """Processor time of the record, and of the drive for kinetic friction, on average."""
    stated: float
    """Relative uncertainty, root mean square."""
    error: float
    """Relative difference from the reference, root mean square."""


def prices(case: Case, targets: tuple[float, ...] = TARGETS, longest: float = LONGEST) -> Iterator[Price]:
    """The price of every target for plateau and kinetic friction of one case."""
    compliance = surface_compliance(case.slab)
    starts = [
        replace(case, start=(number + 0.5) / STARTS, max_events=None, max_spacings=longest) for number in range(STARTS)
    ]
    long = [_known(replace(start, max_spacings=min(REFERENCE, longest)), DRIVE, compliance) for start in starts]
    for observable in (PLATEAU, KINETIC):
        reference = np.array([each[observable][0] for each in long])
        for target in targets:
            yield _price(observable, target, starts, reference, compliance)


def _price(
    observable: str, target: float, starts: list[Case], reference: np.ndarray, compliance: SurfaceCompliance
) -> Price:
    of_record = target if observable == PLATEAU else OF_RECORD * target
    drive = replace(DRIVE, uncertainty=target) if observable == KINETIC else None
    rows = []
    for number, start in enumerate(starts):
        aimed = replace(start, target_uncertainty=of_record)
        found, seconds = timed(partial(_known, aimed, drive, compliance))
        value, stated, spacings = found[observable]
        truth = float(np.delete(reference, number).mean())
        rows.append((stated <= target, spacings, seconds, stated, abs(value - truth) / truth))
    reached, spacings, seconds, stated, error = np.array(rows).T
    return Price(
        observable,
        target,
        *(float(column.mean()) for column in (reached, spacings, seconds)),
        *(math.sqrt(float((column**2).mean())) for column in (stated, error)),
    )


def _known(case: Case, drive: Drive | None, compliance: SurfaceCompliance) -> dict[str, tuple[float, float, float]]:
    """Observable -> value, its relative uncertainty, and the record's node spacings; kinetic friction with a drive."""
    record = slide(case, compliance)
    plateau, spacings = plateau_of(record), record.final_displacement / record.spacing
    found = {PLATEAU: (plateau.mean, plateau.relative_uncertainty, spacings)}
    if drive is not None:
        _, friction = measured(record, plateau, drive)
        found[KINETIC] = (friction.kinetic_friction, friction.relative_uncertainty, spacings)
    return found


def exponent(found: list[Price]) -> float:
    """p of seconds ∝ uncertainty^-p, a line through the logarithms of what all starts reached."""
    reached = [each for each in found if each.reached == 1.0]
    stated, seconds = np.log([[each.stated, each.seconds] for each in reached]).T
    return -float(np.polyfit(stated, seconds, 1)[0])


def as_markdown(found: dict[str, list[Price]]) -> str:
    """A table for each case and observable, with its exponent."""
    lines = [f"# What a digit costs\n\n{STARTS} starts of each case; {machine()['processor']}.\n"]
    for name, rows in found.items():
        for observable in (PLATEAU, KINETIC):
            own = [each for each in rows if each.observable == observable]
            lines.append(f"## {observable}, {name}\n\nCost ∝ uncertainty^-{exponent(own):.2g}.\n")
            lines.append(
                "| asked for | reached by | node spacings | seconds | stated ± | error |\n|---|---|---|---|---|---|"
            )
            lines += [
                f"| {each.target:.2%} | {each.reached:.0%} | {each.spacings:.2g} | {each.seconds:.2g} | "
                f"{each.stated:.2%} | {each.error:.2%} |"
                for each in own
            ]
            lines[-1] += "\n"
    return "\n".join(lines)


def main() -> None:
    """Measure all cases, the first of them once before to have all compiled."""
    pin_threads()
    list(prices(CASES["n_x = 65"], TARGETS[:1], 0.5))
    text = as_markdown({name: list(prices(case)) for name, case in CASES.items()})
    Path(__file__).with_suffix(".md").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
