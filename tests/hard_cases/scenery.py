"""Ways to draw a manifest at random: with every key and now and then nonsense, always with a drive, with axes."""

import json
import math
from typing import Any

from hypothesis import strategies as st

from nanoslip.solver.contact.closed_forms import hertz_half_width, hertz_radius
from nanoslip.solver.slab import SCHEMES

Sections = dict[str, dict[str, Any]]


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers from 10^low to 10^high, every order of magnitude as likely."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


def tables(entries: dict[str, st.SearchStrategy[Any]]) -> st.SearchStrategy[dict[str, Any]]:
    """A table of a manifest with any subset of these keys."""
    return st.fixed_dictionaries({}, optional=entries)


def or_nonsense(sensible: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Mostly a sensible value, now and then what no key takes."""
    nonsense = st.sampled_from([0, -1, -0.0, math.nan, math.inf, 1e308, 1e-308, "", "none", True, [], 2**70])
    return st.integers(0, 199).flatmap(lambda dice: nonsense if dice == 0 else sensible)


FRICTION = st.one_of(powers(-8, 1), st.sampled_from([0.0, math.inf, 0.5]))
CONSTANTS = {
    "intrinsic_friction": or_nonsense(FRICTION),
    "radius": or_nonsense(powers(-1, 6)),
    "normal_load": or_nonsense(powers(-12, -1)),
    "poisson": or_nonsense(st.one_of(st.floats(-0.9, 0.4999), st.sampled_from([0.0, 0.49, 1 / 3]))),
    "aspect_ratio": or_nonsense(powers(-2, 2)),
    "pin": st.sampled_from(["parabola", "parabola", "flat_punch"]),
    "half_width": or_nonsense(st.floats(0.01, 0.5)),
}
NUMERICS = {
    "scheme": st.sampled_from(tuple(SCHEMES)),
    "support": st.sampled_from(["bonded", "frictionless", "right_side"]),
    "initial_contact": st.sampled_from(["stick", "frictionless", "gradual"]),
}
SLIP = {
    "slip_order": st.sampled_from(["worst_first", "simultaneous"]),
    "limited_shear": st.sampled_from(["both_ways", "both_ways", "forward"]),
    "residual_shear": or_nonsense(st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 0.5, 0.999, 1.0]))),
    "event_floor": or_nonsense(powers(-12, 0)),
    "strength": or_nonsense(st.one_of(st.just(0.0), powers(-15, 0))),
}
EFFECTS = {name: st.sampled_from([True, True, False]) for name in ("friction", "coupling", "pin_translation")}
HETEROGENEITY = {
    "distribution": st.sampled_from(["lognormal", "uniform", "normal"]),
    "spread": or_nonsense(st.one_of(st.just(0.0), st.floats(0.0, 0.6))),
    "seed": or_nonsense(st.integers(0, 2**63)),
}
SCALES = {name: or_nonsense(powers(-9, 12)) for name in ("slab_width", "slab_depth", "shear_modulus")}
DRIVE = {
    "pin_mass": or_nonsense(powers(-12, 3)),
    "spring_stiffness": or_nonsense(powers(0, 12)),
    "damping_ratio": or_nonsense(st.one_of(powers(-3, 1), st.just(0.0))),
    "stage_velocity": or_nonsense(st.one_of(powers(-9, 1), st.just(0.0))),
    "duration": or_nonsense(powers(-9, 1)),
    "integrator": st.sampled_from(["exact", "exact", "rk4"]),
    "profile": st.sampled_from(["sawtooth", "coarse", "linear", "mean"]),
    "time_step": powers(-9, 0),
}
START = st.one_of(st.floats(0.0, 1.0), st.sampled_from([0.0, 0.5, 1.0, 0.25]))
SPACINGS = st.one_of(powers(-3, 0.5), st.sampled_from([1.0, 2.0]))
SENSIBLE_CONSTANTS = {
    "intrinsic_friction": powers(-3, 0.2),
    "radius": powers(0.5, 4),
    "normal_load": powers(-9, -2.5),
    "poisson": st.one_of(st.floats(-0.5, 0.49), st.sampled_from([0.0, 1 / 3])),
    "aspect_ratio": st.one_of(powers(-0.7, 1), st.just(1.0)),
}
SENSIBLE_DRIVE = {
    "pin_mass": powers(-6, 2),
    "spring_stiffness": powers(3, 10),
    "damping_ratio": st.one_of(powers(-3, 0.5), st.just(0.0)),
    "stage_velocity": powers(-5, 0),
    "duration": powers(-4, 0),
    "surface_compliance": st.booleans(),
    "reverse_motion": st.booleans(),
    "profile": st.sampled_from(["sawtooth", "coarse", "linear", "mean"]),
}


@st.composite
def driven_scenes(draw: st.DrawFn) -> str:
    """A record long enough for a plateau as a rule, and one or two drives over it."""
    sections: Sections = {
        "constants": draw(tables(SENSIBLE_CONSTANTS)),
        "numerics": {**draw(tables({**NUMERICS, "start": START})), "n_x": draw(st.sampled_from([9, 17, 17, 33]))},
        "slip": {
            **draw(tables({"residual_shear": st.floats(0.0, 0.99), "slip_order": SLIP["slip_order"]})),
            "cascade_limit": 20_000,
        },
        "limits": {"events": draw(st.integers(100, 800)), "spacings": draw(st.sampled_from([0.5, 1.0, 2.0, 3.0]))},
        "scales": draw(tables({name: powers(-3, 3) for name in SCALES})),
        "ensemble": {"members": 1},
    }
    sections["scales"]["shear_modulus"] = draw(powers(8, 11))
    if draw(st.integers(0, 4)) == 0:
        sections["heterogeneity"] = {"spread": draw(st.floats(0.0, 0.25)), "seed": draw(st.integers(0, 2**40))}
    return text_of(["contact", "slip", "dynamics"], sections, _drives(draw, SENSIBLE_DRIVE))


@st.composite
def scenes(draw: st.DrawFn, grids: tuple[int, ...] = (5, 9, 17, 33), events: int = 60) -> str:
    """With every key, far beyond what is sensible."""
    stages = ["contact", "slip", "dynamics"][: draw(st.sampled_from([1, 2, 2, 3, 3]))]
    limits = {"spacings": or_nonsense(SPACINGS), "displacement": or_nonsense(powers(-9, 0))}
    sections: Sections = {
        "constants": draw(tables(CONSTANTS)),
        "numerics": {**draw(tables({**NUMERICS, "start": or_nonsense(START)})), "n_x": draw(st.sampled_from(grids))},
        "slip": {**draw(tables(SLIP)), "cascade_limit": draw(st.sampled_from([1, 100, 20_000]))},
        "limits": {"events": draw(st.integers(1, events)), **draw(tables(limits))},
        "ensemble": {"members": 1},
    }
    if draw(st.booleans()):
        sections |= {"effects": draw(tables(EFFECTS)), "heterogeneity": draw(tables(HETEROGENEITY))}
    if draw(st.integers(0, 3)) == 0:
        sections["ensemble"] = {"members": draw(st.integers(1, 4))}
    if len(stages) < 3:
        return text_of(stages, sections, [])
    sections["scales"] = draw(tables(SCALES))
    return text_of(stages, sections, _drives(draw, DRIVE))


@st.composite
def strong_scenes(draw: st.DrawFn) -> str:
    """Scenes with a strength from 1e-12 to 1e3 of the mean limit by pressure, or alone, of all kinds of sliding."""
    constants = draw(st.fixed_dictionaries(SENSIBLE_CONSTANTS))
    numerics = {**draw(tables(NUMERICS)), "n_x": draw(st.sampled_from([9, 17, 33]))}
    planar = numerics.get("scheme") in ("half_space", "layer")
    sizes = constants["normal_load"], constants["radius"], constants["poisson"]
    pressure = sizes[0] / (math.pi * hertz_radius(*sizes) ** 2 if planar else 2.0 * hertz_half_width(*sizes))
    strength = min(draw(powers(-12, 3)) * constants["intrinsic_friction"] * pressure, 1.0)
    if draw(st.integers(0, 3)) == 0:
        constants["intrinsic_friction"] = 0.0
    sections: Sections = {
        "constants": constants,
        "numerics": numerics,
        "slip": {**draw(tables(SLIP)), "strength": strength, "cascade_limit": 20_000},
        "limits": {"events": draw(st.integers(20, 200))},
        "effects": draw(tables(EFFECTS)),
        "ensemble": {"members": 1},
    }
    if draw(st.integers(0, 3)) == 0:
        sections["heterogeneity"] = draw(tables(HETEROGENEITY))
    if draw(st.integers(0, 5)) == 0:
        sections["path"] = {"amplitude": draw(st.floats(0.1, 2.0)), "cycles": 2}
    return text_of(["contact", "slip"], sections, [])


@st.composite
def campaigns(draw: st.DrawFn) -> str:
    """Scenes along one or two axes, as a product, some with members: 4 to some 30 cases that mostly make sense."""
    axes = {"intrinsic_friction": draw(st.lists(FRICTION, min_size=2, max_size=4, unique=True))}
    name = draw(st.sampled_from(["normal_load", "radius", "poisson", "start"]))
    values = {**SENSIBLE_CONSTANTS, "start": START}[name]
    axes[name] = draw(st.lists(values, min_size=2, max_size=3, unique=True))
    rest = {key: value for key, value in SENSIBLE_CONSTANTS.items() if key not in axes}
    numerics = {**draw(tables(NUMERICS)), "n_x": draw(st.sampled_from([9, 17, 33]))}
    sections: Sections = {
        "axes": axes,
        "constants": draw(tables(rest)),
        "numerics": numerics,
        "slip": {**draw(tables(SLIP)), "cascade_limit": 20_000},
        "limits": {"events": draw(st.integers(20, 300))},
        "ensemble": {"members": draw(st.sampled_from([1, 1, 2]))},
    }
    drives = _drives(draw, SENSIBLE_DRIVE) if draw(st.booleans()) else []
    return text_of(["contact", "slip", "dynamics"][: 3 if drives else 2], sections, drives)


def _drives(draw: st.DrawFn, keys: dict[str, st.SearchStrategy[Any]]) -> list[dict[str, Any]]:
    return [_drive(draw, keys) for _ in range(draw(st.integers(1, 2)))]


def _drive(draw: st.DrawFn, keys: dict[str, st.SearchStrategy[Any]]) -> dict[str, Any]:
    drive = {**draw(tables(keys)), "samples": 20, "step_limit": 100_000}
    if drive.get("surface_compliance", True) and draw(st.integers(0, 3)) == 0:
        drive |= {"integrator": "rk4", "duration": 1e-2, "time_step": draw(powers(-7, -3))}
    return drive


def text_of(stages: list[str], sections: Sections, drives: list[dict[str, Any]]) -> str:
    """The manifest: a title, tables, drives."""
    parts = [f"title = 'a scene'\nstages = {written(stages)}"]
    parts += [f"[{name}]\n{lines(entries)}" for name, entries in sections.items()]
    parts += [f"[[drives]]\nname = 'drive {number}'\n{lines(entries)}" for number, entries in enumerate(drives)]
    return "\n".join(parts)


def lines(entries: dict[str, Any]) -> str:
    return "\n".join(f"{key} = {written(value)}" for key, value in entries.items())


def written(value: Any) -> str:
    """A value in TOML."""
    if isinstance(value, list):
        return f"[{', '.join(map(written, value))}]"
    return repr(value) if isinstance(value, float) else json.dumps(value)
