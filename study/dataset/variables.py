"""Every variable of a dataset: name, meaning, unit; runs of different length as ragged groups.

The solver declares variables of results (nanoslip.solver.parameter); this file adds variables of the dataset itself.
Lengths are in L_x, stiffness in G·L_y, forces over the load W; trajectories of drives are in SI.
"""

import difflib
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import chain
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import SHARED_ERROR, Parameter, Quantity, measure_label, quantities
from nanoslip.solver.sliding.sizes import EventSizes
from nanoslip.solver.sliding.validity import FLAGS, Validity
from nanoslip.solver.view import ROUNDING
from nanoslip.study.manifest.manifest import Manifest, NamedDrive, drive_parameters
from nanoslip.study.manifest.observables import KEY
from nanoslip.study.manifest.parameters import UNITS, spellings, with_symbol
from nanoslip.study.manifest.problems import ManifestError, Place, Problem
from nanoslip.study.origin import Origin
from nanoslip.study.tasks.kind import (
    KINDS,
    MEMBER,
    own_quantity,
    result_quantities,
)
from nanoslip.study.tasks.task import PENDING


def scalars(kind: str) -> list[tuple[str, Quantity]]:
    """Scalars of a kind's results with their variables over the cases (and drives); then variables in SI or over
    μ_i."""
    quantities = result_quantities(KINDS[kind]).items()
    return [*quantities, *((key, quantity.si) for key, quantity in quantities if quantity.si)]


@dataclass(frozen=True, slots=True)
class Series:
    """Columns of results of the same kind: CF contiguous ragged arrays over `sample`, with a run for each instance of
    a group."""

    kind: str
    sample: str
    """The dimension of the values."""
    count: Quantity
    """Over the instances: the length of each run."""
    wanted: Callable[[Manifest], bool]
    columns: Mapping[str, Quantity]


@dataclass(frozen=True, slots=True)
class Group:
    """A group of a dataset: runs of a single series or several. Its name is also the name of its instances'
    dimension."""

    name: str
    series: tuple[Series, ...]

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds of task whose results it holds, in the order of their stages."""
        return tuple(dict.fromkeys(series.kind for series in self.series))

    @property
    def driven(self) -> bool:
        """True if its instances belong to cases and drives."""
        return DRIVE in self.kinds

    @property
    def samples(self) -> dict[str, tuple[Series, ...]]:
        """Sample dimension -> the series over it."""
        samples: dict[str, tuple[Series, ...]] = {}
        for series in self.series:
            earlier = samples.get(series.sample, ())
            samples[series.sample] = (*earlier, series)
        return samples

    @property
    def columns(self) -> dict[str, Quantity]:
        """Every variable over a sample dimension, once, by name."""
        columns = (series.columns.values() for series in self.series)
        return {quantity.name: quantity for quantity in chain.from_iterable(columns)}

    @property
    def id(self) -> Quantity:
        """Over the cases: which instance is theirs."""
        comment = f"along {self.name} in the group {self.name}; empty where the case has none"
        return Quantity(f"{self.name}_id", f"name of its {self.name}", "", comment=comment)

    @property
    def label(self) -> Quantity:
        """Over the instances: their names."""
        comment = "content hash of its inputs"
        if self.of_first_member:
            comment += "; runs are those of the first member: nanoslip.records computes the records of all"
        return Quantity(self.name, f"name of the {self.name}", "", comment=comment)

    @property
    def of_first_member(self) -> bool:
        """True if an ensemble stores runs of its first member only."""
        return not any(series.sample == MEMBER or series.kind == "statistics" for series in self.series)

    @property
    def owners(self) -> tuple[Quantity, ...]:
        """Variables over the instances: the case of each, and for drives the drive. A shared instance has the first
        case that shares it."""
        return (CASE_ID, DRIVE_NAME) if self.driven else (CASE_ID,)


DRIVE: Final = "drive"
"""The kind of task whose results lie over the drives too."""
CASE_ID: Final = Quantity("case_id", "content hash of the case's parameters", "")
DRIVE_NAME: Final = Quantity("drive", "name of the drive", "")


def all_groups() -> dict[str, Group]:
    """Every group of runs that a dataset can have, by name."""
    series_by_group: dict[str, list[Series]] = {name: [] for name in _ORDER}
    for kind in KINDS.values():
        for ragged in kind.ragged:
            count = Quantity(ragged.count, f"values of each {ragged.instance}")
            columns = result_quantities(kind, ragged.sample)
            series = Series(kind.name, ragged.sample, count, ragged.wanted, columns)
            series_by_group[ragged.instance].append(series)
    return {name: Group(name, tuple(series)) for name, series in series_by_group.items()}


# A dataset shows the numbers of all members before the runs of the first one.
_ORDER: Final = (
    "ensemble",
    "path_ensemble",
    "drive_ensemble",
    "record",
    "path",
    "event_sizes",
    "trajectory",
    "contact",
    "interior",
)


@cache
def run_names() -> set[str]:
    """The variables over the cases that name their runs."""
    return {group.id.name for group in all_groups().values()}


EVENT_DROP: Final = quantities(EventSizes)["drop"]
"""Column that `.record` and `.events` have beside the columns of the file."""
VALIDITY = quantities(Validity)["validity_flags"]
ADVICE = Quantity("advice", "advice on validity_flags", "", comment="empty if there is none")
_ENDINGS: Final = (PENDING, *Ending)
_BY_NAME: Final = "name of the entry in the group software; empty until computed"


class OutcomeVariables(NamedTuple):
    """Variables of the ending of cases, or of their drives."""

    ending: Quantity
    message: Quantity
    cause: Quantity
    """The fact in the message."""
    computed_by: Quantity
    """The software of a result and of its inputs."""


OUTCOMES: Final = {
    "": OutcomeVariables(
        Quantity("outcome", "how the case ended", "", codes=_ENDINGS),
        Quantity("message", "reason of the outcome", "", comment="with advice"),
        Quantity(
            "cause",
            "cause of the outcome",
            "",
            comment="the same for messages that differ only in their values; or empty",
        ),
        Quantity("computed_by", "software that computed the case", "", comment=_BY_NAME),
    ),
    DRIVE: OutcomeVariables(
        Quantity("drive_outcome", "how the dynamic stage ended", "", codes=_ENDINGS),
        Quantity("drive_message", "reason of drive_outcome", "", comment="with advice"),
        Quantity("drive_cause", "cause of drive_outcome", "", comment="as for cause"),
        Quantity("drive_computed_by", "software of the dynamic stage", "", comment=_BY_NAME),
    ),
}
"""Variables of the ending, by kind of task ("": all before the drives)."""

_ERRORS: Final = "errors of one's own functions"
OWN_MESSAGES: Final = {
    "observables": Quantity("observables_message", _ERRORS, "", comment="numbers of the record; empty if none failed"),
    "drive_observables": Quantity(
        "drive_observables_message", _ERRORS, "", comment="numbers of the drive; empty if none failed"
    ),
}
"""Kind of task -> variable with the errors of functions that failed."""

MEMBERS: Final = Quantity(
    "members", "members computed", comment="independent starts of the case; means are over members with a value"
)
DRIVE_MEMBERS: Final = Quantity("drive_members", "members that were driven", comment="as members")

SOFTWARE: Final = (
    Quantity("software", "name of the software", "", comment="hash of its description"),
    Quantity("software_results", "results computed by the software", comment="of cases and of their drives"),
    *(Quantity(f"software_{item.name}", f"{item.name} of the software", "") for item in fields(Origin)),
)
"""The software that computed the results: its name, how many results, and every fact of it."""


def parameters() -> dict[str, Quantity]:
    """The coordinates of a dataset by name: every parameter of cases and drives but files."""
    stated = {**parameters_of_a_case(), **drive_parameters()}
    coordinates = {}
    for name, parameter in stated.items():
        # A list or a file is no label.
        if not (parameter.columns or parameter.listed):
            coordinates[name] = _coordinate(name, parameter)
    return coordinates


def _coordinate(name: str, parameter: Parameter) -> Quantity:
    meaning, symbol, comment = parameter.meaning, parameter.symbol, parameter.comment
    return Quantity(name, meaning, parameter.unit, measure=parameter.measure, symbol=symbol, comment=comment)


SI: Final = "_si"
"""Suffix of a variable's name for its size in SI."""
MEASURES: Final = {
    "L_x": "m",
    "G": "Pa",
    "G·L_y": "N m-1",
    "G·L_x·L_y": "N",
    "W·L_x": "J",
    "W/(L_x·L_y)": "Pa",
}
"""Measure of a variable -> unit of its size in SI."""
PREFIXED: Final = frozenset({"m", "s", "m s-1", "N", "N m-1", "N s-1", "Pa", "J", "W", "kg", "Hz"})
"""Units that people write with prefixes."""


@cache
def si_coordinates() -> dict[str, Quantity]:
    """Parameter of a case -> the coordinate that has it in SI, of campaigns that give scales."""
    twins = {}
    for name, parameter in parameters_of_a_case().items():
        if parameter.scale in UNITS and not parameter.columns:
            symbol, _, _ = parameter.symbol.partition("/")
            comment = f"{name} times its scale"
            unit = UNITS[parameter.scale]
            twins[name] = Quantity(f"{name}{SI}", parameter.meaning, unit, symbol=symbol, comment=comment)
    return twins


def factors(case: Case, scales: Scales, drive: NamedDrive | None) -> dict[str, float]:
    """`Quantity.per` -> factor of a value in the solver's units: to shares of W or μ_i, or to SI."""
    friction = case.intrinsic_friction
    # Without friction, and with friction that nothing overcomes, a share of μ_i means nothing.
    over_friction = 1.0 / friction if 0.0 < friction < np.inf else np.nan
    return {
        "": 1.0,
        "normal_load": 1.0 / case.total_load,
        "contact_load": 1.0 / case.normal_load,
        "intrinsic_friction": over_friction,
        **scales.units(drive.pin_mass if drive else 1.0),
    }


# Every variable that a dataset can have, from the declarations: rows, and one variable in full.

CASES = "cases"
"""Placeholder for the dimensions of the cases."""


@dataclass(frozen=True, slots=True)
class Described:
    """One variable of a dataset."""

    name: str
    group: str
    """Group that it belongs to."""
    dims: str
    """Dimensions; `cases` are the dimensions of the cases."""
    units: str
    measure: str
    """Unit of a number without SI unit; empty of pure numbers."""
    meaning: str
    """Short enough for the label of an axis."""
    symbol: str
    """Symbol in equations; empty if it has none."""
    uncertainty: str
    """Variable with the uncertainty of this one; empty if there is none."""
    comment: str
    values: tuple[str, ...]
    """Names of its bits, meanings of its numbers from 0 on, or the texts that it can hold; empty if it is any number."""


def rows() -> list[Described]:
    """All variables, group by group, each name once in the root and once in each group."""
    described_by_place: dict[tuple[str, str], Described] = {}
    # All groups within the root are one group of names.
    for described in _all():
        group = described.group if described.group.startswith(_GROUP) else ""
        described_by_place.setdefault((group, described.name), described)
    return list(described_by_place.values())


def describe(name: str) -> Described:
    """Describe a variable, also an uncertainty or another variable beside a mean.

    name: the variable's name (also without `_mean`), or its symbol, Greek or Latin. Raises KeyError that names the
        nearest variables.
    """
    if name in variables_by_name():
        return variables_by_name()[name]
    if size := describe_size(name):
        return size
    names = list(dict.fromkeys(described.name for described in rows()))
    if matches := find_variables(names, name):
        return variables_by_name()[matches[0]]
    # In reverse, as `variables_by_name` is: of two variables with one spelling the first has it.
    spelt = spellings(_symbols(names[::-1]))
    words = {word: name for name, spelling in spelt.items() for word in spelling}
    words |= {name: name for name in names}
    close = difflib.get_close_matches(name, words, n=3, cutoff=0.5)
    # Two near spellings may be of one variable.
    near = dict.fromkeys(words[word] for word in close)
    raise KeyError(f"{name}: no variable of a dataset" + (f"; nearest: {', '.join(near)}" if near else ""))


def find_variables(names: Sequence[str], word: str) -> list[str]:
    """The variables of these names that a word means, by the first rule that finds any."""
    if word in names:
        return [word]
    by_symbol = with_symbol(word, _symbols(names))
    return by_symbol or [name for name in names if name == f"{word}_mean"]


def _symbols(names: Sequence[str]) -> dict[str, str]:
    declared = variables_by_name()
    # A fitted coefficient has the symbol of what it fits, which is meant by it.
    plain = [name for name in names if name in declared and not name.startswith("fitted_")]
    return {name: declared[name].symbol for name in plain}


def describe_size(name: str) -> Described | None:
    """Describe the size in SI of a variable, by its name with `_si`; None if there is no such variable."""
    described = variables_by_name().get(name.removesuffix(SI))
    if described is None or not name.endswith(SI) or described.measure not in MEASURES:
        return None
    unit = MEASURES[described.measure]
    symbol, _, _ = described.symbol.partition("/")
    comment = f"{described.name} times its scale, of campaigns that give scales"
    return replace(described, name=name, units=unit, measure="", symbol=symbol, comment=comment)


@cache
def variables_by_name() -> dict[str, Described]:
    """Every variable by name, including the variables beside means; of variables in several groups the first."""
    every = list(_all(beside=True))
    # In reverse: of several variables with a name the first is entered last, and stays.
    return {described.name: described for described in reversed(every)}


# One's own numbers, which a campaign declares: a dataset's attributes say what they are.


def own_numbers(dataset: xr.Dataset) -> list[str]:
    """One's own numbers in a dataset."""
    return [str(name) for name in dataset.data_vars if "source" in dataset.variables[name].attrs]


def describe_own_number(dataset: xr.Dataset, name: str) -> Described:
    """Describe one's own number in a dataset."""
    told, group = dataset[name].attrs, _GROUPS["observables"]
    meaning = str(told.get("long_name", "")) or name
    comment = str(told.get("comment", ""))
    units = str(told.get("units", "")) or "1"
    dims = ", ".join(map(str, dataset[name].dims))
    error = f"{name}_uncertainty"
    return Described(name, group, dims, units, "", meaning, "", error, comment, ())


def own_variables(dataset: xr.Dataset) -> list[str]:
    """One's own numbers in a dataset, with their ±, counts of members, and messages."""
    names = [quantity.name for quantity in OWN_MESSAGES.values()]
    for name in own_numbers(dataset):
        number = Quantity(name, name, ensemble=True)
        names += [name, *(quantity.name for quantity in number.beside)]
    return [name for name in names if name in dataset]


def own_messages(dataset: xr.Dataset) -> list[str]:
    """Messages on one's own numbers of a single case, and of its drive."""
    names = [message.name for message in OWN_MESSAGES.values()]
    columns = [dataset[name] for name in names if name in dataset]
    # Over several cases there is no one message.
    messages = [column.item() for column in columns if not column.dims]
    return [str(message) for message in messages if message]


def refuse_taken_names(manifest: Manifest) -> None:
    """Raise ManifestError if one's own number has the name of another variable or dimension of a dataset."""
    samples = [sample for group in all_groups().values() for sample in group.samples]
    reserved = {*variables_by_name(), *all_groups(), *samples, "case"}
    reserved |= {quantity.name for number in manifest.observables for quantity in own_quantity(number).beside}
    problems = []
    for number in manifest.observables:
        if number.name in reserved:
            need = f"another name: {number.name} is another variable of datasets (nanoslip describe {number.name})"
            place = Place(str(manifest.path), "outputs")
            problems.append(Problem(place, KEY, number.reference, need))
        # Two of one's own numbers may not share a name either.
        reserved.add(number.name)
    if problems:
        raise ManifestError(problems)


def explain_word(name: str) -> str:
    """Meaning of a flag, of an ending or of a regime, with advice, as a line; empty of another name."""
    meanings: dict[str, str] = {item.name: f"{item.meaning}; {item.advice}" for item in FLAGS}
    meanings |= {item.value: item.meaning for item in Ending}
    meanings.update(REGIMES)
    return f"{name}: {meanings[name]}" if name in meanings else ""


def variable_text(variable: Described) -> str:
    """Description of a variable, line by line."""
    facts = {
        "meaning": measure_label(variable.meaning, variable.measure),
        "symbol": variable.symbol,
        "along": variable.dims,
        "unit": variable.units,
        "uncertainty": variable.uncertainty,
        "values": ", ".join(variable.values),
        "comment": variable.comment,
        "part of": variable.group,
    }
    if variable.name == "validity_flags":
        facts |= {item.name: f"{item.meaning}; {item.advice}" for item in FLAGS}
    if variable.name in [item.ending.name for item in OUTCOMES.values()]:
        facts |= {item.value: item.meaning for item in Ending}
    lines = [f"  {fact}: {text}" for fact, text in facts.items() if text]
    return "\n".join([variable.name, *lines])


def _all(beside: bool = False) -> Iterator[Described]:
    """Variables of all groups. beside: with ± and member counts, which stand beside means."""
    yield from _describe_all("the case", CASES, (CASE_ID, *OUTCOMES[""], ADVICE, MEMBERS))
    for kind in KINDS:
        head = (*OUTCOMES[DRIVE], DRIVE_MEMBERS) if kind == DRIVE else ()
        dims = f"{CASES}, drive" if KINDS[kind].driven else CASES
        head = (*head, OWN_MESSAGES[kind]) if kind in OWN_MESSAGES else head
        around = [*head, *(quantity for _, quantity in scalars(kind))]
        if beside:
            around = [part for quantity in around for part in (quantity, *quantity.beside)]
        yield from _describe_all(_GROUPS.get(kind, kind), dims, around)
    for group in all_groups().values():
        dims = f"{CASES}, drive" if group.driven else CASES
        yield from _describe_all("the runs of a case", dims, (group.id,))
    places = (DRIVE_NAME, *parameters().values(), *si_coordinates().values())
    yield from _describe_all("parameters", "where they vary", places)
    for group in all_groups().values():
        counts = [series[0].count for series in group.samples.values()]
        labels = (group.label, *group.owners, *counts)
        yield from _describe_all(f"{_GROUP}{group.name}", group.name, labels)
        for sample in group.samples:
            columns = [column for column in group.columns.values() if column.along == sample]
            derived = [EVENT_DROP] if sample == EVENT_DROP.along else []
            yield from _describe_all(f"{_GROUP}{group.name}", sample, [*columns, *derived])
    yield from _describe_all(f"{_GROUP}{SOFTWARE[0].name}", SOFTWARE[0].name, SOFTWARE)


_GROUPS = {
    "contact": "initial contact",
    "record": "the friction record",
    "path": "the path of pin and load",
    DRIVE: "the drive",
    "observables": "one's own numbers",
    "drive_observables": "one's own numbers of the drive",
}
"""Kind of task -> subject of its variables."""
_GROUP = "group "
"""Beginning of the titles of groups beside the root."""


def _describe_all(group: str, dims: str, quantities: Iterable[Quantity]) -> Iterator[Described]:
    for quantity in quantities:
        values = tuple(filter(None, quantity.flags)) or quantity.codes or quantity.words
        units = "" if quantity.words else quantity.units
        facts = (quantity.measure, quantity.meaning, quantity.symbol, quantity.uncertainty, quantity.comment, values)
        yield Described(quantity.name, group, dims, units, *facts)


# Means over members, and how many they are over: not all members of an ensemble have each number.

EXPLAINED: Final = "(k of n starts): mean over the k members that have a value"


class Known(NamedTuple):
    """Mean of a number over the members of each result, (results,), its ± and the part of it that members share, and how many
    members have it."""

    mean: NDArray[np.float64]
    uncertainty: NDArray[np.float64]
    shared: NDArray[np.float64]
    members: NDArray[np.int64]


def mean_in_dataset(stored: Mapping[str, NDArray[np.float64]], name: str, quantity: Quantity) -> Known:
    """Mean of a scalar with its ±, as datasets have it. stored: scalars of results of the same kind, (results,
    members) each."""
    values = stored[name]
    # One number of all members, which each of them repeats.
    shared = stored.get(f"{name}{SHARED_ERROR}", np.zeros_like(values))[:, 0]
    mean, uncertainty, members = mean_of(values, shared)
    # A number of all members together: the result holds its ±.
    if quantity.uncertainty in stored:
        uncertainty = stored[quantity.uncertainty][:, 0]
        members = stored[quantity.members][:, 0].astype(int)
    # A mean over members of different sorts would belong to none of them.
    if quantity.alike:
        starts = stored[quantity.alike]
        are_alike = (starts == starts[:, :1]).all(axis=1)
        counts = are_alike & (members == values.shape[1])
        mean, uncertainty = np.where(counts, (mean, uncertainty), np.nan)
    # Members that do not differ say nothing of their ±.
    unknown = ~(uncertainty > ROUNDING * np.abs(mean))
    uncertainty = np.where(unknown, np.nan, uncertainty)
    shared = np.where(np.isnan(mean), np.nan, shared)
    return Known(mean, uncertainty, shared, members)


def alike_starts(stored: Mapping[str, NDArray[np.float64]]) -> NDArray[np.bool_]:
    """True for records of which all members have the same events: one start, of which no mean has a ±. stored: as above."""
    names = [name for name, _ in scalars("record") if name in stored]
    stated = np.array([stored[name] for name in names])
    # Counts alone: positions on the grid may have followed the pin.
    counts = np.where(stated == np.floor(stated), stated, np.nan)
    # `fmax` and `fmin` pass over NaN, which stands here for numbers that are no counts.
    most = np.fmax.reduce(counts, axis=2)
    least = np.fmin.reduce(counts, axis=2)
    differ: NDArray[np.bool_] = (most > least).any(axis=0)
    return ~differ


def member_count_text(dataset: xr.Dataset, name: str) -> tuple[xr.Variable, ...]:
    """Number of members with a value, and of computed members; empty unless it is a mean with uncertainty."""
    computed = DRIVE_MEMBERS if name in drive_variables() else MEMBERS
    names = (f"{name}_members", computed.name)
    if not set(names) <= dataset.variables.keys():
        return ()
    return tuple(dataset.variables[count] for count in names)


@cache
def drive_variables() -> set[str]:
    """The variables of the results of drives, without the variables beside means."""
    return {quantity.name for _, quantity in scalars(DRIVE)}


@cache
def counts() -> set[str]:
    """The variables that count something."""
    declared = map(result_quantities, KINDS.values())
    every = chain.from_iterable(by_name.values() for by_name in declared)
    return {quantity.name for quantity in every if quantity.counted}


def fewer(case: xr.Dataset, name: str) -> str:
    """Remark after a case's number that fewer members have than were computed: ` (5 of 8 starts)`."""
    counts = [count.values.item() for count in member_count_text(case, name)]
    return f" ({counts[0]:.0f} of {counts[1]:.0f} starts)" if counts and 0 < counts[0] < counts[1] else ""


@cache
def words_counted() -> dict[str, dict[str, str]]:
    """Variable of words -> word -> the variable that counts the members that have it."""
    counted = {}
    for kind in KINDS:
        for _, quantity in scalars(kind):
            if quantity.words:
                tallies = quantity.counts()
                names = {word: tallies[word].name for word in tallies}
                counted[quantity.name] = names
    return counted


def member_counts(dataset: xr.Dataset, name: str) -> dict[str, xr.DataArray]:
    """Word of a variable -> how many members have it; empty for variables without such counts."""
    counted = words_counted().get(name, {})
    return {word: dataset[count] for word, count in counted.items() if count in dataset.variables}


def count_range(counts: xr.DataArray) -> str:
    """The least and the most of some counts of members: `3 to 12`, or `8`."""
    counted = counts.values[counts.notnull().values]
    if not counted.size:
        return "0"
    ends = (counted.min(), counted.max())
    return " to ".join(dict.fromkeys(str(int(end)) for end in ends))


def are_means(dataset: xr.Dataset) -> bool:
    """True if numbers are means over several members."""
    if MEMBERS.name not in dataset:
        return False
    return bool((dataset[MEMBERS.name] > 1.0).any())


@cache
def sharing() -> dict[str, str]:
    """Variable -> the sort of error that its members share (`Quantity.shared`)."""
    every = chain.from_iterable(map(scalars, KINDS))
    return {quantity.name: quantity.shared for _, quantity in every if quantity.shared}


_UNKNOWN_SHARE: Final = {
    "length": "records shorter than two node spacings",
    "events": "records shorter than two node spacings",
    "repetition": "a motion that repeats its record",
}
"""Sort of error that members share -> why it may be unknown."""


def missing_error_reasons(dataset: xr.Dataset, names: Iterable[str]) -> str:
    """Reasons why numbers among these variables have no ±, as `± ?: a single start`; empty if all have one."""
    variables, named_reasons = dataset.variables, dict[str, None]()
    for name in names:
        error = variables.get(f"{name}_uncertainty")
        if error is None:
            continue
        value = variables[name]
        is_certain = error > ROUNDING * abs(value)
        lacking = value.notnull() & ~is_certain
        if not bool(lacking.any()):
            continue
        having, used = member_count_text(dataset, name) or (1, 1)
        # What other reasons leave: several starts, each with a value.
        several = lacking & (used != 1) & ~(having < used)
        shared = variables.get(f"{name}{SHARED_ERROR}")
        unknown = several & (False if shared is None else shared.isnull())
        unknown_share = _UNKNOWN_SHARE.get(sharing().get(name, ""), "records too short for it")
        reasons = {
            "a single start": lacking & (used == 1),
            "starts without a value": lacking & (having < used),
            "identical starts": several & ~unknown,
            unknown_share: unknown,
        }
        for reason, has_reason in reasons.items():
            if bool(has_reason.any()):
                named_reasons[reason] = None
    return f"± ?: {', '.join(named_reasons)}" if named_reasons else ""


def explain_means(dataset: xr.Dataset, shown: Iterable[Hashable]) -> str:
    """Explain means over members, ±, and the remarks for missing members or an unknown ± of the variables shown."""
    names = list(map(str, shown))
    counts = filter(None, (member_count_text(dataset, name) for name in names))
    # Variables, not arrays: nothing here needs the coordinates, which take ten times as long to compare.
    parts = []
    if are_means(dataset):
        members = count_range(dataset[MEMBERS.name])
        driven = count_range(dataset[DRIVE_MEMBERS.name]) if DRIVE_MEMBERS.name in dataset else members
        of_drives = "" if driven == members else f" (of drives over {driven})"
        parts.append(f"numbers are means over {members} members{of_drives}, ± their 68 % interval")
    parts += filter(None, [missing_error_reasons(dataset, names)])
    if any(bool(((having > 0) & (having < used)).any()) for having, used in counts):
        parts.append(EXPLAINED)
    return "; ".join(parts)


def windows(group: xr.Dataset, declared: Group) -> dict[str, NDArray[np.int64]]:
    """Sample dimension that a group has -> where each of its runs begins, and where the last one ends."""
    counts = {name: series[0].count.name for name, series in declared.samples.items()}
    starts = {}
    for name, count in counts.items():
        if count in group.variables:
            lengths = group.variables[count].values
            ends = np.cumsum(lengths, dtype=np.int64)
            starts[name] = np.concatenate(([0], ends))
    return starts
