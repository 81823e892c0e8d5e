"""A table of claims: the paper's statement, the dataset's number, and why the two differ."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared.paper import Stated


@dataclass(frozen=True, slots=True)
class Claim:
    """One number or statement of the paper beside the dataset's."""

    meaning: str
    paper: str
    found: str
    remark: str = ""
    """Why the two differ, or what agreement means."""


HEADER: Final = ("", "paper", "found", "remark")
WITHOUT_PAPER: Final = ("", "", "found", "remark")
"""Of a table whose claims have no number of the paper to compare with."""


def table(claims: Iterable[Claim], header: Sequence[str] = HEADER) -> str:
    """Claims as a Markdown table."""
    lines = [header, ("---",) * len(header), *map(as_row, claims)]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def as_row(claim: Claim) -> tuple[str, str, str, str]:
    """The cells of a claim, in the order of `HEADER`."""
    return claim.meaning, claim.paper, claim.found, claim.remark


def over_starts(values: NDArray[np.float64], digits: int = 4, scale: float = 1.0) -> str:
    """Mean, standard deviation and range of a number over the starts (any shape) of an ensemble; NaN do not count."""
    found = _known(values, scale)
    if not len(found):
        return "none"
    low, high = found.min(), found.max()
    if low == high:
        return f"{low:.{digits}g} from every start" if len(found) > 1 else f"{low:.{digits}g}"
    mean, _, deviation = with_error(found.mean(), found.std(ddof=1)).partition(" ± ")
    return f"{mean} (s.d. {deviation}, {low:.{digits}g} to {high:.{digits}g})"


def compared(
    stated: Stated, values: NDArray[np.float64], why: str = "", meaning: str = "", digits: int = 4, scale: float = 1.0
) -> Claim:
    """The claim that a number of the paper is what starts give: its remark begins with whether it lies in their range.

    values: (m,) one for each start; scale: into the unit of the paper's number.
    """
    found = _known(values, scale)
    remark = "; ".join(part for part in (_verdict(stated, found), why) if part)
    return Claim(meaning or stated.meaning, str(stated), over_starts(found, digits), remark)


def _known(values: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    found = scale * np.asarray(values, dtype=float).ravel()
    return np.asarray(found[np.isfinite(found)])


def _verdict(stated: Stated, found: NDArray[np.float64]) -> str:
    """Whether a number lies within the range of starts, else how far from their mean."""
    if not len(found):
        return ""
    if found.min() - stated.doubt <= stated.value <= found.max() + stated.doubt:
        return "within the range of starts" if len(found) > 1 else "agrees"
    deviation = found.std(ddof=1) if len(found) > 1 else 0.0
    return f"{abs(stated.value - found.mean()) / deviation:.2g} standard deviations off" if deviation else "differs"
