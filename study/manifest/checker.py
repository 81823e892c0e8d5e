"""Check the tables of a campaign file and the files that it names: known words, values in range, declared types."""

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

from nanoslip.solver.case import BY_ROWS, Case, parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import ABSENT, InvalidInput
from nanoslip.solver.parameter import Parameter, declared, require
from nanoslip.solver.slab import LIMITED_BY_SCHEME, SCHEMES
from nanoslip.study.manifest.observables import KEY, Observable, find_function, parse_reference, source_files
from nanoslip.study.manifest.parameters import (
    BETWEEN,
    SMOOTH,
    Alike,
    FileName,
    Value,
    axes,
    compact,
    field_names,
    file_parameters,
    make_case,
    names_by_word,
    plain,
    table_words,
)
from nanoslip.study.manifest.problems import (
    ManifestError,
    Place,
    Problem,
    Problems,
    key_shown,
    repeated_remark,
    suggestion_remark,
    unknown,
)
from nanoslip.study.manifest.surface import NamedSurface, read_surface
from nanoslip.study.measured.columns import FileColumn, decode_text, read_cells, read_columns, unit_factor
from nanoslip.study.toml_text import ONE_LINE, is_one_line, quote_toml


class Given(NamedTuple):
    """A value of a campaign, its key, and the file and table (or line) where it stands."""

    place: Place
    key: str
    value: Any
    allowed: bool = False
    """True if no check is left, as both ends of its range are allowed."""

    def problem(self, need: str) -> Problem:
        """This value, marked as refused."""
        return Problem(self.place, self.key, self.value, need)


GivenColumns = dict[str, list[Given]]
"""Word of a parameter -> its values: values of an axis, of a column of the table, or the single value of a
constant."""


@dataclass(frozen=True, slots=True)
class CaseTable:
    """A CSV file of cases: a header of parameters' words, then one case per line."""

    text: str
    columns: GivenColumns


AS_UTF_8: Final = partial(str, encoding="utf-8-sig")
"""Text from UTF-8, with a mark of its order or without. Raises UnicodeDecodeError."""


def read_text(path: Path, content: str | None = None, decode: Callable[[bytes], str] = AS_UTF_8) -> str:
    """The text of a file, UTF-8 by default, or `content`, the file's text. Raises ManifestError if it cannot be read."""
    if content is not None:
        return content
    if not is_one_line(str(path)):
        raise ManifestError.in_file(path, remark="name of a file", need=ONE_LINE)
    try:
        # A device or a pipe may never end.
        if path.exists() and not path.is_file():
            raise ValueError("not a regular file")
        return decode(path.read_bytes())
    except UnicodeDecodeError as error:
        raise ManifestError.in_file(path, remark=f"byte {error.start}: not UTF-8 text") from None
    except (OSError, ValueError) as error:
        # The text of an OSError alone: its `str` repeats the path and adds a number.
        reason = getattr(error, "strerror", error)
        raise ManifestError.in_file(path, remark=f"cannot be read: {reason}") from None


def read_table(path: Path, content: str | None) -> CaseTable:
    """Read a table of cases from its file, or from `content`, the file's text. Raises ManifestError with one line per problem."""
    text = read_text(path, content, decode_text)
    lines = _lines(path, text)
    if len(lines) < 2:
        raise ManifestError.in_file(path, "a header of parameters and at least one case", f"{len(lines)} lines")
    first_line, first_cells = lines[0]
    header = [word.strip() for word in first_cells]
    # Without any word like a parameter it is some other file, named by mistake: its text is not shown in a message.
    if not any(word in axes() or suggestion_remark(word, axes()) for word in header):
        need = "a header of parameters, as intrinsic_friction,radius"
        raise ManifestError.in_file(path, need, line=first_line)
    problems = _header_problems(path, header)
    need = f"{len(header)}, one for each column"
    for line, row in lines[1:]:
        if len(row) != len(header):
            place = Place(str(path), line)
            problems.append(Problem(place, f"{len(row)} values", need=need))
    if problems:
        raise ManifestError(problems)
    columns: dict[str, list[Given]] = {}
    for position, word in enumerate(header):
        column = []
        for line, row in lines[1:]:
            value = _cell_value(word, row[position].strip())
            column.append(Given(Place(str(path), line), word, value))
        columns[word] = column
    return CaseTable(text, columns)


def _header_problems(path: Path, header: Sequence[str]) -> list[Problem]:
    """A problem for each column of a table of cases that is no parameter, or is there twice."""
    file = Place(str(path))
    problems = []
    for word in header:
        if word not in axes():
            problems.append(Problem(file, f"column {quote_toml(word)}", remark=unknown(word, axes())))
    for word in axes():
        if header.count(word) > 1:
            problems.append(Problem(file, f"column {word}", need="to appear once"))
    return problems


@dataclass(frozen=True, slots=True)
class FileRows:
    """A CSV file that is the value of a parameter: a header, then numbers."""

    text: str
    value: tuple[Any, ...]


def read_rows(word: str, path: Path, content: str | None) -> FileRows:
    """The value of a parameter from its file, or from `content`, its text. Raises ManifestError with a line per problem."""
    text = read_text(path, content, decode_text)
    lines, stated = _lines(path, text), file_parameters()[word]
    header = ",".join(stated.columns)
    first_line, first_cells = lines[0] if lines else (1, [])
    if [cell.strip() for cell in first_cells] != [*stated.columns]:
        raise ManifestError.in_file(path, f"the header {header}", line=first_line)
    needs: dict[int, str] = {}
    good: dict[int, Any] = {}
    for line, cells in lines[1:]:
        row = _numbers(cells)
        if len(row) != len(stated.columns):
            needs[line] = f"finite numbers: {header}"
        elif not all(map(stated.holds, row)):
            needs[line] = stated.need
        else:
            good[line] = row if len(row) > 1 else row[0]
    value = tuple(good.values())
    # Numbers that are valid one by one may be none as a whole: positions that do not increase, or a single point.
    refusal = find_refusal(make_case, {word: value})
    if not value or refusal:
        of_whole: dict[int, str] = {}
        # What no line by itself explains is said at the last one, where the list ends too early.
        if not needs:
            last_line, _ = lines[-1]
            of_whole[last_line] = refusal.need if value and refusal else "numbers below its header"
        needs |= _needs_by_line(word, good) or of_whole
    if needs:
        shown = {line: quote_toml(",".join(cells)) for line, cells in lines}
        problems = []
        for line in sorted(needs):
            place = Place(str(path), line)
            problems.append(Problem(place, shown[line], need=needs[line]))
        raise ManifestError(problems)
    return FileRows(text, value)


def read_legs(path: Path, content: str | None, units: tuple[float, float]) -> FileRows:
    """Points of a path from its file, or from `content`, the file's text. Raises ManifestError.

    Displacements are in L_x and loads over normal_load if the header has no units. units: L_x in m, normal_load in N.
    """
    text = read_text(path, content, decode_text)
    try:
        source = read_columns(path, text)
        places = [source.find_column(name) for name in file_parameters()["legs"].columns]
        rows = source.rows(places)
        # Measured columns may have gaps, where a path that skips a point would go another way.
        if rows.holes or source.left_out.number or source.below:
            raise InvalidInput("legs", ABSENT, "two numbers in each line")
        displacement, load = (source.columns[place] for place in places)
        slab_width, normal_load = units
        scales = [_column_scale(displacement, "m", slab_width), _column_scale(load, "N", normal_load)]
        legs = (rows.values.T * scales).tolist()
        path_of_legs = LoadPath(legs=tuple(map(tuple, legs)))
        return FileRows(text, path_of_legs.legs)
    except InvalidInput as error:
        raise ManifestError.in_file(path, remark=str(error)) from None


def _column_scale(column: FileColumn, unit: str, size: float) -> float:
    """Factor from a column's unit, if it has one, to multiples of a size in this SI unit. Raises InvalidInput."""
    if column.unit in ("", "1", "-"):
        return 1.0
    scale = unit_factor(column.unit, unit)
    require(column.name, column.unit, math.isfinite(scale), f"a unit of {unit}, or none")
    # A size that the campaign does not give, or that differs from case to case, is NaN.
    need = ONE_LOAD if unit == "N" else WIDTH_NEEDED
    require(column.name, column.unit, math.isfinite(size), need)
    return scale / size


WIDTHS_OF_CONTACT: Final = 3.5
"""Half-widths of the contact in the width that is suggested, between three and four: the contact covers 57 % of it."""


def width_needed(half_width: float) -> str:
    """Condition of lengths with a unit. half_width: of the largest contact in m, NaN if unknown."""
    if math.isnan(half_width):
        return WIDTH_NEEDED
    rounded = float(f"{WIDTHS_OF_CONTACT * half_width:.2g}")
    width = compact(rounded, "m")
    return (
        f'slab_width = "{width}" or another beside it (in a file in [scales]), the width L_x that lengths are over: '
        f"that is {WIDTHS_OF_CONTACT:g} half-widths of the largest contact, by Hertz"
    )


WIDTH_NEEDED: Final = (
    'slab_width = "1 mm" or another beside it (in a file in [scales]), the width L_x that lengths are over: '
    "three to four half-widths of the contact"
)
"""Condition of lengths with a unit."""
ONE_LOAD: Final = "one normal_load in [constants], or loads over normal_load"
"""Condition of loads in N along a path."""


def parse_loads(entries: Any, unit: float) -> Any:
    """A list of loads over normal_load from numbers and texts as "50 N". Raises InvalidInput.

    unit: normal_load in N.
    """
    require(
        "load", entries, isinstance(entries, list), "a list of loads along a path; the load on the pin is normal_load"
    )
    in_newton = Parameter("load", unit="N")
    numbers = [plain("load", value, in_newton) for value in entries]
    loads = []
    for value, number in zip(entries, numbers, strict=True):
        # `plain` returns the very value that it is given unless that has a unit: numbers are over normal_load already.
        if value is number:
            loads.append(number)
            continue
        require("load", value, math.isfinite(unit), ONE_LOAD)
        loads.append(number / unit)
    return loads


def _needs_by_line(word: str, values: Mapping[int, Any]) -> dict[int, str]:
    """Line -> what its value needs after the last right one."""
    last: tuple[Any, ...] = ()
    needs = {}
    # Two neighbours decide whether a line is in order: all lines up to each would take the square of their number.
    for line, value in values.items():
        wrong = find_refusal(make_case, {word: (*last, value)}) if last else None
        if wrong:
            needs[line] = wrong.need
        else:
            last = (value,)
    return needs


def _numbers(cells: list[str]) -> tuple[float, ...]:
    """The numbers of a line; none if it has something else."""
    try:
        row = tuple(map(float, cells))
    except ValueError:
        return ()
    # `float` reads nan and inf, too.
    return row if all(map(math.isfinite, row)) else ()


def _lines(path: Path, text: str) -> list[tuple[int, list[str]]]:
    """The non-empty lines of a CSV file as lists of cells, each with its line number."""
    try:
        return read_cells(text)
    except InvalidInput as error:
        raise ManifestError.in_file(path, remark=str(error)) from None


def _cell_value(word: str, cell: str) -> Value | None:
    """Value of a CSV cell; None for an empty scheme setting."""
    # Lines of different schemes share a table: a setting has a column, though not every line has such a scheme.
    if not cell and word in SCHEMES.settings():
        return None
    return number_or_text(cell)


def number_or_text(cell: str) -> Value:
    """A value from its text: `true`, `false`, a number, else the text itself."""
    # As in TOML.
    if cell in ("true", "false"):
        return cell == "true"
    # First a whole number: a count as 129.0 would be another value, with another hash.
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


def find_refusal(make: Callable[..., object], *arguments: object) -> InvalidInput | None:
    """Call `make`; return the InvalidInput that it raises, None if it raises none."""
    try:
        make(*arguments)
    except InvalidInput as error:
        return error
    return None


class SceneSizes(NamedTuple):
    """Sizes of a scene, which values with units are divided by."""

    scales: Scales
    width_given: bool
    """True if the campaign states slab_width: lengths with a unit need it."""
    half_width: float = math.nan
    """Half-width of the largest contact in m, by Hertz, where slab_width is missing; NaN if unknown."""
    load: float = math.nan
    """normal_load in N, which loads of a path are divided by; NaN if cases differ in it."""


Converted = TypeVar("Converted")


def convert_all(entries: Iterable[Given], convert: Callable[[Given], Converted]) -> tuple[list[Converted], Problems]:
    """Convert entries. An entry that `convert` refuses, by InvalidInput or ManifestError, becomes problems instead."""
    good, problems = list[Converted](), Problems()
    for entry in entries:
        try:
            good.append(convert(entry))
        except InvalidInput as error:
            problems.append(entry.problem(error.need))
        except ManifestError as error:
            problems += error.problems
    return good, problems


# Tables: known words, and lists of values.


def check_words(table: str, content: Mapping[str, Any], others: Collection[str] = ()) -> tuple[GivenColumns, Problems]:
    """The entries of a table of parameters, each as a column with one value; unknown words are problems.

    others: keys that the table takes beside parameters, which are read elsewhere.
    """
    good, problems = GivenColumns(), Problems()
    for word, value in content.items():
        if word in table_words(table):
            good[word] = [Given(Place(part=table), word, value)]
        elif word not in others:
            remark = unknown(word, (*table_words(table), *others))
            problems.append(Problem.of(key_shown(word), value, remark=remark, table=table))
    return good, problems


def check_axes(
    table: str, content: Mapping[str, Any], words: Collection[str], repeats: bool = False
) -> tuple[GivenColumns, Problems]:
    """The values of a table's axes; unknown words are problems, entries that are no list of values, and repeated values.

    repeats: whether a value may come again.
    """
    listed, problems = GivenColumns(), Problems()
    for word, values in content.items():
        if word not in words:
            problems.append(Problem.of(key_shown(word), values, remark=unknown(word, words), table=table))
            continue
        if not isinstance(values, list) or not values:
            need = "a list of at least one value"
            # A range is read only where the design says so: the key that is missing is `design`.
            if table == "axes" and isinstance(values, dict):
                need += ', or for a range design = "sobol" or "latin_hypercube"'
            problems.append(Problem.of(key_shown(word), values, need, table=table))
            continue
        entries = [Given(Place(part=table), f"{word}[{index}]", value) for index, value in enumerate(values)]
        if not repeats:
            entries, repeated = _first_entries(entries)
            if repeated:
                problems.append(Problem.of(word, remark=repeated_remark(repeated), table=table))
        listed[word] = entries
    return listed, problems


def _first_entries(entries: Sequence[Given]) -> tuple[list[Given], Collection[Any]]:
    """The first entry of each value as it is written, and the values that appear again."""
    firsts: dict[object, Given] = {}
    repeated: dict[object, Any] = {}
    for entry in entries:
        value = entry.value
        # A list or a table cannot be hashed, and is refused as a value later on. 1 and true are two values.
        is_nested = isinstance(value, list | dict)
        written = entry.key if is_nested else (type(value), value)
        if firsts.setdefault(written, entry) is not entry:
            repeated[written] = value
    return list(firsts.values()), repeated.values()


def check_places(axes: GivenColumns, fixed: Mapping[str, GivenColumns]) -> Problems:
    """Problems of parameters that are given twice: as an axis and in a table."""
    problems = []
    for table, part in fixed.items():
        for word in part:
            if word in axes:
                problems.append(Problem.of(word, need="one place", remark="is an axis too", table=table))
    return problems


# Numbers in place of values with units.


def convert_columns(columns: GivenColumns, sizes: SceneSizes) -> tuple[GivenColumns, Problems]:
    """Columns with multiples of the scene's sizes in place of values with units; invalid ones are problems."""
    numbers, problems = GivenColumns(), Problems()
    for word, entries in columns.items():
        stated = parameters_of_a_case()[names_by_word()[word]]
        numbers[word], wrong = convert_all(entries, partial(_to_sizes, stated, sizes))
        problems += wrong
    return numbers, problems


def _to_sizes(stated: Parameter, sizes: SceneSizes, given: Given) -> Given:
    """An entry with a multiple of the scene's sizes in place of a value with a unit. Raises InvalidInput."""
    if stated.listed:
        return given._replace(value=parse_loads(given.value, sizes.load))
    value = plain(given.key, given.value, stated, sizes.scales)
    # Over the default width a length would be a number that its author never meant.
    had_unit = value is not given.value
    if had_unit and stated.scale == "slab_width" and not sizes.width_given:
        raise InvalidInput(given.key, given.value, width_needed(sizes.half_width))
    return given._replace(value=value)


def convert_to_si(
    where: str, content: Mapping[str, Any], parameters: Mapping[str, Parameter]
) -> tuple[dict[str, Any], Problems]:
    """Entries of a table in SI, with numbers in the units of their keys; invalid ones are problems."""

    def to_si(given: Given) -> Given:
        # An unknown key stays, and is refused with the table: this is about units alone.
        if given.key not in parameters:
            return given
        return given._replace(value=plain(given.key, given.value, parameters[given.key]))

    entries = [Given(Place(part=where), key, value) for key, value in content.items()]
    in_si, problems = convert_all(entries, to_si)
    return {entry.key: entry.value for entry in in_si}, problems


# Values in their declared type.


def check_columns(
    columns: GivenColumns, slabs: Sequence[dict[str, Value]]
) -> tuple[dict[str, tuple[Any, ...]], Problems]:
    """Values in their declared type, by field name. Values out of range are problems, and left out.

    slabs: parameters of the campaign's slabs. What a scheme sets or limits is refused only if it fits none of them.
        None stands for a setting that a line of a table does not give.
    """
    values, problems = dict[str, tuple[Any, ...]](), Problems()
    for word, entries in columns.items():
        name = names_by_word()[word]
        good, wrong = convert_all(entries, _converter(name, slabs))
        values[name] = tuple(good)
        problems += wrong
    return values, problems


def check_entries(
    where: str, content: Mapping[str, Any], make: Any, names: Collection[str] = (), **others: object
) -> tuple[dict[str, Any], Problems]:
    """The entries of a table whose key is among `names` and whose value `make` takes with `others`; all others are problems.

    names: by default the names of the fields of `make`.
    """
    good, problems, names = dict[str, Any](), Problems(), names or field_names(make)
    for key, value in content.items():
        if key not in names:
            problems.append(Problem.of(key_shown(key), value, remark=unknown(key, names), table=where))
            continue
        # Each entry is tried alone, so that one wrong entry hides no other.
        wrong = find_refusal(partial(make, **{**others, key: value}))
        if wrong:
            problems.append(Problem.of(key, value, wrong.need, table=where))
        else:
            good[key] = value
    return good, problems


def is_limited(name: str) -> bool:
    """True if a scheme limits what a parameter may be."""
    return name in (*LIMITED_BY_SCHEME, *BY_ROWS, *SCHEMES.settings())


def _converter(name: str, slabs: Sequence[dict[str, Value]]) -> Callable[[Given], Any]:
    """Function that converts a value of a parameter to its declared type. It raises InvalidInput if no slab takes the value."""
    # A table has millions of values: a case of which all but one parameter is kept takes a fraction of a new one's time.
    alike = Alike({}, (name,)) if name in declared(Case) else None
    limited = is_limited(name)

    def convert(given: Given) -> Any:
        value = given.value
        # Draws of a range are millions, in their type already, and allowed as its ends are.
        if given.allowed or value is None or isinstance(value, FileName):
            return value
        if alike and not limited:
            case = alike.case((value,))
            return getattr(case, name)
        # The refusal of the last slab is the one that is said: a value that suits any of them is valid.
        *others, last = slabs if limited else [{}]
        for slab in others:
            with suppress(InvalidInput):
                return make_case({**slab, name: value}).flat[name]
        return make_case({**last, name: value}).flat[name]

    return convert


# The files that a campaign names: its table of cases, parameters that are files, and sources of observables.

ReadContent = TypeVar("ReadContent")


@dataclass(frozen=True, slots=True)
class NamedFiles:
    """The files that one campaign names, in its folder or as texts."""

    folder: Path
    texts: Mapping[str, str] | None = None
    """Texts of the files by the keys that name them; None if they are read from the folder."""

    def read(
        self, read: Callable[[Path, str | None], ReadContent], key: str, name: str, number: int | None = None
    ) -> ReadContent:
        """Contents of the file of a key, or of its text, one of several. Raises ManifestError."""
        text = None
        if self.texts is not None:
            texts = [self.texts[key]] if key in self.texts else []
            if texts and number is not None:
                texts = texts[0].split(BETWEEN)[number:]
            # A dataset that was cut, or whose attributes somebody changed: reading a file of this name would hide that.
            if not texts:
                raise ManifestError.of(key, remark="the text of its file is missing")
            text = texts[0]
        return read(self.folder / name, text)

    def source(self, name: str, number: int, count: int) -> str:
        """Text of a source, one of several in this order. Raises ManifestError, InvalidInput."""
        file = self.folder / name
        if self.texts is None:
            text = read_text(file)
            # A form feed separates the texts in a dataset: one inside a source would split it where it is read again.
            require(KEY, name, BETWEEN not in text, f"{name} without form feeds")
            return text
        texts = self.texts.get(KEY, "").split(BETWEEN)
        if len(texts) != count:
            raise ManifestError.in_file(file, remark="the text of its file is missing")
        return texts[number]


def read_case_table(files: NamedFiles, top: Mapping[str, Any]) -> tuple[CaseTable | None, Problems]:
    """The table of cases; None if the campaign names none or it is refused."""
    if "table" not in top:
        return None, []
    name = top["table"]
    need = f"to be left out beside table = {quote_toml(name)}"
    problems = [Problem.of(other, need=need) for other in ("axes", "design") if other in top]
    try:
        return files.read(read_table, "table", name), problems
    except ManifestError as error:
        return None, [*problems, *error.problems]


def read_files_of_table(
    files: NamedFiles, content: GivenColumns, sizes: SceneSizes
) -> tuple[GivenColumns, dict[str, str], Problems]:
    """A table with values in place of the files' names, and the texts of these files by word."""
    named = [word for word in file_parameters() if word in content]
    columns = {word: entries for word, entries in content.items() if word not in named}
    texts, problems = dict[str, str](), Problems()
    for word in named:
        entries = content[word]
        all_rows, wrong = convert_all(entries, partial(_read_file, files, sizes))
        problems += wrong
        # A file that is refused leaves no value: its name would be refused once more, as no list of numbers.
        for rows, entry in zip(all_rows, entries, strict=False):
            texts[word] = rows.text
            columns[word] = [entry._replace(value=rows.value)]
    return columns, texts, problems


def read_files_of_axis(
    files: NamedFiles, axes: GivenColumns, sizes: SceneSizes
) -> tuple[GivenColumns, dict[str, str], Problems]:
    """Axes with values behind the names of profiles, and the texts of these files, one after the other."""
    entries = axes.get("roughness", [])
    columns = {word: column for word, column in axes.items() if word != "roughness"}
    if not entries:
        return columns, {}, []
    # A smooth pin has no file: it does not count among the texts that a dataset holds, one after the other.
    with_file = [entry.key for entry in entries if entry.value != SMOOTH]
    texts: dict[str, str] = {}

    def read(entry: Given) -> Given:
        is_smooth = entry.value == SMOOTH
        rows = FileRows("", ()) if is_smooth else _read_file(files, sizes, entry, with_file.index(entry.key))
        name = entry.value["file"] if isinstance(entry.value, dict) else entry.value
        # The name labels the case: the same file in other units would be another case of the same label.
        require(entry.key, entry.value, name not in texts, "a file of its own, whose name the case has")
        texts[name] = rows.text
        label = FileName(name)
        label.content = rows.value
        return entry._replace(value=label)

    labels, problems = convert_all(entries, read)
    if labels:
        columns["roughness"] = labels
    text = BETWEEN.join(text for name, text in texts.items() if name != SMOOTH)
    return columns, {"roughness": text}, problems


def _read_file(files: NamedFiles, sizes: SceneSizes, given: Given, number: int | None = None) -> FileRows:
    """The value of a parameter from its file, on an axis from one of several files. Raises InvalidInput, ManifestError."""
    word, name = given.key.partition("[")[0], given.value
    if word == "roughness" and isinstance(name, dict):
        return _read_profile(files, given, sizes.scales.slab_width, number)
    columns = " and ".join(file_parameters()[word].columns)
    require(given.key, name, isinstance(name, str), f"the path of a CSV file with {columns}")
    if word != "legs":
        return files.read(partial(read_rows, word), word, name, number)
    slab_width = sizes.scales.slab_width if sizes.width_given else math.nan
    return files.read(partial(read_legs, units=(slab_width, sizes.load)), word, name, number)


def _read_profile(files: NamedFiles, given: Given, slab_width: float, number: int | None) -> FileRows:
    """The roughness of a measured profile. Raises ManifestError."""
    where = f"{given.place.part}.{given.key}"
    good, problems = check_entries(where, given.value, NamedSurface)
    if "file" not in good:
        problems.append(given.problem("file, the path of a text file with two columns"))
    # With an entry that was refused the file would be read in units that nobody gave.
    if problems:
        raise ManifestError(problems)

    def read(path: Path, text: str | None) -> FileRows:
        text = read_text(path, text, decode_text)
        try:
            surface = read_surface(path, text, NamedSurface(**good))
            return FileRows(text, surface.roughness(slab_width))
        except InvalidInput as error:
            raise ManifestError.in_file(path, remark=str(error)) from None

    return files.read(read, "roughness", good["file"], number)


def read_observables(files: NamedFiles, references: Sequence[str]) -> tuple[str, tuple[Observable, ...], Problems]:
    """The text of the files of the user's own numbers, and the numbers; refused ones are left out."""
    texts: dict[str, str] = {}
    names = source_files(references)

    def read(given: Given) -> Observable:
        reference = parse_reference(given.value)
        file = reference.file
        try:
            # Several functions of one file: its text is read, and kept in a dataset, once.
            if file not in texts:
                texts[file] = files.source(file, names.index(file), len(names))
        except ManifestError as error:
            need, remark = f"{file} beside this file", error.problems[0].remark
            raise ManifestError([Problem(given.place, given.key, given.value, need, remark)]) from None
        return find_function(reference.name, files.folder / file, texts[file])

    entries = [Given(Place(part="outputs"), KEY, written) for written in references]
    numbers, problems = convert_all(entries, read)
    return BETWEEN.join(texts.values()), tuple(numbers), problems
