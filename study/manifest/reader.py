"""Read and check a campaign file. All problems are reported at once: file, key, value and the allowed values.

Ranges are not repeated here: each value is tried in the solver's types (`Case`, `Slab`, `SlipRule`, `Drive`,
`Scales`). Scales and drives are in SI, the parameters of a case are dimensionless.
"""

import hashlib
import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from nanoslip.solver.case import Case, parameters_of_a_case
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
from nanoslip.solver.parameter import Parameter, as_float, declared, require
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.study.manifest.checker import (
    Given,
    GivenColumns,
    NamedFiles,
    SceneSizes,
    check_axes,
    check_columns,
    check_entries,
    check_places,
    check_words,
    convert_all,
    convert_columns,
    convert_to_si,
    find_refusal,
    read_case_table,
    read_files_of_axis,
    read_files_of_table,
    read_observables,
    read_text,
)
from nanoslip.study.manifest.designs import SAMPLED, sample_axes
from nanoslip.study.manifest.manifest import (
    AXES,
    KNOWABLE,
    MOST_CASES,
    MOST_DRIVEN,
    OF_CONTACTS,
    OTHERS,
    SECONDS_KEY,
    STAGES,
    TASK_SECONDS,
    TOP_LEVEL,
    YOUNG_MODULUS,
    About,
    CampaignDrive,
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
    plain,
    table_taking,
    table_words,
    twice,
    words_by_name,
)
from nanoslip.study.manifest.problems import ManifestError, Problem, Problems, key_shown, unknown
from nanoslip.study.toml_text import ONE_LINE, from_toml, is_one_line, quote_toml

# The drives of a campaign file: its tables [[drives]], each at every point of [drive_axes].

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


def read_drives(top: Mapping[str, Any], scales: Scales) -> tuple[Drives, Problems]:
    """The drives of a campaign file.

    A point whose values exclude each other is a drive with the outcome `invalid`. A table that no point suits is a problem
    of the file, and so is a value that suits no table and no other value.
    """
    axes, of_axes = _read_axes(top.get(AXES, {}))
    tables, of_tables = _read_tables(top, axes)
    problems = [*of_axes, *of_tables]
    # Counted before they are made: axes of a thousand values each would fill the memory before anything was refused.
    count = len(tables) * math.prod(map(len, axes.values()))
    if count > MOST_CASES:
        too_many = Problem.of(AXES, remark=f"{count} drives", need=f"at most {MOST_CASES}")
        return Drives(), [*problems, too_many]
    combinations = itertools.product(*axes.values())
    points = [dict(zip(axes, values, strict=True)) for values in combinations]
    together: list[CampaignDrive] = []
    for table in tables:
        drives = [_make_drive(table, point, scales) for point in points]
        problems += _check_table(table, drives)
        together += drives
    # Without a single valid drive the tables have been refused already: each value would repeat the same reason.
    if any(drive.drive for drive in together):
        problems += _check_values(axes, together)
    return Drives(tuple(together), axes), problems


def _read_tables(top: Mapping[str, Any], axes: Mapping[str, Any]) -> tuple[list[_Table], Problems]:
    tables: dict[str, _Table] = {}
    problems: Problems = []
    for index, content in enumerate(top.get("drives", [])):
        where = f"drives[{index}]"
        if not isinstance(content, dict):
            problems.append(Problem.of(where, content, "a table [[drives]]"))
            continue
        twice_given = [key for key in content if key in axes]
        for key in twice_given:
            problems.append(Problem.of(key, need="one place", remark=f"is in [{AXES}] too", table=where))
        entries = {key: value for key, value in content.items() if key not in twice_given}
        table, wrong = _read_table(where, {"name": DEFAULT, **entries})
        problems += wrong
        # The name is a coordinate of the dataset: two drives of one name could not be told apart there.
        if table.name in tables:
            problems.append(Problem.of("name", table.name, "its own", "is another drive's name too", where))
        tables[table.name] = table
    # Axes alone vary the paper's drive: a table without any entry would say no more.
    if axes and not top.get("drives"):
        return [_Table(AXES, DEFAULT, {})], problems
    return list(tables.values()), problems


def _read_table(where: str, written: Mapping[str, Any]) -> tuple[_Table, Problems]:
    content, problems = convert_to_si(where, written, drive_parameters())
    # Valid time steps depend on other keys, so integrators are checked last, with every valid key.
    of_integrators = (INTEGRATORS.word, *INTEGRATORS.settings())
    last = {key: content[key] for key in of_integrators if key in content}
    alone = {key: value for key, value in content.items() if key not in last}
    allowed = ("name", *drive_parameters())
    good, of_entries = check_entries(where, alone, NamedDrive.of, allowed, name="-")
    problems += of_entries
    for key, value in last.items():
        wrong = find_refusal(_drive_value, key, value)
        if wrong:
            problems.append(Problem.of(key, value, wrong.need, table=where))
        else:
            good[key] = value
    # Of a table whose entries are all valid, `_make_drive` refuses two lengths, with all of the table at hand.
    two_lengths = find_refusal(only_length, alone)
    if two_lengths and alone.keys() - good.keys():
        problems.append(Problem.of(two_lengths.key, two_lengths.value, two_lengths.need, table=where))
    name = good.pop("name", "-")
    return _Table(where, name, good), problems


def _read_axes(content: Mapping[str, Any]) -> tuple[dict[str, tuple[Value, ...]], Problems]:
    """Known axes with their valid values, in their declared type."""
    listed, problems = check_axes(AXES, content, drive_parameters())
    axes: dict[str, tuple[Value, ...]] = {}
    for key, entries in listed.items():
        in_si, of_units = convert_all(entries, partial(_to_si, drive_parameters()[key]))
        typed, of_values = convert_all(in_si, partial(_to_declared_type, key))
        problems += of_units + of_values
        firsts: dict[Value, Given] = {}
        # Values that are written differently may be equal once they are converted, as 1 and 1.0, or "1 mm/s" and 1e-3.
        for entry in typed:
            if firsts.setdefault(entry.value, entry) is not entry:
                problems.append(Problem(entry.place, entry.key, entry.value, "each value once", "is there twice"))
        # An axis whose values are all refused is left out: with no value it would have no point, and hide other problems.
        if firsts:
            axes[key] = tuple(firsts)
    return axes, problems


def _to_si(stated: Parameter, given: Given) -> Given:
    return given._replace(value=plain(given.key, given.value, stated))


def _to_declared_type(key: str, given: Given) -> Given:
    return given._replace(value=_drive_value(key, given.value))


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


def _check_table(table: _Table, drives: Sequence[CampaignDrive]) -> Problems:
    """The problem of a table of which no drive is valid: that of its first one."""
    first = drives[0]
    wrong = first.refused
    if wrong is None or any(drive.drive for drive in drives):
        return []
    where = AXES if wrong.key in first.point else table.where
    return [Problem.of(wrong.key, wrong.value, wrong.need, table=where)]


def _check_values(axes: Mapping[str, tuple[Value, ...]], drives: Sequence[CampaignDrive]) -> Problems:
    """Problems of values with which no drive is valid."""
    problems = []
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
            # The need of another key would read as if this value needed it: the whole sentence names that key.
            need, remark = (wrong.need, "") if wrong.key == name else ("", str(wrong))
            problems.append(Problem.of(f"{name}[{index}]", value, need, remark, AXES))
    return problems


def load_manifest(path: Path) -> Manifest:
    """Read a campaign file and the files it names. Raises ManifestError with all problems."""
    return _read_manifest(path, read_text(path), NamedFiles(path.parent))


def parse_manifest(path: Path, text: str, beside: Mapping[str, str]) -> Manifest:
    """Parse a manifest from texts, without reading any file. Raises ManifestError with all problems.

    path: name of the campaign file for messages. beside: texts of the files that it names, by the keys that name them
    (nanoslip.study.manifest.parameters.FILE_KEYS).
    """
    return _read_manifest(path, text, NamedFiles(path.parent, beside))


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


def goes_to_and_fro(top: Mapping[str, Any]) -> bool:
    """True if the stage of all drives of a campaign's content has a stroke."""
    if "stage_stroke" in top.get(AXES, {}):
        return True
    # Without a table there is the default drive, which has no stroke.
    tables = top.get("drives") or [{}]
    return all(isinstance(table, dict) and "stage_stroke" in table for table in tables)


def _read_ensemble(top: Mapping[str, Any], stages: tuple[Stage, ...], tractions: bool) -> tuple[Ensemble, Problems]:
    """The ensemble of every case."""
    entries, content = top.get("ensemble", {}), top.get("target")
    valid, problems = check_entries("ensemble", entries, EnsembleTable)
    table = EnsembleTable(**valid)
    if content is None:
        return Ensemble(table.members, places=table.places), problems
    if "members" in entries:
        need = "to be left out beside [target], which decides their number; the most are target.most"
        problems.append(Problem.of("members", entries["members"], need, table="ensemble"))
    if "within" not in content:
        problems.append(Problem.of("[target]", need="within = 0.01, or another relative error"))
    # `within` has no default, so each other entry is tried beside a valid one: a wrong `of` is refused for itself.
    good, of_target = check_entries("target", content, TargetTable, within=0.5)
    problems += of_target
    for name in good.get("of", ()):
        need = _need_of_target(name, stages, tractions)
        if need:
            problems.append(Problem.of("of", name, need, table="target"))
    target = TargetTable(**{"within": 0.5, **good})
    variables = target.variables(stages[-1], to_and_fro=goes_to_and_fro(top))
    # Drives share records: with a target of their own alone each drive would slide further records by itself.
    if "dynamics" in map(KNOWABLE.get, variables):
        variables = tuple(dict.fromkeys(("plateau_mean", *variables)))
    return Ensemble(target.most, float(target.within), variables, table.places), problems


def _need_of_target(name: str, stages: tuple[Stage, ...], tractions: bool) -> str:
    """Stage or output without which a campaign has no such variable; empty if it has it."""
    stage = KNOWABLE[name]
    if STAGES.index(stage) > STAGES.index(stages[-1]):
        bringing = ", which a [[drives]] table brings" if stage == "dynamics" else ""
        return f'stage "{stage}"{bringing}: without it there is no {name}'
    # A record starts from the initial contact but keeps none of it; a campaign that slides computes it only to show it.
    if name in OF_CONTACTS and "slip" in stages and not tractions:
        return 'stages = ["contact"] or outputs.tractions = true: else no contact is kept beside the record'
    return ""


PARTS: Final = "split an axis over several campaigns, and join their datasets by nanoslip.concat"
"""Advice on a campaign of too many cases."""


def _need_of_title(title: str) -> str:
    """Allowed titles; empty for a valid title."""
    if len(title) > LONGEST_MESSAGE:
        return f"at most {LONGEST_MESSAGE} characters"
    return "" if is_one_line(title) else ONE_LINE


class _Scene(NamedTuple):
    """The parameters of a campaign's cases: numbers in units of its scales, and values of the files that it names."""

    scales: Scales
    columns: GivenColumns
    """Columns of the table of cases, or axes."""
    fixed: dict[str, GivenColumns]
    """Table -> its parameters, equal for all cases."""
    files: dict[str, str]
    """Texts of the files, by the keys that name them."""


# Each step returns its value and the problems that it has found: document, tables, numbers in units of the scales, values
# in their declared type, manifest.


def _read_manifest(path: Path, text: str, files: NamedFiles) -> Manifest:
    top, of_top = _check_top(_document(path, text))
    seconds, of_seconds = _read_task_seconds(top)
    scene, of_scene = _read_scene(top, files)
    slabs = _slabs({**scene.fixed["numerics"], **scene.columns})
    stages, of_stages = _read_stages(top)
    outputs, of_outputs = _read_outputs(top.get("outputs", {}), stages)
    texts, own_numbers, of_numbers = _read_own_numbers(files, outputs, stages)
    # Drives are checked even where the stages leave them out: their mistakes would show only once they are switched on.
    written, of_drives = read_drives(top, scene.scales)
    pulled = written if "dynamics" in stages else Drives()
    names = tuple(dict.fromkeys(drive.name for drive in written.drives))
    design, of_design = _read_design(top, scene.columns)
    axes, of_axes = check_columns(scene.columns, slabs)
    tables, of_tables = _check_tables(scene.fixed, slabs)
    ensemble, of_ensemble = _read_ensemble(top, stages, outputs.tractions)
    about, of_about = check_entries("about", top.get("about", {}), About)
    texts = {**scene.files, **texts}
    result = Manifest(
        path=path,
        text=text,
        files=texts,
        sha256=manifest_hash(text, texts),
        title=top.get("title", ""),
        stages=stages,
        design=design,
        axes=axes,
        tables=tables,
        task_seconds=seconds,
        scales=scene.scales,
        drives=pulled.drives,
        drive_axes=pulled.axes,
        drives_left_out=() if pulled.drives else names,
        outputs=outputs,
        ensemble=ensemble,
        about=About(**about),
        observables=own_numbers,
    )
    problems = of_top + of_seconds + of_scene + of_stages + of_outputs + of_numbers
    problems += of_drives + of_design + of_axes + of_tables + of_ensemble + of_about
    problems += _check_counts(result) + _check_path(top, result)
    if problems:
        raise ManifestError(problems).name_file(path)
    return result


def _check_top(document: Mapping[str, Any]) -> tuple[dict[str, Any], Problems]:
    """Top-level entries of the file with a known key and the right type; all others are problems."""
    good, problems = dict[str, Any](), Problems()
    for key, value in document.items():
        kind, wanted = TOP_LEVEL.get(key, (object, ""))
        if not wanted:
            problems.append(Problem.of(key_shown(key), value, remark=unknown(key, TOP_LEVEL)))
        elif not isinstance(value, kind):
            problems.append(Problem.of(key, value, wanted))
        elif key == "title" and (need := _need_of_title(str(value))):
            problems.append(Problem.of(key, value, need))
        else:
            good[key] = value
    if "title" not in document:
        problems.append(Problem.of("title", None, "a text"))
    return good, problems


def _read_task_seconds(top: Mapping[str, Any]) -> tuple[float | None, Problems]:
    """The time that a task may take, a key of [limits] beside parameters of cases."""
    if SECONDS_KEY not in top.get("limits", {}):
        return None, []
    seconds = top["limits"][SECONDS_KEY]
    # `true` is a whole number to Python, but no time.
    is_number = isinstance(seconds, int | float) and not isinstance(seconds, bool)
    if not is_number or not TASK_SECONDS.holds(seconds):
        return None, [Problem.of(SECONDS_KEY, seconds, TASK_SECONDS.need, table="limits")]
    return float(seconds), []


def _read_scene(written: Mapping[str, Any], files: NamedFiles) -> tuple[_Scene, Problems]:
    table, of_table = read_case_table(files, written)
    # Scales come first: a value with a unit, in any table or on any axis, becomes a multiple of one.
    scales, of_scales = _read_scales(written, table.columns if table else ())
    width_given = "slab_width" in written.get("scales", {})
    half_width = math.nan if width_given else largest_half_width(written, scales)
    sizes = SceneSizes(scales, width_given, half_width)
    top = _spread_path(written)
    columns, of_columns = convert_columns(table.columns, sizes) if table else _read_case_axes(top, sizes)
    problems = of_table + of_scales + of_columns
    words: dict[str, GivenColumns] = {}
    for name in TABLES:
        words[name], of_words = check_words(name, top.get(name, {}), OTHERS.get(name, ()))
        problems += of_words
    # Loads of a path may be in N: they are over normal_load, which is thus read before the path.
    load = _load_in_newton(words["constants"], columns, scales)
    sizes = sizes._replace(load=load)
    fixed: dict[str, GivenColumns] = {}
    for name, content in words.items():
        fixed[name], of_units = convert_columns(content, sizes)
        problems += of_units
    texts = {"table": table.text} if table else {}
    # A table of cases excludes axes, hence there is no profile on an axis beside it.
    if not table:
        columns, texts, of_axis = read_files_of_axis(files, columns, sizes)
        problems += of_axis
    for name, content in fixed.items():
        fixed[name], of_content, of_files = read_files_of_table(files, content, sizes)
        texts |= of_content
        problems += of_files
    problems += check_places(columns, fixed)
    return _Scene(scales, columns, fixed, texts), problems


def _read_scales(top: Mapping[str, Any], columns: Collection[str]) -> tuple[Scales, Problems]:
    """Read the scales. `young_modulus` replaces the shear modulus, E/(2(1 + ν)), with the campaign's one Poisson's
    ratio.

    columns: of its table of cases.
    """
    parameters = {**declared(Scales), YOUNG: YOUNG_MODULUS}
    content, problems = convert_to_si("scales", top.get("scales", {}), parameters)
    if YOUNG in content:
        modulus = content.pop(YOUNG)
        poisson = top.get("constants", {}).get("poisson", Slab().poisson)
        # G = E/(2(1 + ν)) is one scale of all cases: with several ν each case would have another.
        varied = {*top.get("axes", {}), *columns}
        no_modulus = find_refusal(as_float, YOUNG, modulus)
        no_ratio = find_refusal(as_float, "poisson", poisson)
        if "shear_modulus" in content or "poisson" in varied:
            need = "one Poisson's ratio, and no shear_modulus beside it"
            problems.append(Problem.of(YOUNG, modulus, need, table="scales"))
        elif no_modulus:
            problems.append(Problem.of(YOUNG, modulus, no_modulus.need, table="scales"))
        # A wrong ratio is refused in its own table: one problem is said once.
        elif not no_ratio and parameters_of_a_case()["poisson"].holds(poisson):
            content["shear_modulus"] = modulus / (2.0 * (1.0 + poisson))
    valid, of_entries = check_entries("scales", _with_depth(top, content), Scales)
    return Scales(**valid), problems + of_entries


def _check_tables(
    fixed: Mapping[str, GivenColumns], slabs: Sequence[dict[str, Value]]
) -> tuple[dict[str, dict[str, Value]], Problems]:
    """Table -> its parameters in their declared type."""
    tables, problems = dict[str, dict[str, Value]](), Problems()
    for table, content in fixed.items():
        columns, wrong = check_columns(content, slabs)
        tables[table] = {name: values[0] for name, values in columns.items() if values}
        problems += wrong
    return tables, problems


def _read_stages(top: Mapping[str, Any]) -> tuple[tuple[Stage, ...], Problems]:
    # Who writes down a drive wants it pulled, without having to list the stages.
    usual = STAGES if "drives" in top or AXES in top else STAGES[:2]
    names = top.get("stages", list(usual))
    if not names or names != list(STAGES[: len(names)]):
        wrong = Problem.of("stages", names, f"{TOP_LEVEL['stages'][1]}: each stage needs the ones before it")
        # Reading goes on with the last stage that is named, or all, so that no other key is refused for this mistake.
        counts = [number for number, stage in enumerate(STAGES, 1) if stage in names]
        return STAGES[: max(counts, default=3)], [wrong]
    stages = STAGES[: len(names)]
    if "dynamics" in names and not (top.get("drives") or top.get(AXES)):
        missing = Problem.of("drives", None, f'at least one [[drives]] or [{AXES}], for stage "dynamics"')
        return stages, [missing]
    return stages, []


def _read_outputs(content: Mapping[str, Any], stages: tuple[Stage, ...]) -> tuple[Outputs, Problems]:
    good, problems = check_entries("outputs", content, Outputs)
    # Tractions are all that a campaign of contacts has to show; phases are parts of the motion that is kept.
    usual = {"tractions": "slip" not in stages, "phases": good.get("trajectory", True)}
    outputs = Outputs(**{**usual, **good})
    if "slip" in stages:
        return outputs, problems
    if outputs.statistics:
        need = 'stage "slip": without it there are no events'
        problems.append(Problem.of("statistics", True, need, table="outputs"))
    # Event 0 is initial contact, which there is without a record.
    if any(outputs.tractions_at):
        need = 'stage "slip" for the events after 0'
        problems.append(Problem.of("tractions_at", outputs.tractions_at, need, table="outputs"))
    return outputs, problems


def _read_own_numbers(
    files: NamedFiles, outputs: Outputs, stages: tuple[Stage, ...]
) -> tuple[dict[str, str], tuple[Observable, ...], Problems]:
    """Numbers by the user's functions, and the text of the functions' files by its key."""
    if not outputs.observables:
        return {}, (), []
    text, own_numbers, problems = read_observables(files, outputs.observables)
    for observable in own_numbers:
        need = stage_need(observable, stages)
        if need:
            problems.append(Problem.of(KEY, observable.reference, need, table="outputs"))
    return {KEY: text}, own_numbers, problems


def _read_design(top: Mapping[str, Any], axes: GivenColumns) -> tuple[Design, Problems]:
    if "table" in top:
        return "table", []
    design: Design = top.get("design", "product")
    lengths = {word: len(values) for word, values in axes.items()}
    # Keys that this design would not read: left in silence, they would be taken to have had an effect.
    idle = sorted({"points", "design_seed"} & top.keys())
    problems = []
    if design not in ("product", "zip", *SAMPLED):
        need = f'{TOP_LEVEL["design"][1]}, or a table = "cases.csv" instead'
        problems.append(Problem.of("design", design, need))
    elif design not in SAMPLED and idle:
        sampled = " or ".join(map(quote_toml, SAMPLED))
        problems.append(Problem.of(idle[0], need=f"design = {sampled}"))
    elif design == "zip" and len(set(lengths.values())) != 1:
        counts = ", ".join(f"{count} of {word}" for word, count in lengths.items())
        need = f"axes of equal length, got {counts or 'no axes'}"
        problems.append(Problem.of("design", design, need))
    return design, problems


def _check_counts(manifest: Manifest) -> Problems:
    """The problem of more cases, or drives of cases, than fit a machine: nothing has been expanded yet."""
    cases, drives = manifest.case_count, len(manifest.drives)
    if cases > MOST_CASES:
        return [Problem.of(f"{cases} cases", need=f"at most {MOST_CASES}; {PARTS}")]
    if cases * drives > MOST_DRIVEN:
        need = f"at most {MOST_DRIVEN} drives in all; {PARTS}"
        return [Problem.of(f"{cases} cases with {drives} drives each", need=need)]
    return []


def _check_path(top: Mapping[str, Any], manifest: Manifest) -> Problems:
    """Problems of settings that a path of pin and load excludes in all cases."""
    if not manifest.paths:
        return []
    problems = []
    if "slip" not in manifest.stages:
        need = 'stage "slip", in which the pin goes along [path]'
        problems.append(Problem.of("stages", list(manifest.stages), need))
    if "target" in top:
        problems.append(Problem.of("[target]", need="[ensemble] members: numbers of a [path] have no target"))
    of_paths = declared(LoadPath)
    first_path = {name: values[0] for name, values in manifest.axes.items() if name in of_paths and values}
    # What excludes a path excludes every path: one of the campaign's is enough to find it in the fixed settings.
    wrong = find_refusal(make_case, {**manifest.fixed, **first_path})
    if wrong and wrong.key == "path":
        for name, value in wrong.beside.items():
            word = words_by_name()[name]
            problems.append(Problem.of(word, value, f"{wrong.need}, beside [path]", table=table_taking(word)))
    return problems


def _read_case_axes(top: Mapping[str, Any], sizes: SceneSizes) -> tuple[GivenColumns, Problems]:
    if top.get("design") in SAMPLED:
        return sample_axes(top, sizes)
    # Position by position (zip) a value may come again; in a product it would make the same cases twice.
    repeats = top.get("design", "product") != "product"
    listed, problems = check_axes("axes", top.get("axes", {}), axes(), repeats)
    columns, of_units = convert_columns(listed, sizes)
    return columns, problems + of_units


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


def _spread_path(top: Mapping[str, Any]) -> dict[str, Any]:
    """Content in which an amplitude with a unit is the `stroke` twice as long, and lists in [path] are axes."""
    path = dict(top.get("path", {}))
    amplitude = path.get("amplitude", 0.0)
    amplitudes = amplitude if isinstance(amplitude, list) else [amplitude]
    # A stroke is a length, an amplitude a number of presliding lengths: with a unit it can only be half a stroke.
    if amplitudes and all(map(has_unit, amplitudes)) and "stroke" not in path:
        del path["amplitude"]
        strokes = [twice(half_stroke) for half_stroke in amplitudes]
        path["stroke"] = strokes if isinstance(amplitude, list) else strokes[0]
    can_vary = {*table_words("path")} & {*axes()}
    listed = {word: value for word, value in path.items() if isinstance(value, list) and word in can_vary}
    # A word that [axes] has, too, stays in both, where `check_places` refuses it.
    if not listed or listed.keys() & top.get("axes", {}).keys():
        return {**top, "path": path}
    fixed = {word: value for word, value in path.items() if word not in listed}
    return {**top, "path": fixed, "axes": {**top.get("axes", {}), **listed}}


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
