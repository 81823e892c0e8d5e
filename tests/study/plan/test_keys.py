"""A key hashes all of a case but what a line in nanoslip.study.tasks.task excludes: whatever is added to a case is told apart."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, get_args

import pytest

from nanoslip.solver import case as case_module, drive as drive_module, slab as slab_module
from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.drive import INTEGRATORS, OF_A_STROKE, Drive, Integrator, Scales
from nanoslip.solver.dynamics.integrators import RK4
from nanoslip.solver.elasticity import grid as grid_module
from nanoslip.solver.elasticity.schemes import Galerkin
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import declared
from nanoslip.solver.slab import SCHEMES, Scheme, Slab
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.task import (
    OF_CONTACT,
    OF_RECORD,
    Exclusion,
    deciding_fields,
    ineffective_parameters,
    list_dotted_fields,
)
from tests.study.plan.running import CASE, DRIVE

BASES = {
    "smooth": Case(),
    "spread": Case(heterogeneity=Heterogeneity(spread=0.1)),
    "punch": Case(pin="flat_punch"),
    "paper's scheme": Case(slab=Slab(scheme="biquadratic")),
    "half-plane": Case(slab=Slab(scheme="half_plane")),
    "half-space": Case(slab=Slab(scheme="half_space")),
    "chain": Case(slab=Slab(scheme="chain")),
    "without coupling": Case(effects=Effects(coupling=False)),
    "without limits of events": Case(max_events=None, max_spacings=2.0),
}
DRIVES = (
    Drive(1.0, 0.1, 0.1, 10.0),
    Drive(1.0, 0.1, 0.1, 10.0, RK4(0.1)),
    Drive(1.0, 0.1, 0.1, None, stage_stroke=1.0),
)
MODULES = (case_module, drive_module, grid_module, slab_module)
KINDS_OF_WORDS = [kind for module in MODULES for kind in vars(module).values()]
WORDS = sorted({word for kind in KINDS_OF_WORDS for word in get_args(kind) if isinstance(word, str)})
ROUGH, LOADS, LEGS = ((-0.1, 0.0), (0.1, 1e-6)), (1.0, 2.0), ((0.1, 1.0),)


def others(value: Any) -> Iterator[Any]:
    """What a field of this value may be instead; not all of it will be allowed."""
    if isinstance(value, Scheme | Integrator):
        yield from (*SCHEMES, *INTEGRATORS)
    elif isinstance(value, bool):
        yield not value
    elif isinstance(value, str):
        yield from (word for word in WORDS if word != value)
    elif isinstance(value, tuple):
        yield from (ROUGH, LOADS, LEGS)
    elif value is None:
        yield from (3, 0.1, *WORDS)
    else:
        yield from (2 * value, value / 2, value + 1, 2 * value - 1, (value + 1) / 2, 0.3)


def changed(base: Any, path: str) -> Any:
    """A dataclass with one field, by its dotted name, made another; None where nothing else is allowed there."""
    return next(_changes(base, path), None)


def _changes(base: Any, path: str) -> Iterator[Any]:
    name, _, rest = path.partition(".")
    part = getattr(base, name)
    for other in _changes(part, rest) if rest else others(part):
        made = _allowed(base, name, other)
        if made is not None:
            yield made


def _allowed(base: Any, name: str, value: Any) -> Any:
    try:
        made = replace(base, **{name: value})
    except InvalidInput:
        return None
    return None if getattr(made, name) == getattr(base, name) else made


def excluded(case: Case, path: str, exclusions: tuple[Exclusion, ...]) -> bool:
    return any(
        path == name or path.startswith(f"{name}.") for each in exclusions if each.where(case) for name in each.names
    )


KINDS = {
    "contact": (contact_task, OF_CONTACT),
    "record": (record_task, OF_RECORD),
    "drive": (lambda case: drive_task(case, DRIVES[0]), OF_RECORD),
    "states at first": (lambda case: states_task(case, (0,), False), OF_CONTACT),
    "states": (lambda case: states_task(case, (0, 3), False), OF_RECORD),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_field_of_a_case_is_in_the_key_or_excluded_with_a_reason(kind):
    make, exclusions = KINDS[kind]
    assert all(each.reason for each in exclusions)
    seen = set()
    for label, base in BASES.items():
        for path, _ in list_dotted_fields(base):
            other = changed(base, path)
            if other is None:
                continue
            seen.add(path)
            same = make(other).key == make(base).key
            if path in ("max_displacement", "max_spacings") and exclusions is OF_RECORD:
                assert same == (other.farthest == base.farthest), (label, path)
            else:
                assert same == (excluded(base, path, exclusions) and excluded(other, path, exclusions)), (label, path)
    # No field that this walk does not know how to change.
    assert seen == {path for base in BASES.values() for path, _ in list_dotted_fields(base)}


def test_every_field_of_a_drive_is_in_its_key():
    """Motion and cycles of a stage only where it has a stroke, without which they change nothing."""
    seen = set()
    for base in DRIVES:
        for path, _ in list_dotted_fields(base):
            other = changed(base, path)
            if other is None:
                continue
            seen.add(path)
            same = drive_task(Case(), other).key == drive_task(Case(), base).key
            assert same == (path in OF_A_STROKE[1:] and base.stage_stroke is None), path
    assert seen == {path for base in DRIVES for path, _ in list_dotted_fields(base)}


@dataclass(frozen=True, slots=True)
class Greased(Case):
    """A case as somebody may extend it."""

    film: float = 0.0


def test_a_field_that_is_new_is_in_every_key():
    dry, wet = Greased(), Greased(film=1e-9)
    for make, _ in KINDS.values():
        assert make(wet).key != make(dry).key


def test_an_exclusion_of_what_no_case_has_is_refused():
    with pytest.raises(KeyError, match="colour: "):
        deciding_fields(Case(), (Exclusion(("colour",), "nobody looks"),))
    assert "heterogeneity.seed" not in deciding_fields(Case(), OF_RECORD)
    assert not math.isfinite(Case().farthest)


def test_a_compliance_is_known_by_its_slab_alone():
    other = replace(CASE, intrinsic_friction=0.1, radius=9.0, slip_rule=SlipRule(residual_shear=0.5))
    assert record_task(other).needs == record_task(CASE).needs == (compliance_task(Slab(33)).key,)
    assert compliance_task(Slab(33, poisson=0.3)).key != compliance_task(Slab(33)).key
    assert (
        compliance_task(Slab(33, scheme=Galerkin(rows_per_level=2))).key == compliance_task(Slab(33)).key
    )  # the default


def test_a_friction_record_is_known_without_the_drive():
    faster = replace(DRIVE, stage_velocity=2 * DRIVE.stage_velocity)
    assert drive_task(CASE, faster).needs == drive_task(CASE, DRIVE).needs == (record_task(CASE).key,)
    assert drive_task(CASE, faster).key != drive_task(CASE, DRIVE).key


def test_a_limit_in_spacings_is_known_by_its_displacement():
    """The same place said in other words is the same task; of two limits, only the nearer decides."""
    there = replace(CASE, max_displacement=4.0 / 32.0)
    for other in (
        replace(CASE, max_spacings=4.0),
        replace(CASE, max_spacings=4.0, max_displacement=1.0),
        replace(CASE, max_spacings=7.0, max_displacement=4.0 / 32.0),
    ):
        assert record_task(other).key == record_task(there).key
        assert drive_task(other, DRIVE).key == drive_task(there, DRIVE).key
    assert record_task(replace(CASE, max_spacings=4.5)).key != record_task(there).key
    # Initial contact comes before any limit, and knows where the pin starts.
    assert contact_task(there).key == contact_task(CASE).key != contact_task(replace(CASE, start=0.5)).key


def test_what_a_pin_does_not_have_is_not_in_its_key():
    punch = replace(CASE, pin="flat_punch")
    assert record_task(replace(CASE, half_width=0.1)).key == record_task(CASE).key
    assert record_task(replace(punch, radius=1.0)).key == record_task(punch).key
    assert record_task(replace(punch, half_width=0.1)).key != record_task(punch).key


def test_scales_matter_to_a_drive_by_its_dimensionless_numbers_only():
    """Four times the modulus, spring and mass: the same numbers (all factors are powers of two, exact in binary)."""
    stiff = NamedDrive.of("stiff", duration=0.2, pin_mass=2.0, spring_stiffness=8e5, samples=50)
    assert drive_task(CASE, stiff.dimensionless(Scales(shear_modulus=4e10))).key == drive_task(CASE, DRIVE).key


def test_parameters_without_effect_are_named_as_a_campaign_names_them():
    always = {"loads", "measured_loads", *declared(LoadPath)}
    assert ineffective_parameters(Case()) == {"half_width", "start_y", "distribution", "seed", *always}
    punch = ineffective_parameters(Case(pin="flat_punch", heterogeneity=Heterogeneity(spread=0.1)))
    assert punch == {"radius", "start_y", *always}
    assert "cycles" in ineffective_parameters(Case(path=LoadPath(slid=1.0)))
    assert not ineffective_parameters(Case(path=LoadPath(amplitude=1.0))) & {*declared(LoadPath)}
    uncoupled = ineffective_parameters(Case(effects=Effects(coupling=False)), OF_CONTACT)
    assert {"intrinsic_friction", "slip_order", "residual_shear", "event_floor", "max_events"} <= uncoupled
    assert uncoupled <= set(Case().flat)
