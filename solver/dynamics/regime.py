"""Regime of a driven pin (stick, sliding or stick-slip), from the macroscopic slips of its drive.

The final motion counts: many drives re-stick once or twice while the first slip decays, then slide (§3.3). An unfinished slip is
sliding if it has lasted longer than every cycle before it. With a stiff spring the pin may follow in micro slips: then the spring
force rises, in the second half of the time, by less than half of the rise with a stuck pin.

Amplitude and period refer to that half. They are omitted if it has no whole cycle, or holds the loading ramp, the first slip or
the ringing of the start: a pin that slides oscillates from its last slip on, and the damper alone ends that.

Near the border of stick-slip the start decides for long: slips vary from place to place, and a slip that does not end
is the last. A drive without a given duration states a regime that later slips will not change.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.drive import Drive, lag_time
from nanoslip.solver.dynamics.result import BINS, DynamicsResult, ending_parameter, raising
from nanoslip.solver.parameter import quantity

Regime = Literal["sticks", "stick_slip", "slides", "micro_slip"]
REGIMES: Final[Mapping[str, str]] = {
    "sticks": "no macroscopic slip",
    "stick_slip": "macroscopic slips that end in stick, or any other motion",
    "slides": "the last slip never ended and outlasted every earlier cycle, from the start of one slip to that of the next",
    "micro_slip": "no macroscopic slip, but in the second half of the time the pin keeps up with more than half the stage's "
    "velocity, in slips shorter than presliding_length",
}
"""Regime -> its meaning."""
Search = Literal["found", "always_sticks", "never_sticks", "unknown"]
SEARCHES: Final[Mapping[str, str]] = {
    "found": "the pin sticks below a velocity, and not above it",
    "always_sticks": "the pin sticks at all velocities",
    "never_sticks": "the pin sticks at no velocity",
    "unknown": "a drive fails, or no damper bounds the velocities",
}
"""Result of a search for a critical velocity -> its meaning."""
RISING: Final = 0.1
"""Largest rise left by the loading ramp, as a share of the spring force's range in the second half, with a valid amplitude;
largest velocity of the start's ringing, over the stage's, that does not decide the regime."""
RINGING: Final = 0.02
"""Largest range of the start's ringing, likewise, as a damper alone leaves it: teeth were seen to make it 3.6 times as wide."""


@dataclass(frozen=True, slots=True)
class StickSlipCount:
    """Number and duration of the sticks of a drive's pin. If the run ended early, all but the counts are None or NaN.

    spring_force_amplitude: in G·L_x·L_y. stick_slip_period: mean time between starts of slips in the second half of the time;
        NaN for a pin that slides or sticks. unsettled: why both are missing although slips repeat, with advice; else
        empty.
    """

    macroscopic_slips: int = quantity(
        "slips longer than the presliding length",
        comment="motion within that length of the start does not count: the contact stretches there for the first time",
    )
    resticks: int = quantity("macroscopic slips that ended", comment="the pin came down to stick_velocity")
    time_stuck: float = quantity("share of time without macroscopic slip", ensemble=True, shared="repetition")
    regime: Regime | None = quantity(
        "regime of the pin",
        comment=f"{'; '.join(f'{name}: {meaning}' for name, meaning in REGIMES.items())}; empty where the drive ended early, "
        "and without a given duration where a longer drive may have another regime",
        words=tuple(REGIMES),
    )
    spring_force_amplitude: float = quantity(
        "peak-to-peak spring force over load",
        ensemble=True,
        shared="repetition",
        comment="in the second half of the drive's time. It needs two macroscopic slips that begin there, or one that lasts all "
        "through it, or the regime micro_slip. NaN if the first slip, the end of the loading ramp or the ringing of the start is "
        "in that half. A mean needs a value of every start, all in one regime",
        per="normal_load",
        alike="regime",
    )
    stick_slip_period: float = quantity(
        "period of stick-slip",
        "",
        "s",
        per="time",
        ensemble=True,
        shared="repetition",
        comment="mean time from the start of one macroscopic slip to the next, in the second half of the time; NaN unless the "
        "regime is stick_slip and at least two slips begin in that half, the first slip of the drive not among them; a mean "
        "needs a value from every start",
        alike="regime",
    )
    unsettled: str = ""
    ringing: float = 0.0
    """Time at which an amplitude and a period may begin to be measured, as far as the ringing of the start is concerned."""


@dataclass(frozen=True, slots=True)
class CriticalVelocity:
    """Velocity of the stage above which a pin does not stick any more; NaN if unknown."""

    critical_velocity: float = quantity(
        "critical velocity of the stage",
        "",
        "m s-1",
        per="velocity",
        ensemble=True,
        shared="length",
        symbol="V_c",
        comment="above it the pin no longer sticks. It belongs to the drive's spring, mass and damping ratio, pulled from rest "
        "over the same record, without `memory`. A longer record has higher peaks, and a higher V_c: ± contains what its later "
        "half adds. It is found by bisection to 2 %, from the velocity at which Eq. 17 ends no slip down to a 16,000th of it. "
        "Below it there may be windows without sticking. NaN unless critical_velocity_search is found",
    )
    critical_velocity_search: Search = quantity(
        "result of the search for V_c",
        comment="; ".join(f"{word}: {meaning}" for word, meaning in SEARCHES.items()),
        words=tuple(SEARCHES),
    )


def count_sticks(result: DynamicsResult, drive: Drive) -> StickSlipCount:
    """Re-sticks of a drive, time stuck, regime, and amplitude and period of repeated slips."""
    slips, resticks = len(result.slip_time), int(np.count_nonzero(~np.isnan(result.restick_time)))
    if not result.outcome.ok:
        return StickSlipCount(slips, resticks, math.nan, None, math.nan, math.nan)
    duration = float(result.time[-1])
    ends = np.where(np.isnan(result.restick_time), duration, result.restick_time)
    stuck = 1.0 - float(np.sum(ends - result.slip_time)) / duration
    # By which the spring force of a stuck pin rises in the second half of the time.
    rise = drive.spring_stiffness * (drive.stage_velocity - result.stick_velocity) * 0.5 * result.end_time
    follows = result.spring_force_range < 0.5 * rise
    if result.forgotten_from > result.end_time:
        missing = "a longer drive may have another regime: spring_force_amplitude and stick_slip_period are not known"
        why = f"{missing}{raising(ending_parameter(result, drive))}"
        return StickSlipCount(slips, resticks, stuck, None, math.nan, math.nan, why)
    regime = _regime(result) if slips else "micro_slip" if follows else "sticks"
    late = result.slip_time >= 0.5 * duration
    late_slips = int(np.count_nonzero(late))
    lasts_all_through = 0 < slips != resticks and not late_slips
    repeats = regime in ("micro_slip", "slides") or late_slips > 1 or lasts_all_through
    rings = regime == "slides" and result.settling_time >= lag_time(drive)
    ringing = _ringing_ends(result, drive, RINGING * result.spring_force_range) if rings else 0.0
    unsettled = _explain_no_period(result, drive, late, ringing) if repeats else ""
    if unsettled or not repeats:
        return StickSlipCount(slips, resticks, stuck, regime, math.nan, math.nan, unsettled, ringing)
    period = math.nan
    if regime == "stick_slip" and late_slips > 1:
        period = float(np.diff(result.slip_time[late]).mean())
    return StickSlipCount(slips, resticks, stuck, regime, result.spring_force_range, period)


def start_forgotten_from(result: DynamicsResult, drive: Drive, pattern: float, slips_end: Callable[[], bool]) -> float:
    """Earliest time from which on a longer drive has the same regime, judged by slips and record; inf without a damper.

    By then a pin that slides has met the whole repeated record with less ringing than would stop it, in the second half of the
    time. pattern: length of the repeated record, in L_x. slips_end: whether slips that have all ended go on to do so.
    """
    if not result.outcome.ok or not len(result.slip_time) or result.settling_time < lag_time(drive):
        return 0.0  # without slips, or dragged by its damper, a pin has one regime
    one_pass = pattern / drive.stage_velocity
    if _regime(result) == "slides":
        # A velocity v of a free oscillation swings the spring force by √k v to both sides (the mass is 1).
        stopping = 2.0 * RISING * math.sqrt(drive.spring_stiffness) * drive.stage_velocity
        return one_pass + max(_ringing_ends(result, drive, stopping), one_pass)
    if slips_end():
        return 0.0
    # It may slide yet: after its last slip, whose ringing decays first.
    return result.end_time + ringing_time(drive) + one_pass


def decay_rate(drive: Drive) -> float:
    """Rate ζω at which a free oscillation decays; the slower of both rates of an overdamped pin."""
    # Above ζ = 1 the rates are ω (ζ ± √(ζ² - 1)), with the product ω²: so the slower one is no small
    # difference.
    natural, ratio = math.sqrt(drive.spring_stiffness), drive.damping_ratio
    return natural / (ratio + math.sqrt(ratio**2 - 1.0)) if ratio > 1.0 else natural * ratio


def ringing_time(drive: Drive) -> float:
    """Time in which a free oscillation decays to RISING of itself; inf without a damper."""
    decay = decay_rate(drive)
    return -math.log(RISING) / decay if decay else math.inf


def _ringing_ends(result: DynamicsResult, drive: Drive, force: float) -> float:
    """Time from which on the range of the spring force by the last slip's ringing is `force` or less; inf without a damper.

    From rest at the force of the last slip a pin oscillates about the mean friction force.
    """
    natural, decay = math.sqrt(drive.spring_stiffness), decay_rate(drive)
    damper = 2.0 * drive.damping_ratio * natural * drive.stage_velocity
    mean_friction = float(result.binned_force[BINS // 2 :].mean())
    away = float(result.slip_force[-1]) - damper - mean_friction
    # Peak to peak, from a pin at rest: its force is `away` from the mean, its velocity V from the stage's.
    ringing = 2.0 * math.hypot(away, natural * drive.stage_velocity)
    if decay == 0.0 or force == 0.0:
        return math.inf
    lifetimes = max(math.log(ringing / force), 0.0)
    return float(result.slip_time[-1]) + lifetimes / decay


def _explain_no_period(result: DynamicsResult, drive: Drive, late: NDArray[np.bool_], ringing: float) -> str:
    """Reason why the second half of the time shows no period, with advice; empty if it does. late: (s,) slips in it."""
    if late[:1].any():
        what = "the first slip"
    elif _ramp_left(result, drive, slips=len(late)) > RISING * result.spring_force_range:
        what = "the end of the loading ramp"
    elif ringing > 0.5 * result.end_time:
        what = "the ringing of the start"
    else:
        return ""
    missing = "spring_force_amplitude and stick_slip_period are not known"
    return f"{what} is in the second half of the time, so {missing}{raising(ending_parameter(result, drive))}"


def _ramp_left(result: DynamicsResult, drive: Drive, slips: int) -> float:
    """Rise of the spring force that remains in the second half: zero once the ramp is over.

    Before any slip the friction force shows it. A pin that its damper drags stretches the spring within c/k.
    """
    before, after = np.split(result.binned_force, [BINS // 2])
    lag, end = lag_time(drive), result.end_time
    if result.settling_time < lag:
        # The spring stretches as 1 - exp(-t/lag): what it gains from the middle to the end.
        gain = math.exp(-0.5 * end / lag) - math.exp(-end / lag)
        return float(after.mean()) * gain
    return 0.0 if slips else float(after.mean() - before.max())


def _regime(result: DynamicsResult) -> Regime:
    """Regime of a pin that has slipped."""
    starts = result.slip_time
    if not np.isnan(result.restick_time[-1]):
        return "stick_slip"
    longest_cycle = float(np.diff(starts).max(initial=0.0))
    return "slides" if result.end_time - float(starts[-1]) > longest_cycle else "stick_slip"
