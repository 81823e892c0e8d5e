"""What each effect of a drive costs: the paper's drive with the effect on, against the same with it off."""

from dataclasses import replace
from functools import partial

from solver import Case, Drive, FrictionRecord, friction_record, plateau_of
from solver.dynamics import integrate
from solver.profile import profile_of
from tests.benchmarks.dynamics import PAPER, STEP, UNIT
from tests.benchmarks.table import Row, best, seconds

WITHOUT = {
    "surface compliance (and hysteresis)": {"surface_compliance": False},
    "reverse motion": {"reverse_motion": False},
    "damping": {"damping_ratio": 0.0},
    "teeth (profile `mean` when off)": {"profile": "mean"},
    "teeth and surface compliance": {"profile": "mean", "surface_compliance": False},
}


def rows() -> list[Row]:
    """One row per effect; with RK4 too where the effect is its own code."""
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0))
    stepping = replace(PAPER, integrator="rk4", time_step=STEP / UNIT)
    found = [_row(record, PAPER, name, effect) for name, effect in WITHOUT.items()]
    return [*found, _row(record, stepping, "reverse motion, by RK4 at 100 ns", WITHOUT["reverse motion"])]


def _row(record: FrictionRecord, drive: Drive, name: str, effect: dict[str, object]) -> Row:
    (on, on_steps), (off, off_steps) = (_cost(record, each) for each in (drive, replace(drive, **effect)))
    return Row(
        f"0.2 s of the paper's drive without {name} ({off_steps} segments or steps)",
        seconds(off),
        f"{seconds(on)} (with it, {on_steps})",
        f"{off / on:.2f}",
        "",
    )


def _cost(record: FrictionRecord, drive: Drive) -> tuple[float, int]:
    """Seconds to integrate a drive over its profile, and its segments or steps."""
    profile = profile_of(record, plateau_of(record), drive.profile)
    run = partial(integrate, profile, drive, record.initial_stiffness)
    return best(run, repeats=20), run().steps
