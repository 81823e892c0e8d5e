"""Read and check a campaign file. All problems are reported at once: file, key, value and the allowed values.

Ranges are not repeated here: each value is tried in the solver's types (`Case`, `Slab`, `SlipRule`, `Drive`,
`Scales`). Scales and drives are in SI, the parameters of a case are dimensionless.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import BY_ROWS, Case, Effects, parameters_of_a_case
from nanoslip.solver.drive import (
    AUTO,
    INTEGRATORS,
    PERIODS,
    TRAVEL,
    Drive,
    Scales,
    only_length,
    refuse_with_memory,
    refuse_without_stroke,
)
from nanoslip.solver.elasticity.grid_scheme import GridScheme
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import ABSENT, LONGEST_MESSAGE, InvalidInput
from nanoslip.solver.parameter import as_float, declared, require
from nanoslip.solver.slab import LIMITED_BY_SCHEME, SCHEMES, Slab
from nanoslip.study.manifest.checker import (
    Checker,
    Given,
    GivenColumns,
    NamedFiles,
    SceneSizes,
    find_refusal,
    is_limited,
    read_text,
)
from nanoslip.study.manifest.manifest import (
    KNOWABLE,
    MOST_CASES,
    MOST_DRIVEN,
    OF_CONTACTS,
    SECONDS_KEY,
    STAGES,
    TASK_SECONDS,
    YOUNG_MODULUS,
    About,
    CampaignDrive,
    CampaignKeys,
    Design,
    EnsembleTable,
    Manifest,
    NamedDrive,
    Outputs,
    Stage,
    TargetTable,
    drive_parameters,
)
from nanoslip.study.manifest.observables import (
    KEY,
    Observable,
    source_files,
    stage_need,
)
from nanoslip.study.manifest.parameters import (
    FILE_KEYS,
    SMOOTH,
    TABLES,
    YOUNG,
    Value,
    axes,
    file_parameters,
    has_unit,
    make_case,
    names_by_word,
    plain,
    table_taking,
    twice,
    words_by_name,
)
from nanoslip.study.manifest.problems import ManifestError, key_shown, unknown
from nanoslip.study.toml_text import ONE_LINE, from_toml, one_line, quote_toml

# The drives of a campaign file: its tables [[drives]], each at every point of [drive_axes].

AXES: Final = "drive_axes"
DEFAULT: Final = "default"
"""Name of a drive whose table gives none, or that has axes and no table."""


class Drives(NamedTuple):
    """The drives of a campaign, table by table, the last axis fastest."""

    drives: tuple[CampaignDrive, ...] = ()
    axes: Mapping[str, tuple[Value, ...]] = {}
    """Parameter -> its values, in their declared type."""


class _Table(NamedTuple):
    """One table [[drives]]."""

    where: str
    name: str
    entries: dict[str, Any]
    """Entries that are valid alone, and the settings of integrators, which are checked last."""


def read_drives(checker: Checker, top: Mapping[str, Any], scales: Scales) -> Drives:
    """The drives of a campaign file, whose problems the checker gathers.

    A point whose values exclude each other is a drive with the outcome `invalid`. A table that no point suits is a problem
    of the file, and so is a value that suits no table and no other value.
    """
    axes = _axes(checker, top.get(AXES, {}))
    tables = _tables(checker, top, axes)
    if (count := len(tables) * math.prod(map(len, axes.values()))) > MOST_CASES:
        checker.refuse(AXES, remark=f"{count} drives", need=f"at most {MOST_CASES}")
        return Drives()
    points = [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]
    found = []
    for table in tables:
        found.append([_make_drive(table, point, scales) for point in points])
    for table, drives in zip(tables, found, strict=True):
        if all(drive.drive is None for drive in drives):
            _refuse_table(checker, table, drives[0])
    together = tuple(itertools.chain(*found))
    if any(drive.drive for drive in together):
        _refuse_values(checker, axes, together)
    return Drives(together, axes)


def _tables(checker: Checker, top: Mapping[str, Any], axes: Mapping[str, Any]) -> list[_Table]:
    found: dict[str, _Table] = {}
    for index, content in enumerate(top.get("drives", [])):
        where = f"drives[{index}]"
        if not isinstance(content, dict):
            checker.refuse(where, content, "a table [[drives]]")
            continue
        for key in (key for key in content if key in axes):
            checker.refuse(key, need="one place", remark=f"is in [{AXES}] too", table=where)
        entries = {"name": DEFAULT} | {key: value for key, value in content.items() if key not in axes}
        table = _table(checker, where, checker.to_si(where, entries, drive_parameters()))
        if table.name in found:
            checker.refuse("name", table.name, "its own", "is another drive's name too", where)
        found[table.name] = table
    if axes and not top.get("drives"):
        return [_Table(AXES, DEFAULT, {})]
    return list(found.values())


def _table(checker: Checker, where: str, content: dict[str, Any]) -> _Table:
    # Valid time steps depend on other keys, so integrators are checked last, with every valid key.
    last = {key: content[key] for key in (INTEGRATORS.word, *INTEGRATORS.settings()) if key in content}
    alone = {key: value for key, value in content.items() if key not in last}
    good = checker.valid(where, alone, NamedDrive.of, ("name", *drive_parameters()), name="-")
    for key, value in list(last.items()):
        if wrong := find_refusal(_drive_value, key, value):
            checker.refuse(key, value, wrong.need, table=where)
            del last[key]
    if alone.keys() - good and (wrong := find_refusal(only_length, alone)):  # else all of the table says it
        checker.refuse(wrong.key, wrong.value, wrong.need, table=where)
    return _Table(where, good.pop("name", "-"), good | last)


def _axes(checker: Checker, content: Mapping[str, Any]) -> dict[str, tuple[Value, ...]]:
    """Known axes with their valid values, in their declared type."""
    found: dict[str, tuple[Value, ...]] = {}
    for key, values in checker.lists(AXES, content, drive_parameters()):
        firsts = checker.first_places(AXES, key, values)
        found[key] = tuple(dict.fromkeys(_values(checker, key, firsts)))
    return {key: values for key, values in found.items() if values}


def _values(checker: Checker, key: str, values: Mapping[int, Any]) -> Iterator[Value]:
    """Values of a drive axis in their declared type. values: by their positions."""
    seen: set[Value] = set()
    for index, entry in values.items():
        place = f"{key}[{index}]"
        number = checker.to_si(AXES, {place: entry}, {place: drive_parameters()[key]})
        if place not in number:
            continue
        given = number[place]
        try:
            value = _drive_value(key, given)
        except InvalidInput as wrong:
            checker.refuse(place, given, wrong.need, table=AXES)
            continue
        if value in seen:
            checker.refuse(place, given, "each value once", "is there twice", AXES)
        seen.add(value)
        yield value


def _drive_value(key: str, value: Any) -> Value:
    """Convert a single value of a drive to its declared type. Raises InvalidInput."""
    require(key, value, value != AUTO, "a number on an axis")
    if key == INTEGRATORS.word:
        return str(INTEGRATORS.named(value).name)
    beside: dict[str, Any] = {}
    if key in INTEGRATORS.settings():  # which are right beside others only
        beside = {INTEGRATORS.word: INTEGRATORS.settings()[key][0].name, "duration": _LONGEST}
    typed: Value = NamedDrive.of("-", **beside, **{key: value}).flat[key]
    return typed


_LONGEST: Final = drive_parameters()["duration"].most


def _make_drive(table: _Table, point: dict[str, Value], scales: Scales) -> CampaignDrive:
    given = {**table.entries, **point}
    try:
        refuse_without_stroke(given)
        drive = NamedDrive.of(table.name, **given)
    except InvalidInput as error:
        lasting = {"duration": None} if {PERIODS, TRAVEL} & given.keys() else {}
        settings = {**_DEFAULTS.flat, **lasting, **given}
        return CampaignDrive(table.name, point, settings, None, refused=error)
    if wrong := find_refusal(drive.dimensionless, scales):
        return CampaignDrive(table.name, point, drive.flat, None, refused=wrong)
    return CampaignDrive(table.name, point, drive.flat, drive, frozenset(given))


_DEFAULTS: Final = NamedDrive(DEFAULT)


def _refuse_table(checker: Checker, table: _Table, first: CampaignDrive) -> None:
    if wrong := first.refused:
        where = AXES if wrong.key in first.point else table.where
        checker.refuse(wrong.key, wrong.value, wrong.need, table=where)


def _refuse_values(checker: Checker, axes: Mapping[str, tuple[Value, ...]], drives: Sequence[CampaignDrive]) -> None:
    for name, values in axes.items():
        good = {drive.point[name] for drive in drives if drive.drive}
        for index, value in enumerate(values):
            if value not in good:
                wrong = next(drive.refused for drive in drives if drive.refused and drive.point[name] == value)
                remark = "" if wrong.key == name else str(wrong)
                checker.refuse(f"{name}[{index}]", value, "" if remark else wrong.need, remark, AXES)


def load_manifest(path: Path) -> Manifest:
    """Read a campaign file and the files it names. Raises ManifestError with all problems."""
    return _Reader(path).manifest(read_text(path))


def parse_manifest(path: Path, text: str, beside: Mapping[str, str]) -> Manifest:
    """Parse a manifest from texts, without reading any file. Raises ManifestError with all problems.

    path: name of the campaign file for messages. beside: texts of the files that it names, by the keys that name them
    (nanoslip.study.manifest.parameters.FILE_KEYS).
    """
    return _Reader(path, beside).manifest(text)


def manifest_hash(text: str, files: Mapping[str, str]) -> str:
    """Hash (SHA-256) of the text of a campaign file, followed by the texts of its files in `FILE_KEYS`."""
    texts = [files[key] for key in FILE_KEYS if key in files]
    return hashlib.sha256("".join([text, *texts]).encode()).hexdigest()


def files_in_campaign(campaign: Mapping[str, Any]) -> dict[str, list[str]]:
    """The files that the content of a campaign names, by the keys that name them; of an axis several."""
    named: dict[str, list[Any]] = {"table": [campaign.get("table")]}
    for word, stated in file_parameters().items():
        tables = (campaign.get(table) for table in (stated.table, "axes"))
        given = [table[word] for table in tables if isinstance(table, Mapping) and word in table]
        names = given[0] if given and isinstance(given[0], list) else given
        named[word] = [_file_name(value) for value in names]
    found = {}
    for key, names in named.items():
        found[key] = [str(name) for name in names if isinstance(name, str | PathLike)]
    found["roughness"] = [name for name in found["roughness"] if name != SMOOTH]
    outputs = campaign.get("outputs")
    found[KEY] = source_files(outputs.get(KEY)) if isinstance(outputs, Mapping) else []
    return {key: names for key, names in found.items() if names}


def _file_name(value: Any) -> Any:
    """The file of a value that names one, as text or as a table with more about it."""
    return value.get("file") if isinstance(value, Mapping) else value


def _document(path: Path, text: str) -> dict[str, Any]:
    try:
        return from_toml(text)
    except ValueError as error:
        raise ManifestError.in_file(path, remark=str(error)) from None


TOP_LEVEL: Final[dict[str, tuple[type, str]]] = {
    **{
        name: (kind, stated.need or stated.allowed(name, whole=True))
        for (name, stated), kind in zip(declared(CampaignKeys).items(), (str, list, str, int, int, str), strict=True)
    },
    "axes": (dict, "a table [axes]"),
    **{name: (dict, f"a table [{name}]") for name in (*TABLES, "scales", "outputs", "ensemble", "target", "about")},
    "drives": (list, "tables [[drives]]"),
    AXES: (dict, f"a table [{AXES}]"),
}


def goes_to_and_fro(top: Mapping[str, Any]) -> bool:
    """True if the stage of all drives of a campaign's content has a stroke."""
    tables = top.get("drives") or [{}]
    return "stage_stroke" in top.get(AXES, {}) or all(
        isinstance(each, dict) and "stage_stroke" in each for each in tables
    )


def _ensemble(files: NamedFiles, top: dict[str, Any], stages: tuple[Stage, ...], tractions: bool) -> Ensemble:
    """The ensemble of every case."""
    own, content = top.get("ensemble", {}), top.get("target")
    table = EnsembleTable(**files.valid("ensemble", own, EnsembleTable))
    if content is None:
        return Ensemble(table.members, places=table.places)
    if "members" in own:
        need = "to be left out beside [target], which decides their number; the most are target.most"
        files.refuse("members", own["members"], need, table="ensemble")
    if "within" not in content:
        files.refuse("[target]", need="within = 0.01, or another relative error")
    good = files.valid("target", content, TargetTable, within=0.5)
    for name in good.get("of", ()):
        stage = KNOWABLE[name]
        if STAGES.index(stage) > STAGES.index(stages[-1]):
            bringing = ", which a [[drives]] table brings" if stage == "dynamics" else ""
            need = f'stage "{stage}"{bringing}: without it there is no {name}'
            files.refuse("of", name, need, table="target")
        elif name in OF_CONTACTS and "slip" in stages and not tractions:
            need = 'stages = ["contact"] or outputs.tractions = true: else no contact is kept beside the record'
            files.refuse("of", name, need, table="target")
    target = TargetTable(**{"within": 0.5, **good})
    of = target.variables(stages[-1], to_and_fro=goes_to_and_fro(top))
    if "dynamics" in map(KNOWABLE.get, of):  # drives share records: each would slide further ones by itself
        of = tuple(dict.fromkeys(("plateau_mean", *of)))
    return Ensemble(target.most, float(target.within), of, table.places)


SAMPLED: Final = ("sobol", "latin_hypercube")
"""Designs whose cases are points that fill ranges."""
OTHERS: Final = {"limits": (SECONDS_KEY,)}
"""Table -> its keys that are no parameters of a case."""


KEYS_OF_FILES: Final = frozenset((*TOP_LEVEL, "name", *itertools.chain(*OTHERS.values())))
"""Keys that a campaign has beside the parameters of its cases, their ensembles, drives and outputs."""


PARTS: Final = "split an axis over several campaigns, and join their datasets by nanoslip.concat"
"""Advice on a campaign of too many cases."""


def _need_of_title(title: str) -> str:
    """Allowed titles; empty for a valid title."""
    long = f"at most {LONGEST_MESSAGE} characters" if len(title) > LONGEST_MESSAGE else ""
    return long or ("" if one_line(title) else ONE_LINE)


class _Reader(NamedFiles):
    """Reads one campaign file."""

    def manifest(self, text: str) -> Manifest:
        top = self._top(_document(self.path, text))
        table = self.table(top)
        scales = self._scales(top, table.columns if table else ())
        sizes = SceneSizes(scales, "slab_width" in top.get("scales", {}))
        _spread_path(top)
        given = self.plain(table.columns, sizes) if table else self._axes(top, sizes)
        seconds = self._task_seconds(top)
        tables = {name: self.words_of_table(name, top.get(name, {}), OTHERS.get(name, ())) for name in TABLES}
        sizes = sizes._replace(load=_load_in_newton(tables["constants"], given, scales))
        fixed = {name: self.plain(content, sizes) for name, content in tables.items()}
        hashed = ({"table": table} if table else self.rows_of_axis(given, sizes)) | self.rows(fixed, sizes)
        files = {key: each.text for key, each in hashed.items()}
        self.one_place(given, fixed)
        slabs = _slabs({**fixed["numerics"], **given})
        stages = self._stages(top)
        outputs = self._outputs(top.get("outputs", {}), stages)
        own: tuple[Observable, ...] = ()
        if outputs.observables:
            files[KEY], own = self.observables(outputs.observables)
        driven = read_drives(self, top, scales)
        pulled = driven if "dynamics" in stages else Drives()
        for each in own:
            if need := stage_need(each, stages):
                self.refuse(KEY, each.reference, need, table="outputs")
        names = tuple(dict.fromkeys(drive.name for drive in driven.drives))
        result = Manifest(
            path=self.path,
            text=text,
            files=files,
            sha256=manifest_hash(text, files),
            title=top.get("title", ""),
            stages=stages,
            design="table" if table else self._design(top, given),
            axes=self.values(given, slabs),
            tables={name: _single(self.values(part, slabs)) for name, part in fixed.items()},
            task_seconds=seconds,
            scales=scales,
            drives=pulled.drives,
            drive_axes=pulled.axes,
            drives_left_out=() if pulled.drives else names,
            outputs=outputs,
            ensemble=_ensemble(self, top, stages, outputs.tractions),
            about=About(**self.valid("about", top.get("about", {}), About)),
            observables=own,
        )
        self._counts(result)
        if result.paths:
            self._with_path(top, result)
        if self.problems:
            raise ManifestError(self.problems)
        return result

    def _with_path(self, top: dict[str, Any], manifest: Manifest) -> None:
        """Refuse settings that a path of pin and load excludes in all cases."""
        if "slip" not in manifest.stages:
            self.refuse("stages", list(manifest.stages), 'stage "slip", in which the pin goes along [path]')
        if "target" in top:
            self.refuse("[target]", need="[ensemble] members: numbers of a [path] have no target")
        ways = {name: values[0] for name, values in manifest.axes.items() if name in declared(LoadPath) and values}
        wrong = find_refusal(make_case, {**manifest.fixed, **ways})
        if wrong and wrong.key == "path":
            for name, value in wrong.beside.items():
                word = words_by_name()[name]
                self.refuse(word, value, f"{wrong.need}, beside [path]", table=table_taking(word))

    def _counts(self, manifest: Manifest) -> None:
        """Refuse more cases, or drives of cases, than fit a machine: nothing has been expanded yet."""
        cases, drives = manifest.case_count, len(manifest.drives)
        if cases > MOST_CASES:
            self.refuse(f"{cases} cases", need=f"at most {MOST_CASES}; {PARTS}")
        elif cases * drives > MOST_DRIVEN:
            need = f"at most {MOST_DRIVEN} drives in all; {PARTS}"
            self.refuse(f"{cases} cases with {drives} drives each", need=need)

    def _scales(self, top: dict[str, Any], columns: Collection[str]) -> Scales:
        """Read the scales. `young_modulus` replaces the shear modulus, E/(2(1 + ν)), with the campaign's one Poisson's
        ratio.

        columns: of its table of cases.
        """
        stated = declared(Scales)
        content = self.to_si("scales", top.get("scales", {}), {**stated, YOUNG: YOUNG_MODULUS})
        if YOUNG in content:
            modulus = content.pop(YOUNG)
            poisson = top.get("constants", {}).get("poisson", Slab().poisson)
            if "shear_modulus" in content or "poisson" in {*top.get("axes", {}), *columns}:
                need = "one Poisson's ratio, and no shear_modulus beside it"
                self.refuse(YOUNG, modulus, need, table="scales")
            elif wrong := find_refusal(as_float, YOUNG, modulus):
                self.refuse(YOUNG, modulus, wrong.need, table="scales")
            elif not find_refusal(as_float, "poisson", poisson) and parameters_of_a_case()["poisson"].holds(poisson):
                content["shear_modulus"] = modulus / (2.0 * (1.0 + poisson))  # a wrong one is refused in its table
        return Scales(**self.valid("scales", _with_depth(top, content), Scales))

    def _top(self, document: dict[str, Any]) -> dict[str, Any]:
        """Top-level entries of the file with a known key and the right type; the others are refused."""
        good = {}
        for key, value in document.items():
            kind, wanted = TOP_LEVEL.get(key, (object, ""))
            if not wanted:
                self.refuse(key_shown(key), value, remark=unknown(key, TOP_LEVEL))
            elif not isinstance(value, kind):
                self.refuse(key, value, wanted)
            elif key == "title" and (need := _need_of_title(str(value))):
                self.refuse(key, value, need)
            else:
                good[key] = value
        if "title" not in document:
            self.refuse("title", None, "a text")
        return good

    def _task_seconds(self, top: dict[str, Any]) -> float | None:
        """The time that a task may take; the key is taken from its table, whose others are parameters of cases."""
        if SECONDS_KEY not in top.get("limits", {}):
            return None
        top["limits"] = dict(top["limits"])
        seconds = top["limits"].pop(SECONDS_KEY)
        if isinstance(seconds, bool) or not isinstance(seconds, int | float) or not TASK_SECONDS.holds(seconds):
            self.refuse(SECONDS_KEY, seconds, TASK_SECONDS.need, table="limits")
            return None
        return float(seconds)

    def _stages(self, top: dict[str, Any]) -> tuple[Stage, ...]:
        given = top.get("stages", list(STAGES if "drives" in top or AXES in top else STAGES[:2]))
        if not given or given != list(STAGES[: len(given)]):
            self.refuse("stages", given, f"{TOP_LEVEL['stages'][1]}: each stage needs the ones before it")
            known = [number for number, stage in enumerate(STAGES, 1) if stage in given]
            return tuple(STAGES[: max(known, default=3)])
        if "dynamics" in given and not (top.get("drives") or top.get(AXES)):
            self.refuse("drives", None, f'at least one [[drives]] or [{AXES}], for stage "dynamics"')
        return STAGES[: len(given)]

    def _outputs(self, content: dict[str, Any], stages: tuple[Stage, ...]) -> Outputs:
        good = self.valid("outputs", content, Outputs)
        outputs = Outputs(**{"tractions": "slip" not in stages, "phases": good.get("trajectory", True), **good})
        if "slip" not in stages and outputs.statistics:
            self.refuse("statistics", True, 'stage "slip": without it there are no events', table="outputs")
        if "slip" not in stages and any(outputs.tractions_at):
            self.refuse("tractions_at", outputs.tractions_at, 'stage "slip" for the events after 0', table="outputs")
        return outputs

    def _design(self, top: dict[str, Any], axes: GivenColumns) -> Design:
        design: Design = top.get("design", "product")
        lengths = {word: len(given) for word, given in axes.items()}
        if design not in ("product", "zip", *SAMPLED):
            self.refuse("design", design, f'{TOP_LEVEL["design"][1]}, or a table = "cases.csv" instead')
        elif design not in SAMPLED and (idle := {"points", "design_seed"} & top.keys()):
            self.refuse(sorted(idle)[0], need=f"design = {' or '.join(map(quote_toml, SAMPLED))}")
        elif design == "zip" and len(set(lengths.values())) != 1:
            counts = ", ".join(f"{count} of {word}" for word, count in lengths.items()) or "no axes"
            self.refuse("design", design, f"axes of equal length, got {counts}")
        return design

    def _axes(self, top: dict[str, Any], sizes: SceneSizes) -> GivenColumns:
        if top.get("design") in SAMPLED:
            return sample_axes(self, top, sizes)
        place = self.place("axes")
        listed: dict[str, list[Given]] = {}
        for word, values in self.lists("axes", top.get("axes", {}), axes()):
            positions = dict(enumerate(values))
            if top.get("design", "product") == "product":
                positions = self.first_places("axes", word, values)
            listed[word] = [Given(place, f"{word}[{index}]", value) for index, value in positions.items()]
        return self.plain(listed, sizes)


def sample_axes(checker: Checker, top: Mapping[str, Any], sizes: SceneSizes) -> GivenColumns:
    """Values of all cases: of ranges that they fill evenly, and of lists that they draw from."""
    usual = {item.name: item.default for item in fields(CampaignKeys)}
    count, seed = (top.get(key, usual[key]) for key in ("points", "design_seed"))
    for key, value in {"points": count, "design_seed": seed}.items():
        if isinstance(value, bool) or not declared(CampaignKeys)[key].holds(value):
            checker.refuse(key, value, TOP_LEVEL[key][1])
            return {}
    stated = top.get("axes", {})
    if not any(isinstance(given, dict) for given in stated.values()):
        checker.refuse("design", top["design"], "a range among its axes")
    every = {word: _range(checker, word, given, sizes) for word, given in stated.items()}
    ranges = {word: value_at for word, value_at in every.items() if value_at}
    draws = sample_design(top["design"], len(ranges), count, seed) if ranges else ()
    place = checker.place("axes")
    columns: GivenColumns = {}
    for (word, value_at), shares in zip(ranges.items(), zip(*draws, strict=True), strict=False):
        # Between two allowed ends all is allowed, but what a scheme limits is tried with each case's own.
        allowed = isinstance(stated[word], dict) and not is_limited(names_by_word()[word])
        columns[word] = [Given(place, word, value_at(float(share)), allowed) for share in shares]
    return columns


def _range(checker: Checker, word: str, given: Any, sizes: SceneSizes) -> Callable[[float], Any] | None:
    """Function from a number in [0, 1) to a value of an axis; None if refused."""
    place, listed = checker.place("axes"), isinstance(given, list) and given
    if word not in axes():
        checker.refuse(key_shown(word), given, remark=unknown(word, axes()), table="axes")
        return None
    if not listed and not (isinstance(given, dict) and {"from", "to"} <= given.keys() <= {"from", "to", "scale"}):
        need = 'a range, {from = 20, to = 400, scale = "log"}, or a list of values'
        checker.refuse(word, given, need, table="axes")
        return None
    ends = given if listed else [given["from"], given["to"]]
    columns = checker.plain({word: [Given(place, word, each) for each in ends]}, sizes)
    values: list[Any] = [each.value for each in columns[word]]
    if len(values) < len(ends):
        return None
    wrong = ""
    if not listed:
        wrong = _range_need(names_by_word()[word], values[0], values[1], given.get("scale", "linear"))
    if wrong:
        checker.refuse(word, given, wrong, table="axes")
        return None
    if listed:
        return lambda share: values[int(share * len(values))]
    return _interpolation(values[0], values[1], given.get("scale", "linear"))


def _interpolation(low: float, high: float, scale: str) -> Callable[[float], float]:
    """Function from a number in [0, 1) to a number of a range."""
    if scale == "log":
        return lambda share: low * (high / low) ** share
    return lambda share: low + share * (high - low)


def _range_need(name: str, low: Any, high: Any, scale: Any) -> str:
    """Allowed values of a parameter's range if it is wrong; empty if it is right."""
    if isinstance(Case.of({}).flat[name], bool | int | str):
        return "a list of values, as it takes no range"
    others = dict.fromkeys(LIMITED_BY_SCHEME, "strip") | dict.fromkeys(BY_ROWS, "layer")
    other = {"scheme": others[name]} if name in others else {}  # each case is tried with its own scheme later
    if wrong := find_refusal(make_case, {name: low, **other}) or find_refusal(make_case, {name: high, **other}):
        return wrong.need
    if -math.inf < low < high < math.inf and (scale == "linear" or (scale == "log" and low > 0.0)):
        return ""
    return 'numbers from < to, above 0 with scale = "log"; a scale is "linear" or "log"'


def sample_design(design: str, axes: int, count: int, seed: int) -> Floats:
    """Points of the unit cube (count, axes) that fill it evenly. The first points of `sobol` stay the same if more
    are requested."""
    from scipy.stats import qmc  # noqa: PLC0415  only such designs need it

    if design == "sobol":
        whole: Floats = qmc.Sobol(axes, seed=seed).random_base2(math.ceil(math.log2(count)))
        return whole[:count]
    return np.asarray(qmc.LatinHypercube(axes, seed=seed).random(count))


def _slabs(numerics: GivenColumns) -> list[dict[str, Value]]:
    """Parameters of a slab for each scheme of the campaign, with the largest n_x that the scheme allows.

    A scheme setting or an n_x that fits no slab of this list fits no case.
    """
    counts = [given.value for given in numerics.get("n_x", [])]
    names = [given.value for given in numerics.get("scheme", [])]
    schemes = [{"scheme": name} for name in names if not find_refusal(make_case, {"scheme": name})]
    return [_finest(scheme, counts) for scheme in schemes or [{}]]


def _finest(scheme: dict[str, Value], sizes: list[Any]) -> dict[str, Value]:
    good = [n_x for n_x in sizes if not find_refusal(make_case, {**scheme, "n_x": n_x})]
    return {**scheme, "n_x": max(good)} if good else scheme


def _spread_path(top: dict[str, Any]) -> None:
    """Replace an amplitude with a unit by the `stroke` twice as long, and lists in [path] by axes."""
    path = dict(top.get("path", {}))
    given = path.get("amplitude", 0.0)
    several = given if isinstance(given, list) else [given]
    if several and all(map(has_unit, several)) and "stroke" not in path:
        del path["amplitude"]
        strokes = [twice(each) for each in several]
        path["stroke"] = strokes if isinstance(given, list) else strokes[0]
    listed = {word: value for word, value in path.items() if isinstance(value, list) and word in axes()}
    if listed and not listed.keys() & top.get("axes", {}).keys():
        path = {word: value for word, value in path.items() if word not in listed}
        top["axes"] = {**top.get("axes", {}), **listed}
    if "path" in top:
        top["path"] = path


def _load_in_newton(constants: GivenColumns, axes: GivenColumns, scales: Scales) -> float:
    """normal_load of all cases in N; NaN if there are several, or none that is right."""
    if "normal_load" in axes:
        return math.nan
    given = constants["normal_load"][0].value if "normal_load" in constants else Case.of({}).normal_load
    try:
        given = plain("normal_load", given, parameters_of_a_case()["normal_load"], scales)
        return make_case({"normal_load": given}).normal_load * scales.force
    except InvalidInput:
        return math.nan


def _single(columns: dict[str, tuple[Value, ...]]) -> dict[str, Value]:
    return {name: values[0] for name, values in columns.items() if values}


def _with_depth(top: Mapping[str, Any], scales: dict[str, Any]) -> dict[str, Any]:
    """Scales with the depth of planes of nodes, which are squares, where none is given and no row of nodes has it, too."""
    axis = top.get("axes", {}).get("scheme")
    scheme = top.get("numerics", {}).get("scheme", axis)
    schemes = scheme if isinstance(scheme, list) else [scheme]
    planar = all(isinstance(each, str) and each in SCHEMES and SCHEMES[each].planar for each in schemes)
    return {"slab_depth": scales.get("slab_width", Scales().slab_width), **scales} if planar else scales


# The effects that a manifest switches on and off: what is left out where one is off, and combinations that are refused.


def refuse_with_stages(manifest: Manifest, case: Case) -> None:
    """Raise InvalidInput if the stages or outputs of its manifest exclude a case."""
    need = 'stages = ["contact"], as without friction there is nothing to slide against (F = 0)'
    require("friction", False, case.effects.friction or "slip" not in manifest.stages, need)
    if any(each.drive and each.drive.in_si.memory for each in manifest.drives):
        refuse_with_memory(case)
    need = "amplitude, stroke, slid, load or legs, or no [path] at all"
    require("path", ABSENT, bool(case.path) or not manifest.paths, need)
    if manifest.outputs.subsurface and not isinstance(case.slab.scheme, GridScheme):
        need = "a scheme that has a grid, others are a surface only"
        raise InvalidInput("subsurface", True, need, {"scheme": case.slab.scheme.name})
    scales = manifest.scales
    if case.slab.scheme.planar and scales.slab_depth != scales.slab_width:
        beside = {"slab_width": scales.slab_width, "scheme": case.slab.scheme.name}
        raise InvalidInput("slab_depth", scales.slab_depth, "slab_width, as a plane of nodes is a square", beside)
    contacts = case.interface.contacts
    if manifest.outputs.statistics and contacts > 1:
        raise InvalidInput("contacts", contacts, "one contact, whose events have sizes", {"statistics": True})


def read_effect_switches(manifest: Manifest) -> dict[str, str]:
    """Every effect that a manifest can switch -> its setting here: `on`, `off`, or values that differ from case to case or drive
    to drive."""
    found = {name: _word(name in manifest.stages) for name in ("slip", "dynamics")}
    found |= {name: _joint(map(_word, manifest.case_values(name))) for name in declared(Effects)}
    schemes = [SCHEMES[str(scheme)] for scheme in manifest.case_values("scheme")]
    found["finite slab (scheme)"] = _joint(_word(not scheme.bottomless) for scheme in schemes)
    found["spread of μ_i"] = _spread(manifest.case_values("spread"))
    found["load path"] = _word(manifest.paths)
    found["roughness of the pin"] = _word(any(manifest.case_values("roughness")))
    drives = [each.drive.in_si for each in manifest.drives if each.drive]
    return found | {name: _joint(map(setting, drives)) for name, setting in _OF_DRIVES.items() if manifest.drives}


_OF_DRIVES: Final[Mapping[str, Callable[[Drive], str]]] = {
    "surface_compliance": lambda drive: _word(drive.surface_compliance),
    "reverse_motion": lambda drive: _word(drive.reverse_motion),
    "damping": lambda drive: _word(drive.damping_ratio > 0.0),
    "sawtooth": lambda drive: "on" if drive.profile == "sawtooth" else f"off: {drive.profile}",
}
"""Effect of a drive -> its setting."""


def _spread(values: Sequence[Value]) -> str:
    different = {float(value) for value in values if value}
    shown = [f"{value:g}" for value in sorted(different)]
    if len(shown) > _MOST:
        shown = [f"{shown[0]} to {shown[-1]}"]
    off = [] if all(values) else ["off"]
    return _joint([*shown, *off])


_MOST: Final = 6
"""Values that are named one by one."""


def _word(on: object) -> str:
    return "on" if on else "off"


def _joint(values: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(values))
