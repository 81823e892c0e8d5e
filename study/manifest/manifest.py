"""Read and check a campaign file: every problem at once, one line each, saying file, key, value and what is allowed.

Ranges are those of the solver's own values (`Case`, `Slab`, `SlipRule`, `Drive`, `Scales`): each number is tried there.
Scales and drives are in SI, the physics of a case is dimensionless.
"""

import hashlib
import itertools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

from solver.case import MOST_EVENTS, SCHEME_OF, Case, Scales
from solver.outcome import InvalidInput, quoted
from study.manifest.columns import Columns, Given, PinProfile, Table, read_profile, read_table, read_text
from study.manifest.drives import NamedDrive
from study.manifest.parameters import AXES, SETTINGS, TABLES, Value, field_name, flat, make_case
from study.manifest.problems import ManifestError, key_shown, need, shown, unknown

__all__ = [
    "STAGES",
    "Design",
    "Manifest",
    "ManifestError",
    "NamedDrive",
    "Outputs",
    "Stage",
    "load_manifest",
    "parse_manifest",
]

Stage = Literal["contact", "slip", "dynamics"]
Design = Literal["product", "zip", "table"]
STAGES: tuple[Stage, ...] = get_args(Stage)
MOST_MEMBERS = 10_000
VARIED = ("start", "seed")
"""Parameters in which members of an ensemble differ."""
SEEDS = 2**32
"""Distance between the seeds of members: nobody's axis of seeds meets another member's."""


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the dataset holds besides the scalars of each case."""

    records: bool = True
    """Friction records, event by event."""
    trajectory: bool = True
    """Position, velocity and forces of each drive over time."""
    phases: bool = True
    """Start and end of each macroscopic slip of a drive; like `trajectory` where it is not given."""
    tractions: bool = False
    """Pressure and shear of the slab's surface after initial contact; on by itself where nothing follows."""
    tractions_at: tuple[int, ...] = ()
    """Events after which pressure, shear, slip and gap are kept too; 0 is initial contact."""
    subsurface: bool = False
    """Displacements and stresses inside the slab, after initial contact or after those events."""

    def __post_init__(self) -> None:
        for name in _names(Outputs):
            value: Any = getattr(self, name)
            if name == "tractions_at":
                if not _increasing(value):
                    raise InvalidInput(
                        f"{name} = {quoted(value)}: needs a list of events, increasing from 0 to {MOST_EVENTS}"
                    )
                object.__setattr__(self, name, tuple(value))
            elif not isinstance(value, bool):
                raise InvalidInput(f"{name} = {quoted(value)}: needs true or false")


@dataclass(frozen=True, slots=True)
class Ensemble:
    """Members of every case: the same physics with the pin started elsewhere, and other nodes where their μ_i are drawn.

    members: how many, 1 to MOST_MEMBERS. Their starts are spread evenly over a node spacing from the case's own on; with a
    `spread` every member has a seed of its own. 1 is no ensemble.
    """

    members: int = 1

    def __post_init__(self) -> None:
        count: Any = self.members
        if isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= MOST_MEMBERS:
            raise InvalidInput(f"members = {shown(count)}: needs a whole number from 1 to {MOST_MEMBERS}")

    def varied(self, case: Case, member: int) -> dict[str, Value]:
        """The parameters in which a member differs from the case."""
        start = (case.start + member / self.members) % 1.0 if member else case.start
        drawn = case.heterogeneity
        changes: dict[str, Value] = {"start": start}
        return changes | ({"seed": drawn.seed + member * SEEDS} if drawn.spread else {})


@dataclass(frozen=True, slots=True)
class Manifest:
    """A campaign as its author wrote it, checked. Parameters go by field name and have their declared type."""

    path: Path
    text: str
    """The campaign file."""
    table_text: str | None
    """The table of cases, with design `table`."""
    profile_text: str | None
    """The pin's roughness, where there is one."""
    sha256: str
    """Of the campaign file's bytes followed by the table's and the roughness's."""
    title: str
    stages: tuple[Stage, ...]
    design: Design
    axes: Mapping[str, tuple[Value, ...]]
    """Parameter -> its values; with `zip` and `table` the i-th values of all axes are one case."""
    constants: Mapping[str, Value]
    numerics: Mapping[str, Value]
    slip_rule: Mapping[str, Value]
    effects: Mapping[str, Value]
    heterogeneity: Mapping[str, Value]
    limits: Mapping[str, Value]
    scales: Scales
    drives: tuple[NamedDrive, ...]
    outputs: Outputs
    ensemble: Ensemble = Ensemble()
    accuracy: float | None = None
    """The error asked for instead of a discretization (see study.discretization.front)."""
    front: Path | None = None
    """The measured front to choose from; None for this package's."""
    front_text: str | None = None
    """That front's file."""
    drives_left_out: tuple[str, ...] = ()
    """Names of the drives that the file has and the stages leave out; `drives` is empty then."""

    @property
    def name(self) -> str:
        """The campaign's short name: its file name without the ending."""
        return self.path.stem

    @property
    def fixed(self) -> dict[str, Value]:
        """The parameters that were given and are the same in all cases."""
        tables = (self.constants, self.numerics, self.slip_rule, self.effects, self.heterogeneity, self.limits)
        return {name: value for table in tables for name, value in table.items()}


def load_manifest(path: Path) -> Manifest:
    """Read a campaign file and the files it names. Raises ManifestError with one line per problem."""
    raw, text = read_text(path)
    return _Reader(path).manifest(raw, text, _document(path, text))


def parse_manifest(path: Path, text: str, beside: Mapping[str, str]) -> Manifest:
    """As `load_manifest`, from texts alone: no file is read. Raises ManifestError with one line per problem.

    path: what problems are said of. beside: the texts of the files that it names, by the keys that name them (`table`,
    `roughness`, `front`).
    """
    return _Reader(path, beside).manifest(text.encode(), text, _document(path, text))


def _document(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise ManifestError([f"{path}: not TOML: {error}"]) from None


_TOP: dict[str, tuple[type | tuple[type, ...], str]] = {
    "title": (str, "a text"),
    "stages": (list, "a list of stages"),
    "design": (str, '"product" or "zip"'),
    "table": (str, "the path of a CSV file, seen from the campaign file"),
    "accuracy": ((int, float), "a relative error, 0 < accuracy < 1"),
    "front": (str, "the path of what nanoslip accuracy --save wrote, seen from the campaign file"),
    "axes": (dict, "a table [axes]"),
    **{name: (dict, f"a table [{name}]") for name in (*TABLES, "scales", "outputs", "ensemble")},
    "drives": (list, "tables [[drives]]"),
}


class _Reader:
    """Reads one campaign file, gathering its problems."""

    def __init__(self, path: Path, beside: Mapping[str, str] | None = None) -> None:
        self.path = path
        self.beside = beside
        self.problems: list[str] = []

    def manifest(self, raw: bytes, text: str, document: dict[str, Any]) -> Manifest:
        top = self._top(document)
        table = self._table(top)
        axes = table.columns if table else self._axes(top.get("axes", {}))
        profile = self._profile(top.get("heterogeneity", {}))
        fixed = {name: self._words(name, top.get(name, {})) for name in TABLES}
        fixed["heterogeneity"].pop("roughness", None)
        if profile:
            where = f"{self.path}: heterogeneity.roughness"
            fixed["heterogeneity"]["roughness"] = [Given(where, profile.points)]
        self._one_place(axes, fixed)
        accuracy = self._accuracy(top, {**axes, **fixed["numerics"]})
        slabs = _slabs({**fixed["numerics"], **axes})
        constants = {name: _single(self._values(part, slabs)) for name, part in fixed.items()}
        scales = Scales(**self._checked("scales", top.get("scales", {}), Scales))
        stages = self._stages(top)
        outputs = self._outputs(top.get("outputs", {}), stages)
        drives = self._drives(top, scales)
        driven = "dynamics" in stages
        result = Manifest(
            path=self.path,
            text=text,
            table_text=table.text if table else None,
            profile_text=profile.text if profile else None,
            sha256=hashlib.sha256(raw + b"".join(part.raw for part in (table, profile) if part)).hexdigest(),
            title=top.get("title", ""),
            stages=stages,
            design="table" if table else self._design(top, axes),
            axes=self._values(axes, slabs),
            constants=constants["constants"],
            numerics=constants["numerics"],
            slip_rule=constants["slip"],
            effects=constants["effects"],
            heterogeneity=constants["heterogeneity"],
            limits=constants["limits"],
            scales=scales,
            drives=drives if driven else (),
            drives_left_out=() if driven else tuple(drive.name for drive in drives),
            outputs=outputs,
            ensemble=Ensemble(**self._checked("ensemble", top.get("ensemble", {}), Ensemble)),
            accuracy=accuracy,
            front=self.path.parent / top["front"] if "front" in top else None,
            front_text=self._front(top),
        )
        if self.problems:
            raise ManifestError(self.problems)
        return result

    def _refuse(self, where: str, wrong: str) -> None:
        self.problems.append(f"{self.path}: {where}: {wrong}")

    def _top(self, document: dict[str, Any]) -> dict[str, Any]:
        """The document's keys that are known and of the right kind."""
        good = {}
        for key, value in document.items():
            kind, wanted = _TOP.get(key, (object, ""))
            if not wanted:
                self._refuse(f"{key_shown(key)} = {shown(value)}", unknown(key, _TOP))
            elif not isinstance(value, kind):
                self._refuse(f"{key} = {shown(value)}", f"needs {wanted}")
            else:
                good[key] = value
        if "title" not in document:
            self._refuse("title", "missing: needs a text")
        return good

    def _stages(self, top: dict[str, Any]) -> tuple[Stage, ...]:
        given = top.get("stages", list(STAGES if "drives" in top else STAGES[:2]))
        if not given or given != list(STAGES[: len(given)]):
            allowed = " or ".join(shown(list(STAGES[:count])) for count in (1, 2, 3))
            self._refuse(f"stages = {shown(given)}", f"needs {allowed}: each stage needs the ones before it")
        elif "dynamics" in given and not top.get("drives"):
            self._refuse("drives", 'missing: stage "dynamics" needs at least one [[drives]]')
        return STAGES[: len(given)]

    def _outputs(self, content: dict[str, Any], stages: tuple[Stage, ...]) -> Outputs:
        good = self._checked("outputs", content, Outputs)
        outputs = Outputs(**{"tractions": "slip" not in stages, "phases": good.get("trajectory", True), **good})
        if "slip" not in stages and any(outputs.tractions_at):
            wrong = 'needs stage "slip" for the events after 0'
            self._refuse(f"outputs.tractions_at = {shown(list(outputs.tractions_at))}", wrong)
        return outputs

    def _design(self, top: dict[str, Any], axes: Columns) -> Design:
        design: Design = top.get("design", "product")
        lengths = {word: len(given) for word, given in axes.items()}
        if design not in ("product", "zip"):
            self._refuse(f"design = {shown(design)}", 'needs "product" or "zip", or a table = "cases.csv" instead')
        elif design == "zip" and len(set(lengths.values())) != 1:
            counts = ", ".join(f"{count} of {word}" for word, count in lengths.items()) or "no axes"
            self._refuse('design = "zip"', f"needs axes of equal length, got {counts}")
        return design

    def _axes(self, content: dict[str, Any]) -> Columns:
        axes: Columns = {}
        for word, values in content.items():
            where = f"axes.{key_shown(word)}"
            if word not in AXES:
                self._refuse(f"{where} = {shown(values)}", unknown(word, AXES))
            elif not isinstance(values, list) or not values:
                self._refuse(f"{where} = {shown(values)}", "needs a list of at least one value")
            else:
                axes[word] = [Given(f"{self.path}: {where}[{index}]", value) for index, value in enumerate(values)]
        return axes

    def _table(self, top: dict[str, Any]) -> Table | None:
        if "table" not in top:
            return None
        for other in ("axes", "design"):
            if other in top:
                self._refuse(other, f"needs to be left out beside table = {shown(top['table'])}")
        try:
            return read_table(self.path.parent / top["table"], self._given("table"))
        except ManifestError as error:
            self.problems += error.lines
            return None

    def _profile(self, content: dict[str, Any]) -> PinProfile | None:
        name = content.get("roughness")
        if name is None:
            return None
        if not isinstance(name, str):
            self._refuse(f"heterogeneity.roughness = {shown(name)}", "needs the path of a CSV file with xi and height")
            return None
        try:
            return read_profile(self.path.parent / name, self._given("roughness"))
        except ManifestError as error:
            self.problems += error.lines
            return None

    def _front(self, top: dict[str, Any]) -> str | None:
        if "front" not in top:
            return None
        try:
            given = self._given("front")
            return read_text(self.path.parent / top["front"])[1] if given is None else given
        except ManifestError as error:
            self.problems += error.lines
            return None

    def _given(self, key: str) -> str | None:
        """The text that stands for the file of a key; None where files are read. Raises ManifestError where it is missing."""
        if self.beside is None:
            return None
        if key not in self.beside:
            raise ManifestError([f"{self.path}: {key}: the text of its file is missing"])
        return self.beside[key]

    def _words(self, table: str, content: dict[str, Any]) -> Columns:
        """The known words of a table of parameters, each a column of one."""
        good: Columns = {}
        for word, value in content.items():
            if word in TABLES[table]:
                good[word] = [Given(f"{self.path}: {table}.{word}", value)]
            else:
                self._refuse(f"{table}.{key_shown(word)} = {shown(value)}", unknown(word, TABLES[table]))
        return good

    def _one_place(self, axes: Columns, fixed: dict[str, Columns]) -> None:
        for table, part in fixed.items():
            for word in part:
                if word in axes:
                    self._refuse(f"{table}.{word}", "is an axis too: needs one place")

    def _accuracy(self, top: dict[str, Any], given: Columns) -> float | None:
        """The error asked for; what it decides may not be given beside it."""
        accuracy = top.get("accuracy")
        if accuracy is None:
            return None
        if isinstance(accuracy, bool) or not 0.0 < accuracy < 1.0:
            self._refuse(f"accuracy = {shown(accuracy)}", f"needs {_TOP['accuracy'][1]}")
            return None
        for column in (given[word] for word in SETTINGS if word in given):
            self.problems.append(f"{column[0].where}: needs to be left out beside accuracy = {shown(accuracy)}")
        return float(accuracy)

    def _values(self, columns: Columns, slabs: list[dict[str, Value]]) -> dict[str, tuple[Value, ...]]:
        """Values in their declared type by field name; those that fit none of the slabs are refused and left out."""
        values: dict[str, tuple[Value, ...]] = {}
        for word, given in columns.items():
            name = field_name(word)
            taken = []
            for where, value in given:
                points = [{**slab, name: value} for slab in slabs] if name in SCHEME_OF else [{name: value}]
                wrong = {index: need(make_case, point) for index, point in enumerate(points)}
                fitting = [point for index, point in enumerate(points) if not wrong[index]]
                if fitting:
                    taken.append(flat(make_case(fitting[0]))[name])
                else:
                    self.problems.append(f"{where} = {shown(value)}: {list(wrong.values())[-1]}")
            values[name] = tuple(value for value in taken if value is not None)
        return values

    def _checked(self, where: str, content: dict[str, Any], kind: type, **others: object) -> dict[str, Any]:
        """The keys of a table that are fields of `kind` and whose value it takes, beside `others`."""
        good = {}
        for key, value in content.items():
            if key not in _names(kind):
                self._refuse(f"{where}.{key_shown(key)} = {shown(value)}", unknown(key, _names(kind)))
            elif wrong := need(partial(kind, **{**others, key: value})):
                self._refuse(f"{where}.{key} = {shown(value)}", wrong)
            else:
                good[key] = value
        return good

    def _drives(self, top: dict[str, Any], scales: Scales) -> tuple[NamedDrive, ...]:
        drives: dict[str, NamedDrive] = {}
        for index, content in enumerate(top.get("drives", [])):
            where = f"drives[{index}]"
            if not isinstance(content, dict):
                self._refuse(f"{where} = {shown(content)}", "needs a table [[drives]]")
            elif drive := self._drive(where, content, scales):
                if drive.name in drives:
                    self._refuse(f"{where}.name = {shown(drive.name)}", "is another drive's name too: needs its own")
                drives[drive.name] = drive
        return tuple(drives.values())

    def _drive(self, where: str, content: dict[str, Any], scales: Scales) -> NamedDrive | None:
        # Whether a time step is right depends on the rest: these two are tried last, with all that is right by itself.
        last = {key: content[key] for key in ("integrator", "time_step") if key in content}
        alone = {key: value for key, value in content.items() if key not in last}
        good: dict[str, Any] = {"name": "-", **self._checked(where, alone, NamedDrive, name="-")}
        if "name" not in content:
            self._refuse(f"{where}.name", "missing: needs a name")
        try:
            drive = NamedDrive(**(good | last))
        except InvalidInput as error:
            key, _, wrong = str(error).replace(" = None", ": missing").partition(": ")
            self._refuse(f"{where}.{key}", wrong)
            return None
        try:
            drive.dimensionless(scales)
        except InvalidInput as error:
            self._refuse(where, f"in units of pin_mass and [scales], {error}")
            return None
        return drive


def _slabs(numerics: Columns) -> list[dict[str, Value]]:
    """The campaign's schemes on its largest n_x, as parameters: a scheme's own values that fit none of them fit no case."""
    good = {
        word: [given.value for given in numerics.get(word, []) if not need(make_case, {word: given.value})]
        for word in ("n_x", "scheme")
    }
    finest: dict[str, Value] = {"n_x": max(good["n_x"])} if good["n_x"] else {}
    return [{**finest, "scheme": scheme} for scheme in good["scheme"]] or [finest]


def _single(columns: dict[str, tuple[Value, ...]]) -> dict[str, Value]:
    return {name: values[0] for name, values in columns.items() if values}


def _increasing(value: Any) -> bool:
    """Whether it is a list of whole numbers from 0 to the most events of a record, each larger than the one before it."""
    if not isinstance(value, list | tuple) or any(isinstance(one, bool) or not isinstance(one, int) for one in value):
        return False
    return all(before < after for before, after in itertools.pairwise([-1, *value, MOST_EVENTS + 1]))


def _names(kind: type) -> tuple[str, ...]:
    return tuple(item.name for item in fields(kind))
