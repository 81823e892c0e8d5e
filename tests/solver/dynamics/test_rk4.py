"""Runge-Kutta steps converge as they should, to the exact motion, and refuse to blow up."""

import math

import numpy as np
import pytest

from nanoslip.solver.dynamics import integrators as rk4
from nanoslip.solver.dynamics.integrators import RK4, integrate
from nanoslip.solver.dynamics.kernels.motion import Teeth, tooth_at, tooth_holding
from nanoslip.solver.outcome import Ending
from tests.solver.dynamics.drives import PROBLEMS, K, Problem
from tests.synthetic import profile_through


def errors(problem, steps):
    """Largest error of the velocity over 100 samples, for each time step."""
    exact = integrate(problem.profile, problem.drive(), K)
    stepped = [integrate(problem.profile, problem.drive(integrator=RK4(step)), K) for step in steps]
    return np.array([np.abs(result.velocity - exact.velocity).max() for result in stepped])


def test_order_four_where_the_force_is_smooth():
    """One endless rising tooth, steeper than the contact: F = K x throughout."""
    smooth = Problem(profile_through([0.0, 100.0], [0.1], [600.0]), 0.1, 0.3, 10.0)
    steps = np.array([0.1, 0.05, 0.025])
    order = np.diff(np.log(errors(smooth, steps))) / np.diff(np.log(steps))
    assert np.all(order > 3.8), f"orders {order}"  # 4 in the limit
    assert np.all(order < 4.3), f"orders {order}"


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS.keys())
def test_order_one_over_teeth(problem):
    """Every jump, of at most 2.5, is met up to a step late, and there are fewer than 50: error < 125 steps."""
    steps = np.array([2e-3, 2e-4, 2e-5])
    found = errors(problem, steps)
    assert np.all(found < 125.0 * steps), f"errors {found}"
    assert found[2] < found[0] / 5.0, f"errors {found}"  # erratic, as where a step falls is chance; 100 on average


def test_phases_and_mean_forces_converge_too():
    problem = PROBLEMS["stick-slip with reversal onto the negative branch"]
    exact = integrate(problem.profile, problem.drive(), K)
    stepped = integrate(problem.profile, problem.drive(integrator=RK4(1e-5)), K)
    for name in ("slip_time", "slip_position", "slip_force", "restick_time", "restick_position", "binned_force"):
        assert np.abs(getattr(stepped, name) - getattr(exact, name)).max() < 1e-3, name  # first order: 100 steps
    assert stepped.friction_work == pytest.approx(exact.friction_work, rel=1e-4)
    assert stepped.steps == 2_500_000


@pytest.mark.parametrize(("damping_ratio", "bound"), [(0.0, 2.0 * math.sqrt(2.0)), (1.0, None), (20.0, None)])
def test_a_step_beyond_stability_is_refused_and_one_below_is_not(damping_ratio, bound):
    """Without damping the limit is √8/ω with ω² = k + K, the classical one; with strong damping 2.785/fastest rate."""
    if bound is None:
        rates = np.roots([1.0, 2.0 * damping_ratio, 1.0 + K])
        bound = 0.99 * 2.785 / np.abs(rates.real).max() * math.sqrt(1.0 + K) if damping_ratio > 5.0 else 2.0
    edge = bound / math.sqrt(1.0 + K)
    problem = Problem(profile_through([0.0, 100.0], [0.1], [600.0]), damping_ratio, 0.3, 50.0)
    good = integrate(problem.profile, problem.drive(integrator=RK4(0.99 * edge)), K)
    bad = integrate(problem.profile, problem.drive(integrator=RK4(2.0 * edge)), K)
    assert good.outcome.ok
    assert np.abs(good.position).max() < 2.0 * 0.3 * 50.0
    assert bad.outcome.ending is Ending.UNSTABLE_STEP
    needed = float(bad.outcome.message.partition("by a factor of ")[2].split()[0])
    again = problem.drive(integrator=RK4(2.0 * edge / needed * (1.0 - 1e-3)))  # the factor is told to four digits
    assert integrate(problem.profile, again, K).outcome.ok
    assert np.isnan(bad.position).all()
    assert len(bad.slip_time) == 0


def test_samples_between_steps_are_interpolated_to_the_methods_order():
    """Decimation of a smooth motion: samples off the steps are as good as those on them."""
    smooth = Problem(profile_through([0.0, 100.0], [0.1], [600.0]), 0.1, 0.3, 10.0)
    exact = integrate(smooth.profile, smooth.drive(samples=997), K)
    stepped = integrate(smooth.profile, smooth.drive(samples=997, integrator=RK4(0.01)), K)
    assert np.abs(stepped.position - exact.position).max() < 1e-8  # h⁴/384 of the fourth derivative, ω⁴·0.1 or so
    assert np.abs(stepped.velocity - exact.velocity).max() < 1e-7


def walked(teeth: Teeth, x: float) -> int:
    """The tooth that holds x, one by one from the first."""
    index = 0
    while not tooth_at(teeth, index)[0] <= x < tooth_at(teeth, index)[1]:
        index += 1 if x >= tooth_at(teeth, index)[1] else -1
    return index


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS.keys())
def test_a_tooth_far_away_is_the_one_that_a_walk_from_tooth_to_tooth_finds(problem):
    """Both ways from the start, over laps, from any tooth on; edges themselves belong to the tooth on their right."""
    profile = problem.profile
    teeth = Teeth(profile.edges, profile.force, profile.slope, profile.periodic_from)
    rng = np.random.default_rng(3)
    edges = [tooth_at(teeth, index)[0] for index in (-70, -3, 0, 1, 40, 333)]
    for x in (*rng.uniform(-60.0, 60.0, 100), *edges):
        there = walked(teeth, x)
        for start in (there - 5000, there - 9, there + 1, there + 777):
            assert tooth_holding(teeth, start, x) == (there, *tooth_at(teeth, there))


def test_a_tooth_beyond_a_billion_laps_is_found_at_once():
    profile = PROBLEMS["falling teeth"].profile
    teeth = Teeth(profile.edges, profile.force, profile.slope, profile.periodic_from)
    for x in (3.3e9, -3.3e9):
        _, left, right, _, _ = tooth_holding(teeth, 0, x)
        assert left <= x < right
    for x in (1e300, -math.inf, math.nan):
        assert math.isnan(tooth_holding(teeth, 0, x)[1])


def test_a_motion_that_runs_away_ends_by_name(monkeypatch):
    """Were an unstable step ever let through: the position grows by orders of magnitude each step, to infinity."""
    monkeypatch.setattr(rk4, "is_stable", lambda time_step, motion: True)
    problem = PROBLEMS["falling teeth"]
    result = integrate(problem.profile, problem.drive(integrator=RK4(20.0), duration=20000.0), K)
    assert result.outcome.ending is Ending.UNSTABLE_STEP
    assert "ran away after " in result.outcome.message
    assert 0 < result.steps < 1000
    assert np.isnan(result.position[-1])


@pytest.mark.parametrize("step", [1e-300, 5e-324])
def test_a_step_of_which_no_drive_has_room_is_refused_in_few_words(step):
    problem = Problem(profile_through([0.0, 100.0], [0.1], [600.0]), 0.1, 0.3, 50.0)
    found = integrate(problem.profile, problem.drive(integrator=RK4(step)), K)
    assert found.outcome.ending is Ending.STEP_LIMIT
    assert len(found.outcome.message) < 80
