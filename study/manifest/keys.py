"""Every key of a campaign that a parameter declares: meaning, unit, allowed values, default and an example."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any, Final, get_type_hints

from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.drive import AUTO, INTEGRATORS, Drive, Scales
from nanoslip.solver.parameter import Parameter, declared, field_choices
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.study.manifest import manifest
from nanoslip.study.manifest.parameters import LIMITS, TABLES, UNITS, as_written, axes, compact, with_symbol

CASE_TYPES: Final = (Case, Slab, *SCHEMES.values(), *PARTS.values())
TYPES_OF_TABLE: Final = {
    **dict.fromkeys(TABLES, CASE_TYPES),
    "scales": (Scales,),
    "drives": (manifest.NamedDrive, Drive, *INTEGRATORS.values()),
    "ensemble": (manifest.EnsembleTable,),
    "target": (manifest.TargetTable,),
    "outputs": (manifest.Outputs,),
    "about": (manifest.About,),
    "": (manifest.CampaignKeys,),
}
"""Table of a campaign -> types that declare its keys; empty: outside of all tables."""
FAMILIES: Final[Mapping[str, Mapping[str, Any]]] = {"scheme": SCHEMES, "integrator": INTEGRATORS}


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a campaign, in words."""

    word: str
    name: str
    """Field of the parameter, and variable of a dataset."""
    table: str
    only: str
    """The scheme or integrator that it belongs to; empty for all."""
    stated: Parameter
    allowed: str
    default: str
    """Text of its value; `none` without one, `needed` of a key that has to be given."""
    unless: str = ""
    """Condition of the default."""

    @property
    def place(self) -> str:
        """Table and word in a campaign."""
        brackets = "[[{}]] " if self.table == "drives" else "[{}] "
        table = brackets.format(self.table) if self.table else ""
        return f"{table}{self.word}" + (f", with {self.only}" if self.only else "")

    @property
    def example(self) -> str:
        """The default as a line of a campaign, and with a unit; empty without a default."""
        if self.stated.columns:
            own = f', or {self.word} = {{file = "afm.csv", x = "um", z = "nm"}}' if self.word == "roughness" else ""
            return f'{self.word} = "mine.csv"{own}'
        value, unit = self.default, _unit(self)
        if value in ("none", "needed"):
            return ""
        if not unit or value.startswith('"'):
            return f"{self.word} = {value}"
        scale = 1.0 if self.stated.unit != "1" else getattr(Scales(), self.stated.scale)
        over = "  # beside a slab_width" * (self.stated.unit == "1" and self.stated.scale == "slab_width")
        return f'{self.word} = {value}, or {self.word} = "{compact(float(value) * scale, unit)}"{over}'


def _unit(key: Key) -> str:
    stated = key.stated
    return as_written(stated.unit) if stated.unit != "1" else UNITS.get(stated.scale, "")


def find_key(name: str) -> Key | None:
    """The key of this word, name or symbol, in Greek or Latin letters; None without one."""
    found = [key for key in keys() if name in (key.word, key.name)]
    if found:
        return found[0]
    symbols = {key: key.stated.symbol for key in keys()}
    return next(iter(with_symbol(name, symbols)), None)


def key_text(key: Key) -> str:
    """A key in full, line by line."""
    stated = key.stated
    facts = {
        "meaning": stated.long_name,
        "symbol": stated.symbol,
        "unit": stated.unit,
        "key": key.place,
        "allowed": key.allowed,
        "default": f"{key.default} {key.unless}".strip(),
        "example": key.example,
        "comment": stated.comment,
    }
    return "\n".join([key.word, *(f"  {fact}: {text}" for fact, text in facts.items() if text)])


def text_of_table(name: str) -> str:
    """A table of a campaign, with the meaning or default of each key, line by line; empty without one of this
    name."""
    name = name.strip("[]")
    table = "drives" if name == "drive_axes" else name
    if table == "axes":
        own = [key for key in keys() if key.word in axes()]
    else:
        own = [key for key in keys() if table and key.table == table]
    lines = [f"{key.word}: {key.stated.long_name}" for key in own]
    return "\n  ".join([f"[{name}]", *lines]) if lines else ""


@cache
def keys() -> tuple[Key, ...]:
    """All keys, table by table, in the order of declaration."""
    return tuple(_keys())


def _keys() -> Iterator[Key]:
    for table, kinds in TYPES_OF_TABLE.items():
        for kind in kinds:
            types, defaults = get_type_hints(kind), {each.name: each.default for each in fields(kind)}
            for name, stated in declared(kind).items():
                if table not in TABLES or stated.table == table:
                    yield _key(kind, name, table, stated, types[name], defaults[name])
    for (table, word), stated in manifest.MORE_KEYS.items():
        yield Key(word, word, table, "", stated, stated.allowed(word, whole=False), "none")


def _key(kind: type, name: str, table: str, stated: Parameter, hint: Any, value: Any) -> Key:
    word = stated.word or name
    if value is MISSING and table in ("scales", "drives"):
        value = stated.si
    members = (member for family in FAMILIES.values() for member, own in family.items() if own is kind)
    only = next(members, "")
    default, unless = "needed" if value is MISSING else _text(value), ""
    if name == "duration":
        default = f'"{AUTO}"'
    if only in SCHEMES and default == "none":
        default, unless = _text(Slab(scheme=only).flat[name]), "at n_x = 129"
    if table == "limits":
        default, unless = (f"{LIMITS[name]:g}", "without any limit") if name in LIMITS else ("none", "")
    return Key(word, name, table, only, stated, _need(name, word, stated, hint), default, unless)


def _need(name: str, word: str, stated: Parameter, hint: Any) -> str:
    if stated.need and not stated.columns:
        return stated.need
    words = FAMILIES[name].keys() if name in FAMILIES else field_choices(hint)
    if words:
        return ", ".join(f'"{each}"' for each in words)
    if stated.columns:
        return f"a CSV file with the columns {', '.join(stated.columns)}"
    if hint is bool:
        return "true, false"
    return stated.allowed(word, hint is int or int in getattr(hint, "__args__", ()))


def _text(value: Any) -> str:
    match value:
        case None | () | "" | float("inf"):
            return "none"
        case tuple():
            return json.dumps(value)
        case bool():
            return str(value).lower()
        case str():
            return f'"{value}"'
        case float():
            return f"{value:g}"
    return str(value)
