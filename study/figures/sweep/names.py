"""Variables as people write them: by name, by the start of a name, or as equations call them: plateau/mu_i, R/L_x or R."""

import difflib
from collections.abc import Iterable, Sequence

import xarray as xr

from nanoslip.study.figures.sweep.label import known
from nanoslip.study.figures.sweep.points import Points, points_of
from nanoslip.study.manifest.parameters import typed


class UnknownNameError(ValueError):
    """A word that is no variable or no axis of the dataset; the message says which there are."""


class AmbiguousNameError(UnknownNameError):
    """A symbol of several variables."""


def variable_of(dataset: xr.Dataset, word: str) -> str:
    """The variable or coordinate of the cases that a word means. Raises UnknownNameError, AmbiguousNameError."""
    names = [str(name) for name in dataset.variables]
    found = _called(names, word)
    if len(found) == 1:
        return found[0]
    if found:
        raise AmbiguousNameError(f"{word}: several variables are called so: {', '.join(found)}")
    near = difflib.get_close_matches(word, names, n=3, cutoff=0.5)
    hint = f"nearest: {', '.join(near)}" if near else "nanoslip describe lists them"
    raise UnknownNameError(f"{word}: no variable of this dataset; {hint}")


def points_named(dataset: xr.Dataset, word: str) -> Points:
    """A variable, or a ratio of two, of every case and drive. Raises UnknownNameError."""
    slashes = [place for place, letter in enumerate(word) if letter == "/"]
    splits = [(word, ""), *((word[:place], word[place + 1 :]) for place in slashes)]
    unknown = UnknownNameError(word)
    for above, below in splits:
        if above != word and not (above and below):
            unknown = UnknownNameError(
                f"{word}: needs a variable, or a ratio of two as plateau/mu_i; nanoslip describe lists them"
            )
            continue
        try:
            return points_of(dataset, variable_of(dataset, above), variable_of(dataset, below) if below else "")
        except AmbiguousNameError:
            raise
        except UnknownNameError as error:
            unknown = error
    raise unknown


def axis_named(points: Points, dataset: xr.Dataset, word: str) -> str:
    """The coordinate that a word means, among those in which cases differ. Raises UnknownNameError."""
    if len(found := _called(list(points.axes), word)) == 1:
        return found[0]
    try:
        variable_of(dataset, word)
        wrong = "cases do not differ in it"
    except AmbiguousNameError:
        wrong = "cases do not differ in what is called so"
    except UnknownNameError:
        wrong = "no variable of this dataset"
    raise UnknownNameError(f"{word}: {wrong}; they differ in {_listed(points.axes)}")


def _called(names: Sequence[str], word: str) -> list[str]:
    """The variables of these names that a word means, by the first rule that finds any."""
    symbols = {name: typed(_symbol(name)) for name in names if not name.startswith("fitted_")}
    for found in (
        [word] if word in names else [],
        [name for name, (known_as, _) in symbols.items() if word in known_as],
        [name for name, (_, in_short) in symbols.items() if word in in_short],
        [name for name in names if name == f"{word}_mean"],
    ):
        if found:
            return found
    return []


def _symbol(name: str) -> str:
    """What equations call a variable; empty where they do not."""
    found = known(name)
    return found.symbol if found else ""


def _listed(names: Iterable[str]) -> str:
    """Names, each with its symbol where it has one."""
    signs = {name: _symbol(name) for name in names}
    return ", ".join(f"{name} ({sign})" if sign else name for name, sign in signs.items()) or "nothing"
