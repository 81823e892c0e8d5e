"""Read and check a campaign file. All problems are reported at once: file, key, value and the allowed values.

Ranges are not repeated here: each value is tried in the solver's types (`Case`, `Slab`, `SlipRule`, `Drive`,
`Scales`). Scales and drives are in SI, the parameters of a case are dimensionless.
"""

import hashlib
import itertools
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import BY_ROWS, Case, parameters_of_a_case
from nanoslip.solver.drive import (
    AUTO,
    INTEGRATORS,
    PERIODS,
    TRAVEL,
    Scales,
    only_length,
    refuse_without_stroke,
)
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import LONGEST_MESSAGE, InvalidInput
from nanoslip.solver.parameter import as_float, declared, require
from nanoslip.solver.slab import LIMITED_BY_SCHEME, SCHEMES, Slab
from nanoslip.study.manifest.checker import (
    CaseTable,
    Checker,
    FileRows,
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
    stage_need,
)
from nanoslip.study.manifest.parameters import (
    FILE_KEYS,
    TABLES,
    YOUNG,
    Value,
    axes,
    has_unit,
    largest_half_width,
    make_case,
    names_by_word,
    plain,
    table_taking,
    twice,
    words_by_name,
)
from nanoslip.study.manifest.problems import ManifestError, key_shown, unknown
from nanoslip.study.toml_text import ONE_LINE, from_toml, is_one_line, quote_toml

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
    # Counted before they are made: axes of a thousand values each would fill the memory before anything was refused.
    count = len(tables) * math.prod(map(len, axes.values()))
    if count > MOST_CASES:
        checker.refuse(AXES, remark=f"{count} drives", need=f"at most {MOST_CASES}")
        return Drives()
    combinations = itertools.product(*axes.values())
    points = [dict(zip(axes, values, strict=True)) for values in combinations]
    drives_by_table = []
    for table in tables:
        drives_by_table.append([_make_drive(table, point, scales) for point in points])
    for table, drives in zip(tables, drives_by_table, strict=True):
        if all(drive.drive is None for drive in drives):
            _refuse_table(checker, table, drives[0])
    together = tuple(itertools.chain(*drives_by_table))
    # Without a single valid drive the tables have been refused already: each value would repeat the same reason.
    if any(drive.drive for drive in together):
        _refuse_values(checker, axes, together)
    return Drives(together, axes)


def _tables(checker: Checker, top: Mapping[str, Any], axes: Mapping[str, Any]) -> list[_Table]:
    tables: dict[str, _Table] = {}
    for index, content in enumerate(top.get("drives", [])):
        where = f"drives[{index}]"
        if not isinstance(content, dict):
            checker.refuse(where, content, "a table [[drives]]")
            continue
        entries = {"name": DEFAULT}
        for key, value in content.items():
            if key in axes:
                checker.refuse(key, need="one place", remark=f"is in [{AXES}] too", table=where)
            else:
                entries[key] = value
        in_si = checker.to_si(where, entries, drive_parameters())
        table = _table(checker, where, in_si)
        # The name is a coordinate of the dataset: two drives of one name could not be told apart there.
        if table.name in tables:
            checker.refuse("name", table.name, "its own", "is another drive's name too", where)
        tables[table.name] = table
    # Axes alone vary the paper's drive: a table without any entry would say no more.
    if axes and not top.get("drives"):
        return [_Table(AXES, DEFAULT, {})]
    return list(tables.values())


def _table(checker: Checker, where: str, content: dict[str, Any]) -> _Table:
    # Valid time steps depend on other keys, so integrators are checked last, with every valid key.
    of_integrators = (INTEGRATORS.word, *INTEGRATORS.settings())
    last = {key: content[key] for key in of_integrators if key in content}
    alone = {key: value for key, value in content.items() if key not in last}
    allowed = ("name", *drive_parameters())
    good = checker.valid(where, alone, NamedDrive.of, allowed, name="-")
    for key, value in list(last.items()):
        wrong = find_refusal(_drive_value, key, value)
        if wrong:
            checker.refuse(key, value, wrong.need, table=where)
            del last[key]
    # Of a table whose entries are all valid, `_make_drive` refuses two lengths, with all of the table at hand.
    two_lengths = find_refusal(only_length, alone)
    if two_lengths and alone.keys() - good:
        checker.refuse(two_lengths.key, two_lengths.value, two_lengths.need, table=where)
    name = good.pop("name", "-")
    return _Table(where, name, good | last)


def _axes(checker: Checker, content: Mapping[str, Any]) -> dict[str, tuple[Value, ...]]:
    """Known axes with their valid values, in their declared type."""
    axes: dict[str, tuple[Value, ...]] = {}
    for key, written in checker.lists(AXES, content, drive_parameters()):
        firsts = checker.first_places(AXES, key, written)
        values = tuple(dict.fromkeys(_values(checker, key, firsts)))
        # An axis whose values are all refused is left out: with no value it would have no point, and hide other problems.
        if values:
            axes[key] = values
    return axes


def _values(checker: Checker, key: str, values: Mapping[int, Any]) -> Iterator[Value]:
    """Values of a drive axis in their declared type. values: by their positions."""
    seen: set[Value] = set()
    for index, entry in values.items():
        place = f"{key}[{index}]"
        declaration = drive_parameters()[key]
        in_si = checker.to_si(AXES, {place: entry}, {place: declaration})
        if place not in in_si:
            continue
        number = in_si[place]
        try:
            value = _drive_value(key, number)
        except InvalidInput as wrong:
            checker.refuse(place, number, wrong.need, table=AXES)
            continue
        # Values that are written differently may be equal once they are converted, as 1 and 1.0, or "1 mm/s" and 1e-3.
        if value in seen:
            checker.refuse(place, number, "each value once", "is there twice", AXES)
        seen.add(value)
        yield value


def _drive_value(key: str, value: Any) -> Value:
    """Convert a single value of a drive to its declared type. Raises InvalidInput."""
    # AUTO depends on the other entries of a drive: it would be one label for different values.
    require(key, value, value != AUTO, "a number on an axis")
    if key == INTEGRATORS.word:
        integrator = INTEGRATORS.find_member(value)
        return str(integrator.name)
    beside: dict[str, Any] = {}
    # A setting is valid only beside its integrator, and a time step only within the duration: the longest excludes none.
    if key in INTEGRATORS.settings():
        integrator, *_ = INTEGRATORS.settings()[key]
        beside = {INTEGRATORS.word: integrator.name, "duration": _LONGEST}
    drive = NamedDrive.of("-", **beside, **{key: value})
    typed: Value = drive.flat[key]
    return typed


_LONGEST: Final = drive_parameters()["duration"].most


def _make_drive(table: _Table, point: dict[str, Value], scales: Scales) -> CampaignDrive:
    entries = {**table.entries, **point}
    try:
        refuse_without_stroke(entries)
        drive = NamedDrive.of(table.name, **entries)
    except InvalidInput as error:
        settings = dict(_DEFAULTS.flat)
        # A drive lasts by its periods or travel if it has them: the default duration beside them would be a wrong label.
        if {PERIODS, TRAVEL} & entries.keys():
            settings["duration"] = None
        settings |= entries
        return CampaignDrive(table.name, point, settings, None, refused=error)
    # Ranges hold once more in the solver's units, which depend on the scales: 1e300 N/m over a small modulus overflows.
    wrong = find_refusal(drive.dimensionless, scales)
    if wrong:
        return CampaignDrive(table.name, point, drive.flat, None, refused=wrong)
    return CampaignDrive(table.name, point, drive.flat, drive, frozenset(entries))


_DEFAULTS: Final = NamedDrive(DEFAULT)


def _refuse_table(checker: Checker, table: _Table, first: CampaignDrive) -> None:
    wrong = first.refused
    if wrong is None:
        return
    where = table.where
    if wrong.key in first.point:
        where = AXES
    checker.refuse(wrong.key, wrong.value, wrong.need, table=where)


def _refuse_values(checker: Checker, axes: Mapping[str, tuple[Value, ...]], drives: Sequence[CampaignDrive]) -> None:
    for name, values in axes.items():
        good = {drive.point[name] for drive in drives if drive.drive}
        reasons: dict[Value, InvalidInput] = {}
        for drive in drives:
            if drive.refused:
                reasons.setdefault(drive.point[name], drive.refused)
        for index, value in enumerate(values):
            if value in good:
                continue
            wrong = reasons[value]
            place = f"{name}[{index}]"
            # The need of another key would read as if this value needed it: the whole sentence names that key.
            if wrong.key == name:
                checker.refuse(place, value, wrong.need, table=AXES)
            else:
                checker.refuse(place, value, remark=str(wrong), table=AXES)


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
    # In the order of FILE_KEYS, not of the campaign: a dataset keeps the texts by key, and is verified from those alone.
    texts = [files[key] for key in FILE_KEYS if key in files]
    joined = "".join([text, *texts])
    return hashlib.sha256(joined.encode()).hexdigest()


def _document(path: Path, text: str) -> dict[str, Any]:
    try:
        return from_toml(text)
    except ValueError as error:
        raise ManifestError.in_file(path, remark=str(error)) from None


TOP_LEVEL: Final[dict[str, tuple[type, str]]] = {
    **{
        name: (kind, stated.need or stated.describe_range(name, whole=True))
        for (name, stated), kind in zip(declared(CampaignKeys).items(), (str, list, str, int, int, str), strict=True)
    },
    "axes": (dict, "a table [axes]"),
    **{name: (dict, f"a table [{name}]") for name in (*TABLES, "scales", "outputs", "ensemble", "target", "about")},
    "drives": (list, "tables [[drives]]"),
    AXES: (dict, f"a table [{AXES}]"),
}


def goes_to_and_fro(top: Mapping[str, Any]) -> bool:
    """True if the stage of all drives of a campaign's content has a stroke."""
    if "stage_stroke" in top.get(AXES, {}):
        return True
    # Without a table there is the default drive, which has no stroke.
    tables = top.get("drives") or [{}]
    return all(isinstance(table, dict) and "stage_stroke" in table for table in tables)


def _ensemble(files: NamedFiles, top: dict[str, Any], stages: tuple[Stage, ...], tractions: bool) -> Ensemble:
    """The ensemble of every case."""
    entries, content = top.get("ensemble", {}), top.get("target")
    valid = files.valid("ensemble", entries, EnsembleTable)
    table = EnsembleTable(**valid)
    if content is None:
        return Ensemble(table.members, places=table.places)
    if "members" in entries:
        need = "to be left out beside [target], which decides their number; the most are target.most"
        files.refuse("members", entries["members"], need, table="ensemble")
    if "within" not in content:
        files.refuse("[target]", need="within = 0.01, or another relative error")
    # `within` has no default, so each other entry is tried beside a valid one: a wrong `of` is refused for itself.
    good = files.valid("target", content, TargetTable, within=0.5)
    for name in good.get("of", ()):
        stage = KNOWABLE[name]
        if STAGES.index(stage) > STAGES.index(stages[-1]):
            bringing = ", which a [[drives]] table brings" if stage == "dynamics" else ""
            need = f'stage "{stage}"{bringing}: without it there is no {name}'
            files.refuse("of", name, need, table="target")
        # A record starts from the initial contact but keeps none of it; a campaign that slides computes it only to show it.
        elif name in OF_CONTACTS and "slip" in stages and not tractions:
            need = 'stages = ["contact"] or outputs.tractions = true: else no contact is kept beside the record'
            files.refuse("of", name, need, table="target")
    target = TargetTable(**{"within": 0.5, **good})
    variables = target.variables(stages[-1], to_and_fro=goes_to_and_fro(top))
    # Drives share records: with a target of their own alone each drive would slide further records by itself.
    if "dynamics" in map(KNOWABLE.get, variables):
        variables = tuple(dict.fromkeys(("plateau_mean", *variables)))
    return Ensemble(target.most, float(target.within), variables, table.places)


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
    if len(title) > LONGEST_MESSAGE:
        return f"at most {LONGEST_MESSAGE} characters"
    return "" if is_one_line(title) else ONE_LINE


class _Scene(NamedTuple):
    """The parameters of a campaign's cases: numbers in units of its scales, texts where a value names a file."""

    table: CaseTable | None
    sizes: SceneSizes
    columns: GivenColumns
    """Columns of the table of cases, or axes."""
    fixed: dict[str, GivenColumns]
    """Table -> its parameters, equal for all cases."""


class _Reader(NamedFiles):
    """Reads one campaign file: document, tables, numbers in units of the scales, values, manifest."""

    def manifest(self, text: str) -> Manifest:
        top = self._top(_document(self.path, text))
        # `seconds` is taken out of [limits] before its words are checked as parameters of a case.
        seconds = self._task_seconds(top)
        scene = self._scene(top)
        files = self._texts(scene)
        self.one_place(scene.columns, scene.fixed)
        slabs = _slabs({**scene.fixed["numerics"], **scene.columns})
        stages = self._stages(top)
        outputs = self._outputs(top.get("outputs", {}), stages)
        own_numbers = self._own_numbers(outputs, stages, files)
        # Drives are checked even where the stages leave them out: their mistakes would show only once they are switched on.
        written = read_drives(self, top, scene.sizes.scales)
        pulled = written if "dynamics" in stages else Drives()
        names = tuple(dict.fromkeys(drive.name for drive in written.drives))
        result = Manifest(
            path=self.path,
            text=text,
            files=files,
            sha256=manifest_hash(text, files),
            title=top.get("title", ""),
            stages=stages,
            design="table" if scene.table else self._design(top, scene.columns),
            axes=self.values(scene.columns, slabs),
            tables={name: _single(self.values(part, slabs)) for name, part in scene.fixed.items()},
            task_seconds=seconds,
            scales=scene.sizes.scales,
            drives=pulled.drives,
            drive_axes=pulled.axes,
            drives_left_out=() if pulled.drives else names,
            outputs=outputs,
            ensemble=_ensemble(self, top, stages, outputs.tractions),
            about=About(**self.valid("about", top.get("about", {}), About)),
            observables=own_numbers,
        )
        self._counts(result)
        if result.paths:
            self._with_path(top, result)
        if self.problems:
            raise ManifestError(self.problems)
        return result

    def _scene(self, top: dict[str, Any]) -> _Scene:
        table = self.table(top)
        # Scales come first: a value with a unit, in any table or on any axis, becomes a multiple of one.
        scales = self._scales(top, table.columns if table else ())
        width_given = "slab_width" in top.get("scales", {})
        half_width = math.nan if width_given else largest_half_width(top, scales)
        sizes = SceneSizes(scales, width_given, half_width)
        _spread_path(top)
        columns = self.plain(table.columns, sizes) if table else self._axes(top, sizes)
        words = {name: self.words_of_table(name, top.get(name, {}), OTHERS.get(name, ())) for name in TABLES}
        # Loads of a path may be in N: they are over normal_load, which is thus read before the path.
        load = _load_in_newton(words["constants"], columns, scales)
        sizes = sizes._replace(load=load)
        fixed = {name: self.plain(content, sizes) for name, content in words.items()}
        return _Scene(table, sizes, columns, fixed)

    def _texts(self, scene: _Scene) -> dict[str, str]:
        """Texts of the files that parameters name, by key, with the rows of these files in place of their names."""
        texts: dict[str, CaseTable | FileRows] = {}
        # A table of cases excludes axes, hence there is no profile on an axis beside it.
        if scene.table:
            texts["table"] = scene.table
        else:
            texts.update(self.rows_of_axis(scene.columns, scene.sizes))
        texts.update(self.rows(scene.fixed, scene.sizes))
        return {key: content.text for key, content in texts.items()}

    def _own_numbers(
        self, outputs: Outputs, stages: tuple[Stage, ...], files: dict[str, str]
    ) -> tuple[Observable, ...]:
        """Numbers by the user's functions; the files of the functions are added to `files`."""
        if not outputs.observables:
            return ()
        files[KEY], own_numbers = self.observables(outputs.observables)
        for observable in own_numbers:
            need = stage_need(observable, stages)
            if need:
                self.refuse(KEY, observable.reference, need, table="outputs")
        return own_numbers

    def _with_path(self, top: dict[str, Any], manifest: Manifest) -> None:
        """Refuse settings that a path of pin and load excludes in all cases."""
        if "slip" not in manifest.stages:
            self.refuse("stages", list(manifest.stages), 'stage "slip", in which the pin goes along [path]')
        if "target" in top:
            self.refuse("[target]", need="[ensemble] members: numbers of a [path] have no target")
        of_paths = declared(LoadPath)
        first_path = {name: values[0] for name, values in manifest.axes.items() if name in of_paths and values}
        # What excludes a path excludes every path: one of the campaign's is enough to find it in the fixed settings.
        wrong = find_refusal(make_case, {**manifest.fixed, **first_path})
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
        parameters = {**declared(Scales), YOUNG: YOUNG_MODULUS}
        content = self.to_si("scales", top.get("scales", {}), parameters)
        if YOUNG in content:
            modulus = content.pop(YOUNG)
            poisson = top.get("constants", {}).get("poisson", Slab().poisson)
            # G = E/(2(1 + ν)) is one scale of all cases: with several ν each case would have another.
            varied = {*top.get("axes", {}), *columns}
            no_modulus = find_refusal(as_float, YOUNG, modulus)
            no_ratio = find_refusal(as_float, "poisson", poisson)
            if "shear_modulus" in content or "poisson" in varied:
                need = "one Poisson's ratio, and no shear_modulus beside it"
                self.refuse(YOUNG, modulus, need, table="scales")
            elif no_modulus:
                self.refuse(YOUNG, modulus, no_modulus.need, table="scales")
            # A wrong ratio is refused in its own table: one problem is said once.
            elif not no_ratio and parameters_of_a_case()["poisson"].holds(poisson):
                content["shear_modulus"] = modulus / (2.0 * (1.0 + poisson))
        valid = self.valid("scales", _with_depth(top, content), Scales)
        return Scales(**valid)

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
        # A copy, as callers of Python may give the same content again.
        top["limits"] = dict(top["limits"])
        seconds = top["limits"].pop(SECONDS_KEY)
        # `true` is a whole number to Python, but no time.
        is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
        if not is_number or not TASK_SECONDS.holds(seconds):
            self.refuse(SECONDS_KEY, seconds, TASK_SECONDS.need, table="limits")
            return None
        return float(seconds)

    def _stages(self, top: dict[str, Any]) -> tuple[Stage, ...]:
        # Who writes down a drive wants it pulled, without having to list the stages.
        usual = STAGES if "drives" in top or AXES in top else STAGES[:2]
        names = top.get("stages", list(usual))
        if not names or names != list(STAGES[: len(names)]):
            self.refuse("stages", names, f"{TOP_LEVEL['stages'][1]}: each stage needs the ones before it")
            # Reading goes on with the last stage that is named, or all, so that no other key is refused for this mistake.
            counts = [number for number, stage in enumerate(STAGES, 1) if stage in names]
            return tuple(STAGES[: max(counts, default=3)])
        if "dynamics" in names and not (top.get("drives") or top.get(AXES)):
            self.refuse("drives", None, f'at least one [[drives]] or [{AXES}], for stage "dynamics"')
        return STAGES[: len(names)]

    def _outputs(self, content: dict[str, Any], stages: tuple[Stage, ...]) -> Outputs:
        good = self.valid("outputs", content, Outputs)
        # Tractions are all that a campaign of contacts has to show; phases are parts of the motion that is kept.
        usual = {"tractions": "slip" not in stages, "phases": good.get("trajectory", True)}
        outputs = Outputs(**{**usual, **good})
        if "slip" in stages:
            return outputs
        if outputs.statistics:
            self.refuse("statistics", True, 'stage "slip": without it there are no events', table="outputs")
        # Event 0 is initial contact, which there is without a record.
        if any(outputs.tractions_at):
            self.refuse("tractions_at", outputs.tractions_at, 'stage "slip" for the events after 0', table="outputs")
        return outputs

    def _design(self, top: dict[str, Any], axes: GivenColumns) -> Design:
        design: Design = top.get("design", "product")
        lengths = {word: len(values) for word, values in axes.items()}
        # Keys that this design would not read: left in silence, they would be taken to have had an effect.
        idle = sorted({"points", "design_seed"} & top.keys())
        if design not in ("product", "zip", *SAMPLED):
            self.refuse("design", design, f'{TOP_LEVEL["design"][1]}, or a table = "cases.csv" instead')
        elif design not in SAMPLED and idle:
            sampled = " or ".join(map(quote_toml, SAMPLED))
            self.refuse(idle[0], need=f"design = {sampled}")
        elif design == "zip" and len(set(lengths.values())) != 1:
            counts = ", ".join(f"{count} of {word}" for word, count in lengths.items())
            self.refuse("design", design, f"axes of equal length, got {counts or 'no axes'}")
        return design

    def _axes(self, top: dict[str, Any], sizes: SceneSizes) -> GivenColumns:
        if top.get("design") in SAMPLED:
            return sample_axes(self, top, sizes)
        place = self.place("axes")
        listed: dict[str, list[Given]] = {}
        for word, values in self.lists("axes", top.get("axes", {}), axes()):
            positions = dict(enumerate(values))
            # Position by position (zip) a value may come again; in a product it would make the same cases twice.
            if top.get("design", "product") == "product":
                positions = self.first_places("axes", word, values)
            listed[word] = [Given(place, f"{word}[{index}]", value) for index, value in positions.items()]
        return self.plain(listed, sizes)


def sample_axes(checker: Checker, top: Mapping[str, Any], sizes: SceneSizes) -> GivenColumns:
    """Values of all cases: of ranges that they fill evenly, and of lists that they draw from."""
    usual = {item.name: item.default for item in fields(CampaignKeys)}
    count = top.get("points", usual["points"])
    seed = top.get("design_seed", usual["design_seed"])
    # Checked before points are drawn: 10^9 of them, or a seed below 0, would end in an error of scipy or of memory.
    for key, value in {"points": count, "design_seed": seed}.items():
        if isinstance(value, bool) or not declared(CampaignKeys)[key].holds(value):
            checker.refuse(key, value, TOP_LEVEL[key][1])
            return {}
    stated = top.get("axes", {})
    if not any(isinstance(axis, dict) for axis in stated.values()):
        checker.refuse("design", top["design"], "a range among its axes")
    every = {word: _range(checker, word, axis, sizes) for word, axis in stated.items()}
    ranges = {word: value_at for word, value_at in every.items() if value_at}
    draws = sample_design(top["design"], len(ranges), count, seed) if ranges else ()
    place = checker.place("axes")
    columns: GivenColumns = {}
    # Not strict: without a range there is no draw, and zip(*()) has no column at all.
    for (word, value_at), shares in zip(ranges.items(), zip(*draws, strict=True), strict=False):
        # Between two allowed ends all is allowed, but what a scheme limits is tried with each case's own.
        allowed = isinstance(stated[word], dict) and not is_limited(names_by_word()[word])
        columns[word] = [Given(place, word, value_at(float(share)), allowed) for share in shares]
    return columns


def _range(checker: Checker, word: str, axis_entry: Any, sizes: SceneSizes) -> Callable[[float], Any] | None:
    """Function from a number in [0, 1) to a value of an axis; None if refused."""
    place, is_list = checker.place("axes"), isinstance(axis_entry, list) and axis_entry
    if word not in axes():
        checker.refuse(key_shown(word), axis_entry, remark=unknown(word, axes()), table="axes")
        return None
    is_range = isinstance(axis_entry, dict) and {"from", "to"} <= axis_entry.keys() <= {"from", "to", "scale"}
    if not is_list and not is_range:
        need = 'a range, {from = 20, to = 400, scale = "log"}, or a list of values'
        checker.refuse(word, axis_entry, need, table="axes")
        return None
    ends = axis_entry if is_list else [axis_entry["from"], axis_entry["to"]]
    entries = [Given(place, word, end) for end in ends]
    plain_entries = checker.plain({word: entries}, sizes)[word]
    # An end that has no number has been refused by itself: nothing is left to say about the range.
    if len(plain_entries) < len(ends):
        return None
    values: list[Any] = [entry.value for entry in plain_entries]
    if is_list:
        # share < 1, so that the last value has as large a part of the draws as each other.
        return lambda share: values[int(share * len(values))]
    low, high = values
    scale = axis_entry.get("scale", "linear")
    need = _range_need(names_by_word()[word], low, high, scale)
    if need:
        checker.refuse(word, axis_entry, need, table="axes")
        return None
    return _interpolation(low, high, scale)


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


def _slabs(numerics: GivenColumns) -> list[dict[str, Value]]:
    """Parameters of a slab for each scheme of the campaign, with the largest n_x that the scheme allows.

    A scheme setting or an n_x that fits no slab of this list fits no case.
    """
    counts = [entry.value for entry in numerics.get("n_x", [])]
    names = [entry.value for entry in numerics.get("scheme", [])]
    # A scheme that does not exist is refused for itself; the settings beside it are tried on the others, or the default.
    schemes = [{"scheme": name} for name in names if not find_refusal(make_case, {"scheme": name})]
    return [_finest(scheme, counts) for scheme in schemes or [{}]]


def _finest(scheme: dict[str, Value], sizes: list[Any]) -> dict[str, Value]:
    good = [n_x for n_x in sizes if not find_refusal(make_case, {**scheme, "n_x": n_x})]
    if not good:
        return scheme
    return {**scheme, "n_x": max(good)}


def _spread_path(top: dict[str, Any]) -> None:
    """Replace an amplitude with a unit by the `stroke` twice as long, and lists in [path] by axes."""
    path = dict(top.get("path", {}))
    amplitude = path.get("amplitude", 0.0)
    amplitudes = amplitude if isinstance(amplitude, list) else [amplitude]
    # A stroke is a length, an amplitude a number of presliding lengths: with a unit it can only be half a stroke.
    if amplitudes and all(map(has_unit, amplitudes)) and "stroke" not in path:
        del path["amplitude"]
        strokes = [twice(half_stroke) for half_stroke in amplitudes]
        path["stroke"] = strokes if isinstance(amplitude, list) else strokes[0]
    listed = {word: value for word, value in path.items() if isinstance(value, list) and word in axes()}
    # A word that [axes] has, too, stays in both, where `one_place` refuses it.
    if listed and not listed.keys() & top.get("axes", {}).keys():
        path = {word: value for word, value in path.items() if word not in listed}
        top["axes"] = {**top.get("axes", {}), **listed}
    if "path" in top:
        top["path"] = path


def _load_in_newton(constants: GivenColumns, axes: GivenColumns, scales: Scales) -> float:
    """normal_load of all cases in N; NaN if there are several, or none that is right."""
    if "normal_load" in axes:
        return math.nan
    load: Any = Case.of({}).normal_load
    if "normal_load" in constants:
        load = constants["normal_load"][0].value
    stated = parameters_of_a_case()["normal_load"]
    try:
        number = plain("normal_load", load, stated, scales)
        return make_case({"normal_load": number}).normal_load * scales.force
    except InvalidInput:
        # Refused where [constants] is checked.
        return math.nan


def _single(columns: dict[str, tuple[Value, ...]]) -> dict[str, Value]:
    return {name: values[0] for name, values in columns.items() if values}


def _with_depth(top: Mapping[str, Any], scales: dict[str, Any]) -> dict[str, Any]:
    """Scales with the depth of planes of nodes, which are squares, where none is given and no row of nodes has it, too."""
    axis = top.get("axes", {}).get("scheme")
    scheme = top.get("numerics", {}).get("scheme", axis)
    schemes = scheme if isinstance(scheme, list) else [scheme]
    # Nothing is checked yet: a scheme may be any value of TOML, and one that cannot be hashed is in no mapping.
    if not all(isinstance(name, str) and name in SCHEMES and "y" in SCHEMES[name].LAYOUT.AXES for name in schemes):
        return scales
    width = scales.get("slab_width", Scales().slab_width)
    return {"slab_depth": width, **scales}
