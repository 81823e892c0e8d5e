"""Results of testing a tolerance, as Markdown: how often it was kept, the time saved, and the worst scenes with reasons."""

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study.accuracy.influence.judgement import EVERYTHING, NOTHING, PROMISED, THUMB, TOLERANCES, Trial, asked_for, named
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import LATERAL, NODES, POISSON, WIDTH

WORST: Final = 10
_HEAD: Final = (
    "# What is left out, and what that changes",
    "",
    "Written by `nanoslip effects --judge`; what is promised, and to whom, is in study/accuracy/README.md.",
)
_GROUPS: Final = (NODES, LATERAL, WIDTH, POISSON)
Vector = NDArray[np.float64]


def ways() -> tuple[str, ...]:
    """The ways to choose, in the order of the table."""
    return (EVERYTHING, *(named(within) for within in TOLERANCES), THUMB, NOTHING)


def change(trial: Trial, way: str) -> float:
    """The largest change of what is asked for; NaN where even the whole scene does not yield it."""
    return float(np.fmax.reduce(trial.tried[way].actual))


def as_markdown(trials: Sequence[Trial]) -> str:
    """The whole judgement."""
    lines = [
        *_HEAD,
        "",
        "| way to choose | scenes with less | changed by more than promised | 50 % | 95 % of the changes | time | |",
    ]
    lines += ["|---|---|---|---|---|---|---|"]
    lines += [_row(trials, way) for way in ways()]
    lines += ["", f"Left out within {PROMISED:g}, by effect:", "", "| effect | left out | of |", "|---|---|---|"]
    lines += _by_effect(trials)
    lines += ["", f"The worst {WORST} scenes within {PROMISED:g}:", ""]
    lines += ["| seed | " + " | ".join(asked_for()) + " | expected | left out | m | K/(G·L_y) | a/L_x | ν | |"]
    lines += ["|---" * (8 + len(asked_for())) + "|", *_worst(trials)]
    return "\n".join(lines) + "\n"


def kept(trials: Sequence[Trial], way: str, within: float) -> tuple[int, int]:
    """Scenes whose changes stay within a tolerance, and scenes in which something is left out at all."""
    less = [trial for trial in trials if trial.tried[way].left_out and not np.isnan(change(trial, way))]
    return sum(change(trial, way) <= within for trial in less), len(less)


def seconds_of(trials: Sequence[Trial], way: str) -> float:
    """Processor time of all scenes, chosen in this way."""
    return sum(trial.tried[way].seconds for trial in trials)


def _row(trials: Sequence[Trial], way: str) -> str:
    changes = np.array([change(trial, way) for trial in trials])
    known = changes[~np.isnan(changes)]
    seconds, whole = (seconds_of(trials, each) for each in (way, EVERYTHING))
    broken = ""
    if way.startswith("within"):
        good, count = kept(trials, way, float(way.split()[1]))
        broken = f"{count - good} of {count} ({(count - good) / max(count, 1):.1%})"
    less = sum(bool(trial.tried[way].left_out) for trial in trials)
    middle, most = (f"{np.quantile(known, share):.2g}" if len(known) else "" for share in (0.5, 0.95))
    cheaper = f"{whole / seconds:.1f} × cheaper"
    return f"| {way} | {less} of {len(trials)} | {broken} | {middle} | {most} | {seconds:.0f} s | {cheaper} |"


def _by_effect(trials: Sequence[Trial]) -> Iterator[str]:
    for name, omission in OMISSIONS.items():
        having = [trial for trial in trials if omission.there(trial.scene)]
        out = sum(name in trial.tried[named(PROMISED)].left_out for trial in having)
        yield f"| {name} | {out} | {len(having)} |"


def _worst(trials: Sequence[Trial]) -> Iterator[str]:
    way = named(PROMISED)
    known = [trial for trial in trials if trial.tried[way].left_out and not np.isnan(change(trial, way))]
    for trial in sorted(known, key=lambda each: -change(each, way))[:WORST]:
        found = trial.tried[way]
        cells = [f"{each:.2g}" for each in found.actual]
        place = [f"{group.of(trial.scene):.2g}" for group in _GROUPS]
        left_out = ", ".join(name for name in OMISSIONS if name in found.left_out)
        expected = f"{np.fmax.reduce(found.expected):.2g}"
        yield f"| {' | '.join([str(trial.seed), *cells, expected, left_out, *place, _reason(trial)])} |"


def _reason(trial: Trial) -> str:
    """Why a scene is among the worst."""
    found = trial.tried[named(PROMISED)]
    worst = change(trial, named(PROMISED))
    if worst <= PROMISED:
        return "kept"
    scatter = float(np.nanmax(trial.scatter))
    if worst <= PROMISED + 2.0 * scatter:
        return f"within two standard errors ({scatter:.2g}) of the eight starts"
    return "not settled" if not np.isfinite(found.expected).all() else "rarer than one scene in twenty"
