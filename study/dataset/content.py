"""Check a dataset's file for foreign content, once, when it is opened.

What reads datasets relies on it: attributes, types and axes as `collect` makes them, texts that terminals do not
obey, runs that lie in their groups. Numbers of results may have any value.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from functools import cache
from itertools import chain
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import InvalidInput, printable
from nanoslip.solver.parameter import Quantity
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.origin import Origin
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.toml_text import ONE_LINE, from_toml, is_one_line

_MOST: Final = 60
"""Letters of a name in a message."""
_TITLE: Final = "title"
_MANIFEST: Final = "manifest"
_IN_WORDS: Final = (_TITLE, "manifest_sha256", *(each.name for each in fields(Origin)))
"""Attributes of a dataset that are texts; a manifest and files that it names have lines."""
_MEANING: Final = "long_name"
_OF_VARIABLES: Final = (_MEANING, "units", "symbol", "comment", "ancillary_variables", "flag_meanings")
"""Attributes of variables that are texts."""

Content = Mapping[str, xr.Dataset]
"""Name of a group (empty for the root) -> its content."""


def find_problem(content: Content) -> str:
    """Find the first content of a dataset that `collect` never writes, and state the requirement; empty if the
    dataset is sound."""
    # Runs are looked for in sound variables alone, so problems of variables come first.
    problems = (*_attributes_needs(content[""].attrs), *_variables_needs(content))
    return next(iter(problems), "") or next(_run_problems(content), "")


def _attributes_needs(attributes: Mapping[Any, Any]) -> Iterator[str]:
    if _TITLE not in attributes:
        yield f"{_TITLE}: missing"
    for name, value in attributes.items():
        if str(name) == _MANIFEST or not str(name).startswith(f"{_MANIFEST}_") or name in _IN_WORDS:
            yield from _attribute_needs(str(name), value)
    stated = [scale.name for scale in fields(Scales) if scale.name in attributes]
    scales = {name: attributes[name] for name in stated}
    try:
        numbers = {name: float(value) for name, value in scales.items()}
        Scales(**numbers)
    except InvalidInput as error:
        yield str(error)
    except (TypeError, ValueError):
        yield f"{', '.join(scales)}: needs numbers"


def _attribute_needs(name: str, value: object) -> Iterator[str]:
    """Report an attribute of a dataset that cannot be read."""
    if name == _MANIFEST:
        try:
            from_toml(str(value))
        except ValueError as error:
            yield f"{name}: {error}"
    elif isinstance(value, str):
        if not is_one_line(value):
            yield f"{name}: needs {ONE_LINE}"
    elif name in _IN_WORDS:
        yield f"{name}: needs a text"


def _variables_needs(content: Content) -> Iterator[str]:
    for group, group_content in content.items():
        for name, variable in group_content.variables.items():
            place = printable(f"{group}/{name}".lstrip("/"), _MOST)
            yield from (f"{place}: {need}" for need in _variable_needs(str(name), variable))
    root = content[""]
    if variables.CASE_ID.name not in root:
        yield f"no dataset of nanoslip: {variables.CASE_ID.name}: missing"
    for ended in variables.OUTCOMES.values():
        # All three or none: a dataset without drives has none of theirs.
        together = (ended.ending, ended.message, ended.computed_by)
        missing = [declared.name for declared in together if declared.name not in root]
        if 0 < len(missing) < len(together):
            yield f"no dataset of nanoslip: {missing[0]}: missing; xarray.open_dataset opens what is left of one"
    over_cases = [root[name] for name in (variables.CASE_ID.name, *_ENDINGS) if name in root]
    # Cases are found by their labels: neither of two equal ones, nor NaN, could be found.
    for dim in dict.fromkeys(dim for declared in over_cases for dim in declared.dims):
        if dim not in root.indexes or not root.indexes[dim].is_unique or root.indexes[dim].hasnans:
            yield f"{dim}: needs different values, as cases lie along it"


_ENDINGS: Final = [ending.name for ending, *_ in variables.OUTCOMES.values()]


def _variable_needs(name: str, variable: xr.Variable) -> Iterator[str]:
    """Requirements that a variable violates: on its attributes, type and texts."""
    for key, value in variable.attrs.items():
        if isinstance(value, str) and not is_one_line(value):
            yield f"{printable(str(key), _MOST)}: needs {ONE_LINE}"
        elif key in _OF_VARIABLES and not isinstance(value, str):
            yield f"{key}: needs a text"
        elif key == _MEANING and not value.strip():
            yield f"{key}: needs a text that is not empty"
    if are_texts(variable):
        yield from _text_needs(variable.values)
    elif variable.dtype.kind not in "iufb":
        yield f"{variable.dtype}: needs numbers or texts"
    declared, words = variables.variables_by_name().get(name), name in _texts()
    # A variable that states no unit holds words or switches, in either type.
    if declared and are_texts(variable) != words and (words or declared.units):
        yield f"needs {'texts' if words else 'numbers'}"
    if name in _errors() and variable.dtype.kind == "f" and bool((variable.values < 0.0).any()):
        yield "needs errors from 0 on"
    if name in _whole() and variable.dtype.kind not in "iu":
        yield "needs whole numbers"
    counted = {variables.MEMBERS.name, variables.DRIVE_MEMBERS.name}
    counted |= _whole() - {variables.VALIDITY.name}
    # A case without a result has no number of members: NaN.
    if name in counted and not bool(np.all(np.isnan(variable) | _counts(variable.values))):
        yield "needs whole numbers from 0 on"


@cache
def _errors() -> set[str]:
    """Variables over the cases that are the ± of another variable."""
    return {quantity.uncertainty for quantity in _scalars() if quantity.uncertainty}


@cache
def _whole() -> set[str]:
    """Variables over the cases that are whole numbers."""
    names = set()
    for quantity in _scalars():
        names |= {variable.name for variable in (quantity, *quantity.beside) if variable.whole}
    return names


@cache
def _texts() -> set[str]:
    """Variables that are texts."""
    outcomes = chain(*variables.OUTCOMES.values())
    always = [variables.CASE_ID, variables.DRIVE_NAME, variables.ADVICE, *outcomes]
    always += variables.OWN_MESSAGES.values()
    words = [quantity for quantity in _scalars() if quantity.words]
    ids = [group.id for group in variables.all_groups().values()]
    return {variable.name for variable in (*always, *words, *ids)}


def _scalars() -> list[Quantity]:
    """The scalars of all kinds of task."""
    return [quantity for kind in KINDS for _, quantity in variables.scalars(kind)]


def _counts(values: NDArray[Any]) -> NDArray[np.bool_]:
    """Allowed values of a variable that numbers something."""
    is_whole = values == np.floor(values)
    return np.asarray(np.isfinite(values) & (values >= 0) & is_whole)


def _text_needs(values: NDArray[Any]) -> Iterator[str]:
    # Each different text once: most cases of a large dataset have the same few.
    different = set(values.ravel().tolist())
    if not all(isinstance(text, str) for text in different):
        yield "needs texts"
    elif not all(map(is_one_line, different)):
        yield f"needs each text {ONE_LINE}"


# The runs of groups: as many values as their counts say, and a run for each name in the root.


def _run_problems(content: Content) -> Iterator[str]:
    declared = {name: group for name, group in variables.all_groups().items() if name in content}
    if declared and variables.SOFTWARE[0].name not in content:
        yield f"group {variables.SOFTWARE[0].name}: missing"
    for name, group in variables.all_groups().items():
        if (group.id.name in content[""]) != (name in content) and variables.SOFTWARE[0].name in content:
            yield f"{group.id.name}: missing" if name in content else f"group {name}: missing"
    for name, group in declared.items():
        yield from (f"group {name}: {need}" for need in _group_needs(content[name], group))
        run_names = {"", *content[name][name].values.tolist()}
        ids = content[""][group.id.name].values.ravel()
        strangers = {*ids.tolist()} - run_names
        if strangers:
            yield f"{group.id.name}: {min(strangers)} is not in the group {name}: join datasets with nanoslip.concat"


def _group_needs(content: xr.Dataset, group: variables.Group) -> Iterator[str]:
    labels = content.indexes.get(group.name)
    if labels is None or not labels.is_unique:
        yield f"{group.name}: needs different names"
        return
    for sample, series in group.samples.items():
        counts = content.get(series[0].count.name)
        if counts is None:
            if sample in content.dims:
                yield f"{series[0].count.name}: missing"
        elif counts.dims != (group.name,) or counts.dtype.kind not in "iu" or not _counts(counts.values).all():
            yield f"{counts.name}: needs a whole number for each name"
        elif variables.windows(content, group)[sample][-1] != content.sizes.get(sample, 0):
            yield f"{counts.name}: needs as many values as {sample} has"
