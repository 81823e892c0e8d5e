"""Where initial contact is forgotten: means over steady parts that begin after so many presliding lengths, and are so long.

`python -m tests.verification.run_in [CASES]` measures them and writes tests/verification/run_in.csv. The
reference is the mean over the same starts from 3 to 24 presliding lengths: what differs from it is memory of initial contact, and
the part of a node spacing that the pin has seen.
"""

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import teeth
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.manifest.parameters import LIMITS
from tests.written_tables import show

BEGINS = (0.5, 1.0, 1.5, 2.0, 3.0)
LENGTHS = (2.0, 4.0, 6.5, 12.0)
REFERENCE = (3.0, 24.0)
MOST_EVENTS = 60_000
MEMBERS = 8


def drawn(seed: int) -> Case:
    """A case from all over the map, its record as long as a campaign's without limits.

    Schemes, layers 0.05 to 1, ν up to 0.5, supports, slip rules, spreads, 7 to 40 nodes in contact, μ_i 0.05 to 1.
    """
    rng = np.random.default_rng([2029, seed])
    scheme = str(rng.choice(["biquadratic", "galerkin", "half_plane", "strip", "strip"]))
    endless = scheme in ("half_plane", "strip")
    poisson = float(rng.uniform(0.0, 0.5 if endless else 0.38))
    height = math.exp(rng.uniform(math.log(0.05), 0.0)) if scheme == "strip" else float(rng.choice([1.0, 2.0]))
    support = "bonded" if endless else str(rng.choice(["bonded", "bonded", "right_side"]))
    slab = Slab(int(rng.choice([33, 65])), height, poisson, support, scheme)  # type: ignore[arg-type]
    half_width = min(math.exp(rng.uniform(math.log(7), math.log(40))) / 2 * slab.spacing, 0.35)
    normal_load = 10.0 ** rng.uniform(-4.0, -2.5)
    flat = rng.random() < 0.1
    return Case(
        intrinsic_friction=math.exp(rng.uniform(math.log(0.05), 0.0)),
        radius=half_width**2 * math.pi / (2 * normal_load * (1 - poisson)),
        half_width=half_width,
        pin="flat_punch" if flat else "parabola",
        normal_load=normal_load,
        slab=slab,
        slip_rule=SlipRule(
            slip_order=str(rng.choice(["worst_first", "worst_first", "simultaneous"])),  # type: ignore[arg-type]
            residual_shear=float(rng.choice([0.0, 0.0, 0.5, 0.9])),
        ),
        heterogeneity=Heterogeneity(spread=float(rng.choice([0.0, 0.0, 0.0, 0.1, 0.3]))),
        **LIMITS,  # type: ignore[arg-type]
    )


def means(number: int) -> dict[tuple[float, float], np.ndarray] | None:
    """Begin and length (presliding lengths) -> mean force of each member; None where a record does not go so far."""
    case, found = replace(drawn(number), max_events=MOST_EVENTS, max_presliding=REFERENCE[1]), []
    compliance = surface_compliance(case.slab)
    for member in range(MEMBERS):
        record = slide(Ensemble(MEMBERS).case(case, member), compliance)
        if not record.outcome.ok or len(record.displacement) == MOST_EVENTS:
            return None
        whole, unit = teeth(record), record.presliding_length
        windows = {(begin, length): (begin, begin + length) for begin in BEGINS for length in LENGTHS}
        windows[REFERENCE] = REFERENCE
        found.append(
            {
                key: np.diff(whole.integral(unit * np.array(ends)))[0] / (unit * (ends[1] - ends[0]))
                for key, ends in windows.items()
            }
        )
    return {key: np.array([each[key] for each in found]) for key in found[0]}


def main() -> None:
    """Measure so many cases and write the table."""
    wanted, found, number = int(sys.argv[1]) if len(sys.argv) > 1 else 100, [], 0
    while len(found) < wanted:
        if (each := means(number)) is not None:
            found.append(each)
        number += 1
    rows = [("steady part from", "long", "median difference", "of 95 in 100", "less than ±", "than 2 ±")]
    for key in ((begin, length) for begin in BEGINS for length in LENGTHS):
        apart, times = [], []
        for each in found:
            mean, truth = mean_of(each[key]), float(each[REFERENCE].mean())
            apart.append(abs(float(mean.mean) - truth) / truth)
            times.append(abs(float(mean.mean) - truth) / max(float(mean.uncertainty), math.ulp(truth)))
        shares = [np.mean(np.array(times) <= limit) for limit in (1.0, 2.0)]
        cells = (f"{np.median(apart):.2%}", f"{np.quantile(apart, 0.95):.2%}", *(f"{share:.0%}" for share in shares))
        rows.append((f"{key[0]:g}", f"{key[1]:g}", *cells))
    show(rows, Path(__file__).with_suffix(".csv"))


if __name__ == "__main__":
    main()
