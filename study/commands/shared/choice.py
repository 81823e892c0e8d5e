"""One case of a campaign, by what singles it out: `radius=200 n_x=65`."""

from collections.abc import Sequence

from study.manifest.cases import CampaignCase
from study.manifest.parameters import Value, in_words, words
from study.manifest.problems import ManifestError


def chosen(cases: Sequence[CampaignCase], selection: Sequence[str]) -> CampaignCase:
    """The one case that has all of these KEY=VALUE, keys as in a manifest. Raises ManifestError where none or several have."""
    found = list(cases)
    for entry in selection:
        key, equals, value = entry.partition("=")
        name = words().get(key, key)
        there = list(dict.fromkeys(case.parameters[name] for case in cases if name in case.parameters))
        if not equals or not there:
            known = in_words(", ".join(dict.fromkeys(name for case in cases for name in case.parameters)))
            raise ManifestError([f"{entry}: needs KEY=VALUE; these cases are told apart by {known}"])
        found = [case for case in found if _is(case.parameters.get(name), value)]
        if not any(_is(each, value) for each in there):
            raise ManifestError([f"{entry}: no such case; there are {', '.join(map(str, there))}"])
    if not found:
        raise ManifestError([f"{' '.join(selection)}: no case is all of that"])
    if len(found) > 1:
        said = " ".join(selection) or "no selection"
        raise ManifestError([f"{said}: {len(found)} cases are like that; {_differing(found)}"])
    return found[0]


def _differing(cases: Sequence[CampaignCase]) -> str:
    """What tells cases apart, as advice."""
    values = {name: list(dict.fromkeys(case.parameters.get(name) for case in cases)) for name in cases[0].parameters}
    told = (f"{name} = {' or '.join(map(str, each[:4]))}" for name, each in values.items() if len(each) > 1)
    return in_words(f"say {', '.join(told)}")


def _is(value: Value | None, text: str) -> bool:
    """Whether a value is what somebody wrote."""
    if isinstance(value, str):
        return value == text
    try:
        return value is not None and float(text) == float(value)
    except ValueError:
        return False
