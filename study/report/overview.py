"""The text of a page before its figures: outcomes of cases, accuracy, and units."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.ticker import EngFormatter

from study.dataset.collection.counted import without_numbers
from study.dataset.members import ends_of, members_of
from study.dataset.variables import DISCRETIZATION_ERROR, OUTCOMES
from study.figures.shared.closed_form import scales_of
from study.figures.sweep.label import label
from study.report.summary import counted_as

UNHURT: Final = ("completed",)
"""Endings that ask for nothing."""
UNCERTAIN: Final = ("plateau_mean", "static_friction", "kinetic_friction", "mean_step")
"""Variables whose uncertainties a page sums up."""
MOST_ADVICE: Final = 5
"""Different messages of one outcome that a page shows."""


@dataclass(frozen=True, slots=True)
class Advice:
    """A message, and how many more there are that differ from it in numbers alone."""

    text: str
    alike: int


@dataclass(frozen=True, slots=True)
class Ending:
    """Cases or drives that ended alike: their number, in words, and what their messages say."""

    words: str
    failed: bool
    """Whether something asks for a change."""
    advice: tuple[Advice, ...]
    more: int
    """Messages that are not shown."""


def endings(dataset: xr.Dataset) -> list[Ending]:
    """How cases, then drives ended: failures first, the most frequent first.

    What a drive inherits from its case is said once, of the case.
    """
    found: list[Ending] = []
    said: set[str] = set()
    for outcome, message in OUTCOMES.values():
        if outcome.name not in dataset:
            continue
        words, messages = (dataset[each.name].values.ravel().tolist() for each in (outcome, message))
        of_word = {word: [text for each, text in zip(words, messages, strict=True) if each == word] for word in words}
        for word, texts in sorted(of_word.items(), key=lambda item: -len(item[1])):
            if word:
                own = [text for text in texts if not any(known in text for known in said)]
                found.append(_ending(counted_as(dataset[outcome.name]), word, len(texts), own))
        said = {text for text in messages if text}
    return sorted(found, key=lambda ending: not ending.failed)


def _ending(what: str, word: str, count: int, messages: list[str]) -> Ending:
    kinds: dict[str, list[str]] = {}
    for text in filter(None, messages):
        kinds.setdefault(without_numbers(text), []).append(text)
    advice = [Advice(texts[0], len(texts) - 1) for texts in sorted(kinds.values(), key=len, reverse=True)]
    words = f"{count} {what}{'s' if count > 1 else ''}: {word.replace('_', ' ')}"
    return Ending(words, word not in UNHURT, tuple(advice[:MOST_ADVICE]), max(len(advice) - MOST_ADVICE, 0))


def regimes(dataset: xr.Dataset) -> str:
    """Number of drives in each regime; empty where all have the same regime."""
    if "regime" not in dataset:
        return ""
    counts = Counter(word for word in dataset["regime"].values.ravel().tolist() if word)
    if len(counts) < 2:
        return ""
    return ", ".join(f"{count} {word.replace('_', '-')}" for word, count in counts.most_common())


def accuracy(dataset: xr.Dataset) -> Iterator[str]:
    """What the slab's grid costs, and how uncertain the numbers are, a line each."""
    if DISCRETIZATION_ERROR.name in dataset:
        errors = dataset[DISCRETIZATION_ERROR.name].values.ravel()
        yield f"Grid (discretization_error of stiffness, approach, half-width, pressure): {_shares(errors, 'measured')}"
    for name in UNCERTAIN:
        uncertainty = f"{name}_uncertainty"
        if {name, uncertainty} <= set(dataset.data_vars) and np.isfinite(dataset[name].values).any():
            share = np.abs(dataset[uncertainty].values.ravel() / dataset[name].values.ravel())
            yield f"{_sentence(label(name))}: ± {_shares(share, 'known')[:-1]}{_of_mean(dataset, name)}."


def _of_mean(dataset: xr.Dataset, name: str) -> str:
    """Of how many members a number's means are, where they are of several."""
    counts = members_of(dataset, name)
    if counts is None or not bool((counts[0] > 1.0).any()):
        return ""
    having, used = (each.where(counts[0] > 0.0) for each in counts)
    of = "" if having.equals(used) else f" of {ends_of(used)}"
    return f", over {ends_of(having)}{of} members"


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:]


def _shares(values: Any, word: str) -> str:
    known = values[np.isfinite(values)]
    if not len(known):
        return f"not {word}."
    ends = " to ".join(dict.fromkeys(f"{100 * end:.2g} %" for end in (known.min(), known.max())))
    missing = len(values) - len(known)
    return f"{ends}{f'; not {word} of {missing} of {len(values)} cases' if missing else ''}."


def scales(dataset: xr.Dataset) -> Iterator[str]:
    """The scales of the dimensionless numbers, a line each; none where a dataset does not state them."""
    found = scales_of(dataset.attrs)
    if found is None:
        return
    width, depth, modulus = found.slab_width, found.slab_depth, found.shear_modulus
    yield f"Slab width L_x = {_si(width, 'm')}, depth L_y = {_si(depth, 'm')}, shear modulus G = {_si(modulus, 'Pa')}"
    for name, meaning, unit, scale in (
        ("normal_load", "normal load W", "N", found.force),
        ("radius", "radius R", "m", width),
        ("final_displacement", "pin displacement", "m", width),
        ("mean_step", "mean step per event", "m", width),
        ("surface_stiffness", "lateral stiffness K", "N/m", found.stiffness),
    ):
        idle = name == "radius" and np.all(dataset.get("pin", "") == "flat_punch")
        values = np.empty(0) if idle or name not in dataset.variables else dataset[name].values.ravel() * scale
        values = values[np.isfinite(values)]
        if len(values):
            low, high = _si(values.min(), unit), _si(values.max(), unit)
            yield f"{_sentence(meaning)}: {low if low == high else f'{low} to {high}'}"


def _si(value: float, unit: str) -> str:
    return str(EngFormatter(unit=unit)(float(f"{value:.3g}")))


def left_out(dataset: xr.Dataset) -> Iterator[str]:
    """Groups of runs and fits that the dataset does not have, a line each."""
    groups = {"record_id": "Friction records", "trajectory_id": "Motions of pins"}
    asked = {"record_id": "plateau_mean", "trajectory_id": "drive_outcome"}
    for name, words in groups.items():
        if asked[name] in dataset and name not in dataset:
            yield f"{words} are not kept ([outputs] of the campaign): there are no figures of single cases."
    if "record_id" in dataset and "slips_exponent" not in dataset:
        yield "Distributions of event sizes are not computed: [outputs] statistics of the campaign."
