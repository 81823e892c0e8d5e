"""KEY=VALUE on the command line, and the one case of a campaign that they single out: `radius=200 n_x=65`."""

from collections.abc import Mapping, Sequence
from typing import Final

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.manifest.manifest import drive_parameters
from nanoslip.study.manifest.parameters import Value, in_words, of_symbol, words

FEW: Final = 4
"""Values of a parameter that a refusal names."""


def assignments(given: Sequence[str]) -> dict[str, str]:
    """Words of a command line, `key=value` each, as a mapping; a key may be a parameter's symbol. Raises Refusal."""
    found: dict[str, str] = {}
    for word in given:
        key, sign, value = word.partition("=")
        if not (sign and key and value):
            raise Refusal(f"{word}: needs key=value, as radius=50")
        key = _of_symbol(key)
        if key in found:
            raise Refusal(f"{word}: {key} is given twice")
        found[key] = value
    return found


def _of_symbol(key: str) -> str:
    """The parameter of a case or a drive that has this symbol; any other key, or one of several, as it is."""
    return of_symbol(key, {**parameters_of_a_case(), **drive_parameters()})


def chosen(cases: Sequence[CampaignCase], given: Mapping[str, str]) -> CampaignCase:
    """The one case that has all of these values, keys as in a manifest.

    Raises ManifestError where none or several have.
    """
    points = [case.parameters for case in cases]
    found = list(range(len(points)))
    for key, value in given.items():
        name = words().get(key, key)
        there = list(dict.fromkeys(point[name] for point in points if name in point))
        if not there:
            known = in_words(", ".join(dict.fromkeys(name for point in points for name in point)))
            raise ManifestError([f"{key}={value}: these cases are told apart by {known}"])
        found = [number for number in found if _is(points[number].get(name), value)]
        if not any(_is(each, value) for each in there):
            raise ManifestError([f"{key}={value}: no such case; there are {', '.join(map(str, there))}"])
    said = " ".join(f"{key}={value}" for key, value in given.items()) or "no selection"
    if not found:
        raise ManifestError([f"{said}: no case is all of that"])
    if len(found) > 1:
        differing = _differing([points[number] for number in found])
        raise ManifestError([f"{said}: {len(found)} cases are like that; {differing}"])
    return cases[found[0]]


def _differing(points: Sequence[Mapping[str, Value]]) -> str:
    """What tells cases apart, as advice."""
    values = {name: list(dict.fromkeys(point.get(name) for point in points)) for name in points[0]}
    told = (f"{name} = {_some(each)}" for name, each in values.items() if len(each) > 1)
    return in_words(f"say {', '.join(told)}")


def _some(values: Sequence[Value | None]) -> str:
    """The first of some values, and whether there are more."""
    return " or ".join([*map(str, values[:FEW]), *(["…"] if len(values) > FEW else [])])


def _is(value: Value | None, text: str) -> bool:
    """Whether a value is what somebody wrote, as a campaign has it or as a table shows it."""
    if isinstance(value, str):
        return value == text
    if isinstance(value, bool):
        return text.lower() == str(value).lower()
    try:
        return value is not None and float(text) == float(value)
    except ValueError:
        return False
