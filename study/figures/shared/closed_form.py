"""The driven pin by Eq. 16-19 in SI, with given coefficients: what measured motion is compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.stick_slip import stick_slip

Floats = NDArray[np.float64]
COEFFICIENTS = ("fitted_kinetic_friction", "fitted_static_friction", "fitted_later_static_friction")


@dataclass(frozen=True, slots=True, eq=False)
class ClosedForm:
    """Eq. 16-19 with given coefficients, in SI: time (s), position (m), velocity (m/s), spring force over W; each (n,)."""

    time: Floats
    position: Floats
    velocity: Floats
    spring_force: Floats


def scales_of(attributes: Mapping[Any, Any]) -> Scales | None:
    """The scales of a dataset, from its attributes; None where these do not state them."""
    names = [item.name for item in fields(Scales)]
    if not all(name in attributes for name in names):
        return None
    return Scales(**{name: float(attributes[name]) for name in names})


def scales_in(dataset: xr.Dataset) -> Scales:
    """The scales of a dataset of a shipped campaign, whose attributes state them."""
    found = scales_of(dataset.attrs)
    assert found is not None
    return found


def closed_form(
    case: xr.Dataset, scales: Scales, time: Floats, kinetic: float, static: float, later_static: float
) -> ClosedForm:
    """The motion that Eq. 16-19 give at times (n,), in s from 0 on, for the drive of one case with these coefficients."""
    given = {name: float(case[name]) for name in ("spring_stiffness", "damping_ratio", "stage_velocity")}
    drive = Drive.from_si(scales, float(case["pin_mass"]), duration=float(time[-1]), **given)
    load, unit = float(case["normal_load"]), scales.time(float(case["pin_mass"]))
    motion = stick_slip(time / unit, drive, kinetic * load, static * load, later_static * load)
    velocity = scales.slab_width / unit
    return ClosedForm(time, scales.slab_width * motion.position, velocity * motion.velocity, motion.spring_force / load)


def fitted(case: xr.Dataset, scales: Scales | None, time: Floats) -> ClosedForm | None:
    """Eq. 16-19 with the coefficients that fit the spring force of one case best; None where nothing was fitted."""
    if scales is None or len(time) < 2:
        return None
    kinetic, static, later = (float(case[name]) if name in case else np.nan for name in COEFFICIENTS)
    if not np.isfinite(kinetic + static):
        return None
    return closed_form(case, scales, time, kinetic, static, static if np.isnan(later) else later)
