"""What each effect costs: time and peak memory with it on, against off, all in one run for the paper's case and drive.

Peak memory is that of arrays made while it runs (`tracemalloc`), beside the compliance and the program.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from nanoslip import Case, Drive, FrictionRecord, SurfaceCompliance, friction_record, plateau_of
from nanoslip.solver.case import Effects, Heterogeneity
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.dynamics.friction_limit import make_friction_limit
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.interior import interior_fields
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.slide import find_states, slide
from nanoslip.study.results.entry import pack_result
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.record import record_task
from tests.benchmarks.dynamics import PAPER, STEP, UNIT
from tests.benchmarks.table import Row, arrays_of, best, seconds, verdict

WITHOUT = {
    "surface compliance (and hysteresis)": {"surface_compliance": False},
    "reverse motion": {"reverse_motion": False},
    "damping": {"damping_ratio": 0.0},
    "fine teeth (profile `coarse` when off)": {"profile": "coarse"},
    "teeth (profile `mean` when off)": {"profile": "mean"},
    "teeth and surface compliance": {"profile": "mean", "surface_compliance": False},
}
CASE = Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(scheme="biquadratic"))


def rows() -> list[Row]:
    """One row per effect of contact, sliding, output and drive; of a drive with RK4 too where the effect is its own code."""
    compliance = surface_compliance(CASE.slab)
    record = slide(CASE, compliance)
    stepping = replace(PAPER, integrator=RK4(STEP / UNIT))
    drives = [_row(record, PAPER, name, effect) for name, effect in WITHOUT.items()]
    drives += [_row(record, stepping, "reverse motion, by RK4 at 100 ns", WITHOUT["reverse motion"])]
    parts = (_contact, _sliding, _outputs)
    return [_operators(), *(row for part in parts for row in part(compliance)), _stages(compliance, record), *drives]


def _contact(compliance: SurfaceCompliance) -> list[Row]:
    def touch(effects: Effects) -> tuple[float, float]:
        return _time_and_memory(partial(initial_contact, replace(CASE, effects=effects), compliance), 20)

    whole = touch(Effects())
    return [
        _against("initial contact without friction", touch(Effects(friction=False)), whole, "≤ 1/3", 1 / 3),
        _against("initial contact without coupling", touch(Effects(coupling=False)), whole),
    ]


def _sliding(compliance: SurfaceCompliance) -> list[Row]:
    """Time for each slip: the records of reduced models have other numbers of slips to 2000 events."""

    each_slip = partial(_each_slip, compliance)
    whole = each_slip(CASE)
    spread = each_slip(replace(CASE, heterogeneity=Heterogeneity(spread=0.2)))
    reduced = {
        "without coupling": Effects(coupling=False),
        "without pin_translation": Effects(pin_translation=False),
        "without both": Effects(coupling=False, pin_translation=False),
    }
    rough = each_slip(replace(CASE, heterogeneity=_roughness(1e-5)))
    aims = {name: "" if effects.pin_translation else "≤ 1/2" for name, effects in reduced.items()}
    return [
        *(
            _against(f"a slip {name}", each_slip(replace(CASE, effects=effects)), whole, aims[name], 0.5)
            for name, effects in reduced.items()
        ),
        _against("a slip without spread of μ_i", whole, spread),
        _against("a slip (with events) of a smooth pin, not rough (1001 points)", whole, rough),
        _fine(),
    ]


def _fine() -> Row:
    """Both are followed by the nodes near the contact alone, here 67 of 513."""
    case = replace(CASE, slab=Slab(n_x=513), radius=10.0)
    compliance = surface_compliance(case.slab)
    smooth, rough = (_each_slip(compliance, each) for each in (case, replace(case, heterogeneity=_roughness(1e-7))))
    row = _against("a slip of a smooth pin, not slightly rough, n_x = 513", smooth, rough)
    return replace(row, target=verdict("≥ 1/5", smooth[0] >= 0.2 * rough[0]))


def _roughness(height: float) -> Heterogeneity:
    heights = height * np.random.default_rng(1).standard_normal(1001)
    return Heterogeneity(roughness=tuple(zip(np.linspace(-0.6, 0.6, 1001).tolist(), heights.tolist(), strict=True)))


def _each_slip(compliance: SurfaceCompliance, case: Case) -> tuple[float, float]:
    start = initial_contact(case, compliance)
    run = partial(slide, case, compliance, start)
    duration, memory = _time_and_memory(run, 7)
    return duration / int(run().slips.sum()), memory


def _operators() -> Row:
    """The compliance of the slab and of the half-plane."""
    slabs = (Slab(), Slab(scheme="half_plane"))
    finite, infinite = (_time_and_memory(partial(surface_compliance, slab), 5) for slab in slabs)
    return _against("compliance of a half-plane, not of the finite slab", infinite, finite)


def _stages(compliance: SurfaceCompliance, record: FrictionRecord) -> Row:
    """The paper's drive ten times as long at a tenth of its speed, in steps of 100 ns: there dynamics takes the time."""
    stage = {"stage_velocity": PAPER.stage_velocity / 10, "duration": 10 * PAPER.duration}
    slow = replace(PAPER, integrator=RK4(STEP / UNIT), **stage)
    profile = make_friction_limit(record, plateau_of(record), slow.profile)
    plateau = _time_and_memory(lambda: plateau_of(friction_record(CASE, compliance)), 5)
    motion = _time_and_memory(lambda: integrate(profile, slow, record.initial_stiffness), 2)
    both = (plateau[0] + motion[0], max(plateau[1], motion[1]))
    return _against("plateau without 2 s of a slow drive by RK4 at 100 ns", plateau, both, "≤ 1/5", 0.2)


def _outputs(compliance: SurfaceCompliance) -> list[Row]:
    record = _time_and_memory(partial(slide, CASE, compliance), 5)
    at = _time_and_memory(partial(find_states, CASE, compliance, (0, 1000, 2000)), 5)
    force = initial_contact(CASE, compliance).nodal_force
    inside = _time_and_memory(partial(interior_fields, CASE.slab, force), 5)
    return [
        _against("2000 events, without tractions kept at 0, 1000 and 2000", record, at),
        Row("inside of the slab, once", "0 s, 0 MB", _shown(inside), "0"),
        *_files(),
    ]


def _files() -> list[Row]:
    """Bytes that a case leaves in the store, scalars only, against with its arrays."""
    found = []
    with TemporaryDirectory() as folder:
        store = Store(Path(folder))
        store.prepare()
        compliance = run_task(compliance_task(CASE.slab), {})
        for name, make in (("initial contact", contact_task), ("a record of 2000 events", record_task)):
            size = {}
            for only in (True, False):
                task = make(CASE, scalars_only=only)
                store.write(run_task(task, {compliance.key: compliance}))
                size[only] = len(pack_result(store.read(task.key))) / 1e3
            scalars, whole = (f"{size[only]:.1f} kB" for only in (True, False))
            ratio, target = f"{size[True] / size[False]:.2f}", verdict("≤ 10 kB", size[True] <= 10.0)
            found.append(Row(f"file of {name}, scalars only", scalars, f"{whole} (with arrays)", ratio, target))
    return found


def _against(what: str, off: Sequence[float], on: Sequence[float], target: str = "", most: float = float("inf")) -> Row:
    ratio = off[0] / on[0]
    return Row(what, _shown(off), f"{_shown(on)} (on)", f"{ratio:.2f}", target and verdict(target, ratio <= most))


def _shown(cost: Sequence[float]) -> str:
    return f"{seconds(cost[0])}, {cost[1] / 1e6:.2g} MB"


def _time_and_memory(run: Callable[[], object], repeats: int) -> tuple[float, float]:
    """Processor seconds, best of several, and peak bytes of arrays."""
    return best(run, repeats), arrays_of(run)


def _row(record: FrictionRecord, drive: Drive, name: str, effect: dict[str, object]) -> Row:
    (on, on_steps), (off, off_steps) = (_cost(record, each) for each in (drive, replace(drive, **effect)))
    steps = f"({off_steps} for {on_steps} steps)"
    return _against(f"0.2 s of a drive without {name} {steps}", off, on)


def _cost(record: FrictionRecord, drive: Drive) -> tuple[tuple[float, float], int]:
    """Seconds and bytes to integrate a drive over its profile, and its segments or steps."""
    profile = make_friction_limit(record, plateau_of(record), drive.profile)
    run = partial(integrate, profile, drive, record.initial_stiffness)
    return _time_and_memory(run, repeats=20), run().steps
