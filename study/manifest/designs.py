"""Designs that fill ranges evenly: Sobol' sequences and Latin hypercubes. Values of all cases from the ranges of [axes]."""

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any, Final

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import BY_ROWS, Case
from nanoslip.solver.parameter import declared, require
from nanoslip.solver.slab import LIMITED_BY_SCHEME
from nanoslip.study.manifest.checker import (
    Given,
    GivenColumns,
    SceneSizes,
    convert_all,
    convert_columns,
    find_refusal,
    is_limited,
)
from nanoslip.study.manifest.manifest import CampaignKeys
from nanoslip.study.manifest.parameters import axes, make_case, names_by_word
from nanoslip.study.manifest.problems import ManifestError, Place, Problem, Problems, key_shown, unknown

SAMPLED: Final = ("sobol", "latin_hypercube")
"""Designs whose cases are points that fill ranges."""


def sample_axes(top: Mapping[str, Any], sizes: SceneSizes) -> tuple[GivenColumns, Problems]:
    """Values of all cases: of ranges that they fill evenly, and of lists that they draw from."""
    usual = {item.name: item.default for item in fields(CampaignKeys)}
    count = top.get("points", usual["points"])
    seed = top.get("design_seed", usual["design_seed"])
    # Checked before points are drawn: 10^9 of them, or a seed below 0, would end in an error of scipy or of memory.
    for key, value in {"points": count, "design_seed": seed}.items():
        stated = declared(CampaignKeys)[key]
        if isinstance(value, bool) or not stated.holds(value):
            return {}, [Problem.of(key, value, stated.describe_range(key, whole=True))]
    written = top.get("axes", {})
    problems = []
    if not any(isinstance(axis, dict) for axis in written.values()):
        problems.append(Problem.of("design", top["design"], "a range among its axes"))
    entries = [Given(Place(part="axes"), word, axis) for word, axis in written.items()]
    ranges, of_ranges = convert_all(entries, partial(_read_range, sizes))
    problems += of_ranges
    draws = sample_design(top["design"], len(ranges), count, seed) if ranges else ()
    columns: GivenColumns = {}
    # Not strict: without a range there is no draw, and zip(*()) has no column at all.
    for (entry, value_at), shares in zip(ranges, zip(*draws, strict=True), strict=False):
        # Between two allowed ends all is allowed, but what a scheme limits is tried with each case's own.
        allowed = isinstance(entry.value, dict) and not is_limited(names_by_word()[entry.key])
        columns[entry.key] = [entry._replace(value=value_at(float(share)), allowed=allowed) for share in shares]
    return columns, problems


def _read_range(sizes: SceneSizes, given: Given) -> tuple[Given, Callable[[float], Any]]:
    """An axis, and the function from a number in [0, 1) to a value of it. Raises InvalidInput, ManifestError."""
    word, written = given.key, given.value
    if word not in axes():
        remark = unknown(word, axes())
        raise ManifestError([Problem(given.place, key_shown(word), written, remark=remark)])
    is_list = isinstance(written, list) and bool(written)
    is_range = isinstance(written, dict) and {"from", "to"} <= written.keys() <= {"from", "to", "scale"}
    need = 'a range, {from = 20, to = 400, scale = "log"}, or a list of values'
    require(word, written, is_list or is_range, need)
    ends = written if is_list else [written["from"], written["to"]]
    entries = [given._replace(value=end) for end in ends]
    columns, problems = convert_columns({word: entries}, sizes)
    # An end that has no number has been refused by itself: nothing is left to say about the range.
    if problems:
        raise ManifestError(problems)
    values: list[Any] = [entry.value for entry in columns[word]]
    if is_list:
        # share < 1, so that the last value has as large a part of the draws as each other.
        return given, lambda share: values[int(share * len(values))]
    low, high = values
    scale = written.get("scale", "linear")
    need = _range_need(names_by_word()[word], low, high, scale)
    require(word, written, not need, need)
    return given, _interpolation(low, high, scale)


def _interpolation(low: float, high: float, scale: str) -> Callable[[float], float]:
    """Function from a number in [0, 1) to a number of a range."""
    # log x = log low + share·(log high - log low): equal shares are equal factors.
    if scale == "log":
        return lambda share: low * (high / low) ** share
    return lambda share: low + share * (high - low)


def _range_need(name: str, low: Any, high: Any, scale: Any) -> str:
    """Allowed values of a parameter's range if it is wrong; empty if it is right."""
    if isinstance(Case.of({}).flat[name], bool | int | str):
        return "a list of values, as it takes no range"
    # Here only what no scheme allows is refused, so the most permissive one is taken: each case is tried with its own later.
    permissive = dict.fromkeys(LIMITED_BY_SCHEME, "strip") | dict.fromkeys(BY_ROWS, "layer")
    scheme = {"scheme": permissive[name]} if name in permissive else {}
    for end in (low, high):
        wrong = find_refusal(make_case, {name: end, **scheme})
        if wrong:
            return wrong.need
    is_scale = scale == "linear" or (scale == "log" and low > 0.0)
    if is_scale and -math.inf < low < high < math.inf:
        return ""
    return 'numbers from < to, above 0 with scale = "log"; a scale is "linear" or "log"'


def sample_design(design: str, axes: int, count: int, seed: int) -> Floats:
    """Points of the unit cube (count, axes) that fill it evenly. The first points of `sobol` stay the same if more
    are requested."""
    # Only such designs need it.
    from scipy.stats import qmc  # noqa: PLC0415

    if design == "sobol":
        # A sequence of Sobol' is balanced at powers of two only: draw the next one, and keep its first points.
        power = math.ceil(math.log2(count))
        samples: Floats = qmc.Sobol(axes, seed=seed).random_base2(power)
        return samples[:count]
    hypercube = qmc.LatinHypercube(axes, seed=seed)
    return np.asarray(hypercube.random(count))
