"""Computed loops beside measured ones, by the same rules: of a drive whose stage goes to and fro, or of strokes of a path."""

import math
from typing import Final, NamedTuple

import numpy as np
import xarray as xr

from nanoslip.solver.arrays import Floats
from nanoslip.solver.dynamics.to_and_fro import RUN_IN
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.dataset.units import read_scales
from nanoslip.study.dataset.variables import OUTCOMES
from nanoslip.study.measured.loops import Loops, measure_loops
from nanoslip.study.measured.means import Measured
from nanoslip.study.measured.recording import FEWEST_POINTS

POINTS: Final = 500
"""Evenly spaced points of a stroke of a path, on which its events are seen."""
LOAD: Final = "normal_load_si"


class ComputedLoops(NamedTuple):
    """Loops of a computed case: force over load and position in m; numbers by the names that measured loops have, with ±.

    ± is over starts; for a single start, over its strokes. A dataset keeps the motion of the first start only: numbers
    measured on this motion have no ± if there are several starts.
    """

    loops: Loops
    numbers: dict[str, Measured]
    load: float
    """Normal load of the case in N."""
    of_path: bool
    """True if the pin is moved itself, without a spring."""
    machine: float
    """Compliance in m that the measured position has over the computed one, per force over load."""


def read_computed_loops(case: xr.Dataset, attributes: dict[str, object], load: float, rig: float) -> ComputedLoops:
    """Loops of one case and drive. Raises ValueError if it has no loop.

    attributes: of the dataset. load: of the measurement, in N. rig: stiffness in N/m whose stretch is subtracted from the
    measured loop; infinite to keep it, as the spring of a drive then stays in the computed loop.
    """
    if "loss_per_cycle" in case:
        return _path_loops(case, attributes, load / rig)
    if "loop_energy" not in case:
        raise ValueError(
            "no stage of this campaign goes to and fro: needs a drive with stage_stroke, or strokes of a [path]"
        )
    return _stage_loops(case, attributes, load, rig)


def motion_of_drive(case: xr.Dataset) -> xr.Dataset:
    """The motion of a case's drive, with its numbers. Raises ValueError where it has none, with the reason."""
    if "trajectory_id" not in case:
        raise ValueError(
            "this campaign keeps no motion of a drive: needs [[drives]], dynamics in stages, no trajectory = false"
        )
    if not case["trajectory_id"].dims and not case["trajectory_id"].item():
        ending, message, *_ = OUTCOMES["drive"]
        stated = [variable.name for variable in (ending, message) if variable.name in case]
        parts = [str(case[name].item()) for name in stated]
        raise ValueError(": ".join(filter(None, ("this drive has no motion to draw", *parts))))
    return Accessor(case).trajectory().load()


def _stage_loops(case: xr.Dataset, attributes: dict[str, object], load: float, rig: float) -> ComputedLoops:
    run = motion_of_drive(case)
    begins = run["stage_leg_begin"].values if "stage_leg_begin" in run else np.empty(0)
    if not len(begins):
        raise ValueError(
            "this drive's stage keeps its direction, so it has no loop: needs one with stage_stroke, or a path"
        )
    # Without the strokes of the run-in; at least one there and one back are left.
    run_in = min(RUN_IN, len(begins) - 3)
    later = run["time"].values >= begins[run_in]
    load = float(run[LOAD]) if LOAD in run.coords else load
    spring = math.inf if math.isinf(rig) else float(run["spring_stiffness"])
    position = run["sample_stage"].values[later]
    force = run["sample_spring_force"].values[later]
    loops = _measure(position, force, load, spring)
    width = _slab_width(attributes)
    numbers = _numbers_of_one_start(run, loops)
    numbers |= _mean_over_starts(run, "loop_energy", "cycle_energy", load * width, "J")
    numbers |= _mean_over_starts(run, "midstroke_friction", "mid_stroke_friction", 1.0, "1")
    # A number that the computation could not find is none of a measurement of it either.
    if math.isnan(float(run["midstroke_friction"])):
        numbers.pop("mid_stroke_friction", None)
    if math.isfinite(rig):
        numbers |= _mean_over_starts(run, "pin_stroke_si", "contact_amplitude", 0.5, "m")
    return ComputedLoops(loops, numbers, load, of_path=False, machine=0.0)


def _path_loops(case: xr.Dataset, attributes: dict[str, object], machine: float) -> ComputedLoops:
    run = Accessor(case).path().load()
    cycles = int(run["cycles"])
    if not len(run["leg_begin"]) or math.isnan(float(run["loss_per_cycle"])):
        raise ValueError("this path has no cycles, so no loop: needs stroke or amplitude in [path]")
    if LOAD not in run.coords:
        raise ValueError("the loops of a path without [scales] have no size: needs slab_width and a modulus there")
    # The later half of the cycles, as the numbers of a dataset.
    first = len(run["leg_begin"]) - 2 * cycles + cycles // 2 * 2
    places, forces = [], []
    for leg in range(first, len(run["leg_begin"])):
        is_of_leg = run["path_leg"].values == leg
        displacement = run["path_displacement"].values[is_of_leg]
        force = run["path_friction"].values[is_of_leg]
        # Events lie where nodes slip; a stage is sampled evenly.
        first_place, last_place = float(displacement[0]), float(displacement[-1])
        place = np.linspace(first_place, last_place, POINTS)
        places.append(place)
        forces.append(_force_along(displacement, force, place))
    load, width = float(run[LOAD]), _slab_width(attributes)
    position = width * np.concatenate(places)
    loops = _measure(position, np.concatenate(forces), load, math.inf)
    numbers = _numbers_of_one_start(run, loops)
    numbers |= _mean_over_starts(run, "loss_per_cycle", "cycle_energy", load * width, "J")
    numbers |= _mean_over_starts(run, "turn_friction", "turn_friction", 1.0, "1")
    numbers |= _mean_over_starts(run, "secant_stiffness_si", "secant_stiffness", 1.0, "N m-1")
    numbers |= _mean_over_starts(run, "cycle_stroke_si", "contact_amplitude", 0.5, "m")
    return ComputedLoops(loops, numbers, load, of_path=True, machine=machine)


def _force_along(displacement: Floats, force: Floats, places: Floats) -> Floats:
    """Force of a leg at evenly spaced places: a leg to the left has its displacements in falling order."""
    way = 1.0 if displacement[-1] >= displacement[0] else -1.0
    return np.interp(way * places, way * displacement, force)


def _measure(position: Floats, force: Floats, load: float, spring: float) -> Loops:
    """Loops as a measurement of force and position has them. Raises ValueError where none is whole."""
    # The samples of a motion that failed end before its time does.
    done = np.isfinite(position + force)
    loops = None
    if np.count_nonzero(done) > FEWEST_POINTS:
        loops = measure_loops(position[done], force[done], "1", load, spring)
    if loops is None:
        raise ValueError("no cycle of this case is whole: needs more cycles, or more samples in each stroke")
    return loops


def _slab_width(attributes: dict[str, object]) -> float:
    """L_x in m."""
    scales = read_scales(attributes)
    if scales is None:
        raise ValueError("this dataset states no scales: collect it again")
    return scales.slab_width


def _numbers_of_one_start(run: xr.Dataset, loops: Loops) -> dict[str, Measured]:
    """Numbers of the start that has its motion in a dataset; without ± if that is one of several."""
    if float(run.get("members", 1.0)) > 1.0:
        numbers = loops.numbers.items()
        return {name: number._replace(uncertainty=math.nan, of=1) for name, number in numbers}
    return dict(loops.numbers)


def _mean_over_starts(run: xr.Dataset, name: str, measured: str, factor: float, unit: str) -> dict[str, Measured]:
    """A number of a dataset with its ± over starts, by its measured name; none where the dataset has none or a single start."""
    error = f"{name}_uncertainty"
    if name not in run or error not in run or run[name].isnull():
        return {}
    members = run.get(f"{name}_members")
    count = 1 if members is None or members.isnull() else int(members)
    mean = factor * float(run[name])
    uncertainty = factor * float(run[error])
    return {measured: Measured(mean, uncertainty, count, unit)}
