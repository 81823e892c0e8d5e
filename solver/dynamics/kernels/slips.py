"""Driving force, and slips: from stick to slip and back."""

import math

import numpy as np

from nanoslip.solver.compiled import compiled
from nanoslip.solver.dynamics.kernels.state import Floats, Motion, Pin, Slip, SlipRow


@compiled(error_model="numpy")
def driving_force(motion: Motion, pin: Pin) -> float:
    """Spring and damper together."""
    stretch = motion.stage * pin.time - pin.position
    return motion.spring * stretch + motion.damping * (motion.stage - pin.velocity)


@compiled(error_model="numpy")
def acceleration_rounding(motion: Motion, pin: Pin, slope: float) -> float:
    """What rounding may make of an acceleration of 0: it is a small difference of large forces and positions.

    slope: of the friction force, which is read off the position.
    """
    far = motion.spring * (motion.stage * pin.time + abs(pin.position)) + abs(slope * pin.position)
    return 4.4e-16 * (far + motion.damping * (motion.stage + abs(pin.velocity)) + abs(pin.friction_force))


@compiled(allocates=True, error_model="numpy")
def no_slips() -> list[SlipRow]:
    """An empty table of slips."""
    finished = [(0.0, 0.0, 0.0, 0.0, 0.0)]  # tells the compiler the type
    finished.clear()
    return finished


@compiled(error_model="numpy")
def _macroscopic(motion: Motion, begin: float, end: float) -> bool:
    """Whether a slip is longer than the presliding length, without what of it stretches the contact for the first time.

    A pin that a damper sets in motion at once swings on its contact, up to twice as far as a slow pull would stretch it.
    """
    return end - max(begin, motion.presliding) > motion.presliding


@compiled(allocates=True, error_model="numpy")
def follow_slip(slip: Slip, finished: list[SlipRow], motion: Motion, old: Pin, new: Pin, peak: float) -> Slip:
    """Follow the pin from one instant to the next, from slip to stick and back; macroscopic slips that end are added
    to `finished`.

    Between the two the velocity passes the stick velocity at most once. peak: the largest driving force between them.
    """
    sliding, climbing, time, position, highest, micro_slips, micro_travel = slip
    change = new.velocity - old.velocity
    share = (motion.stick_velocity - old.velocity) / change if change != 0.0 else 1.0
    passing_time = old.time + share * (new.time - old.time)
    passing_position = old.position + share * (new.position - old.position)
    if not sliding and new.velocity > motion.stick_velocity:
        sliding = climbing = True
        time, position, highest = passing_time, passing_position, peak
    if climbing:
        highest = max(highest, peak)
        climbing = new.velocity < motion.stage
    if sliding and new.velocity <= motion.stick_velocity:
        if _macroscopic(motion, position, passing_position):
            finished.append((time, position, highest, passing_time, passing_position))
        else:
            micro_slips += 1
            micro_travel += passing_position - position
        sliding = climbing = False
    return Slip(sliding, climbing, time, position, highest, micro_slips, micro_travel)


@compiled(allocates=True, error_model="numpy")
def slip_table(slip: Slip, rows: list[SlipRow], motion: Motion, pin: Pin) -> Floats:
    """Slips as rows of an array; one that still lasts has no re-stick."""
    if slip.sliding and _macroscopic(motion, slip.position, pin.position):
        rows.append((slip.time, slip.position, slip.peak, math.nan, math.nan))
    table = np.empty((len(rows), 5))
    for row in range(len(rows)):
        table[row, 0], table[row, 1], table[row, 2], table[row, 3], table[row, 4] = rows[row]
    return table
