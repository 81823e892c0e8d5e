"""More ways to draw a manifest at random: always with a drive, with every key, on large grids, with axes.

Apart from `scenes` of test_scenes, whose committed stream must not move when a key is added.
"""

from typing import Any

from hypothesis import strategies as st

from tests.hard_cases.test_scenes import (
    CONSTANTS,
    DRIVE,
    EFFECTS,
    FRICTION,
    HETEROGENEITY,
    NUMERICS,
    SCALES,
    SLIP,
    lines,
    or_nonsense,
    powers,
    tables,
    written,
)

Sections = dict[str, dict[str, Any]]

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
def scenes_with_every_key(draw: st.DrawFn, grids: tuple[int, ...] = (5, 9, 17, 33), events: int = 60) -> str:
    """As wild as those of the committed stream, with the keys that came after it."""
    stages = ["contact", "slip", "dynamics"][: draw(st.sampled_from([1, 2, 2, 3, 3]))]
    sections: Sections = {
        "constants": draw(tables(CONSTANTS)),
        "numerics": {**draw(tables({**NUMERICS, "start": or_nonsense(START)})), "n_x": draw(st.sampled_from(grids))},
        "slip": {**draw(tables(SLIP)), "cascade_limit": draw(st.sampled_from([1, 100, 20_000]))},
        "limits": {"events": draw(st.integers(1, events)), **draw(tables({"spacings": or_nonsense(SPACINGS)}))},
        "ensemble": {"members": 1},
    }
    if draw(st.booleans()):
        sections |= {"effects": draw(tables(EFFECTS)), "heterogeneity": draw(tables(HETEROGENEITY))}
    if draw(st.integers(0, 3)) == 0:
        sections["ensemble"] = {"members": draw(or_nonsense(st.integers(1, 4)))}
    return text_of(stages, sections, _drives(draw, DRIVE) if len(stages) == 3 else [])


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
