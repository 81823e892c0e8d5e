"""Differences in the origin of two datasets: parameters, keys of their campaigns, scales, software and what ± means."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset.agreement.matching import Pair, values
from nanoslip.study.dataset.file import FORMAT, is_older
from nanoslip.study.dataset.members import MODEL
from nanoslip.study.dataset.variables import DRIVE_NAME, parameters
from nanoslip.study.manifest.checker import shown
from nanoslip.study.manifest.parameters import TABLES, Value, words_of
from nanoslip.study.origin import Origin
from nanoslip.study.toml_text import from_toml

_TEXTS: Final = ("manifest_table", "manifest_roughness")
"""Attributes with the text of a file that a campaign names."""
_APART: Final = ("title", "axes", "drives", "drive_axes", "scales", *TABLES)
"""Parts of a campaign whose values are parameters or scales, which are compared as what they came to."""


@dataclass(frozen=True, slots=True)
class Fact:
    """A parameter, key, scale or software that differs between two datasets."""

    name: str
    values: tuple[str, str]
    """As text; `–` where one says nothing of it."""


def differing(pair: Pair) -> list[Fact]:
    """Parameters, other keys of the campaigns, files that they name, scales and software that differ."""
    said = [dict(_said(root)) for root in pair]
    names = dict.fromkeys([*said[0], *said[1]])
    both = {name: (said[0].get(name, "–"), said[1].get(name, "–")) for name in names}
    return [Fact(name, value) for name, value in both.items() if value[0] != value[1]]


def meaning(pair: Pair) -> str:
    """What ± is where it is not in both what it is today; else empty."""
    older, today = (
        " and ".join(
            f"{name} (format {root.attrs[FORMAT]})"
            for name, root in zip("AB", pair, strict=True)
            if is_older(root) is old
        )
        for old in (True, False)
    )
    if not older:
        return ""
    other = f", that of {today} the 68 % interval over independent starts" if today else ""
    return f"± of {older} is {MODEL}{other}: either is taken for one standard deviation"


def _said(root: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Name and text of every fact of a dataset."""
    for name in (*parameters(), DRIVE_NAME.name):
        if found := values(root, name):
            yield name, ", ".join(map(_word, found[:6])) + (f", … ({len(found)} values)" if len(found) > 6 else "")
    for key, value in _keys(from_toml(str(root.attrs.get("manifest", "")))):
        yield key, shown(value)
    for name in _TEXTS:
        if name in root.attrs:
            yield name, f"a file of hash {content_hash(root.attrs[name], length=12)}"
    for name in ("discretization_front", *(item.name for kind in (Scales, Origin) for item in fields(kind))):
        if name in root.attrs:
            yield name, str(root.attrs[name])


def _word(value: Value) -> str:
    """A value of a parameter; switches as manifests have them."""
    return shown(value) if isinstance(value, bool) else str(value)


def _keys(document: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The keys of a campaign file that are no parameters: `stages`, `ensemble.members`, `outputs.records`, `limits.seconds`."""
    for key, value in document.items():
        if isinstance(value, Mapping) and (key in TABLES or key not in _APART):
            known = words_of(key) if key in TABLES else ()
            yield from ((f"{key}.{inner}", each) for inner, each in value.items() if inner not in known)
        elif key not in _APART:
            yield key, value
