"""Tables of a dataset with a row for each case, advice in sentences, and the error of each number."""

import functools
import math
import operator
import re
from collections import Counter
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Scales
from nanoslip.solver.dynamics.coefficients import INERTIAL
from nanoslip.solver.ensemble import LeftOut, SpacingChange
from nanoslip.solver.load_path import Loops
from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import quantities
from nanoslip.solver.sliding.validity import decode_flags
from nanoslip.solver.view import with_error
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.table import CASE, CaseRows, case_rows
from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.dataset.units import (
    column_title,
    convert_to_si,
    format_value,
    format_words,
    hyphenate,
    is_given_in_si,
    is_prefixed,
    parameter_symbol,
    prefix_factor,
    si_name,
    symbol_and_unit,
    symbol_with_unit,
    value_with_unit,
    variable_description,
    with_size,
)
from nanoslip.study.manifest.manifest import Stage, TargetTable
from nanoslip.study.manifest.parameters import Value, si_text
from nanoslip.study.plan.expectations import flag_lines
from nanoslip.study.report.console import Table
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import PENDING
from nanoslip.study.toml_text import from_toml

# Values that are the same in all rows of a table: printed once above it, not in every row.

LARGEST_WHOLE: float = 1e12
"""Whole numbers below it are written without an exponent."""
FEW_COUNTED: Final = 10.0
"""Means of counts are whole numbers from here on, and have one digit below it."""
NOTHING = "–"
"""Cell of an unknown number."""


def format_number(value: float, digits: int) -> str:
    """Format a number with this number of digits; a longer whole number in full, in groups of three."""
    # The general format would write 12345678 as 1.23e+07, which hides digits that a count has.
    if 10**digits <= abs(value) < LARGEST_WHOLE and value == round(value):
        return f"{value:,.0f}".replace(",", "\N{NO-BREAK SPACE}")
    return f"{value:.{digits}g}"


def factor_out_columns(table: Table) -> tuple[Table, list[str]]:
    """Remove columns whose cells are all equal from a table, and return sentences with their values.

    Labels and the last column stay, and a table with a single row stays as it is.
    """
    # In a single row all columns would be alike.
    if len(table.rows) < 2:
        return table, []
    last = len(table.header) - 1
    columns = list(zip(*table.rows, strict=True))
    distinct_cells = [len(set(cells)) for cells in columns]
    alike = [place for place in range(table.labels, last) if distinct_cells[place] == 1]
    kept = [place for place in range(last + 1) if place not in alike]
    requested = range(table.labels, table.labels + table.asked)
    asked = sum(place in requested for place in kept)
    header = tuple(table.header[place] for place in kept)
    kept_columns = [columns[place] for place in kept]
    rows = tuple(zip(*kept_columns, strict=True))
    cells = [(table.header[place], columns[place][0]) for place in alike]
    names = [name for place, name in enumerate(table.names, table.labels) if place not in alike]
    narrower = replace(table, header=header, rows=rows, asked=asked, names=tuple(names))
    return narrower, list(_cell_sentences(cells))


def _cell_sentences(cells: Sequence[tuple[str, str]]) -> Iterator[str]:
    """Sentences with the titles of columns and the cell that all of their rows have."""
    entries = [f"{title} = {cell}" for title, cell in cells if cell != NOTHING]
    if entries:
        yield f"In all rows: {', '.join(entries)}."
    unknown = [title for title, cell in cells if cell == NOTHING]
    if unknown:
        yield f"Not known in any row: {', '.join(unknown)}."


# Scalars of one case as text.

UNCERTAINTY: Final = "_uncertainty"
"""Suffix of a number's name for its ±."""
CRITICAL: Final = "critical_velocity"
"""Variable with the velocity of the stage above which the pin no longer sticks."""


def read_endings(case: xr.Dataset) -> dict[str, tuple[str, str]]:
    """Outcome and message of a case, and of its drive if it has one: `outcome` and `drive` -> both."""
    endings = {}
    for label, run in (("outcome", ""), ("drive", "drive")):
        outcome = variables.OUTCOMES[run]
        if outcome.ending.name in case and not case[outcome.ending.name].dims:
            message = str(case[outcome.message.name].item())
            ending = str(case[outcome.ending.name].item())
            endings[label] = (ending, message)
    return endings


def format_scalar(values: xr.Dataset, name: str, digits: int) -> str:
    """Format a scalar with this number of digits, or rounded beside its ±; NOTHING if unknown."""
    value, error = values[name].item(), f"{name}{UNCERTAINTY}"
    if value in ("", NOTHING) or value != value:  # noqa: PLR0124  NaN is not
        return _not_found(values, name)
    if error in values:
        parts = _two_parts(values) if name == "static_friction" else ""
        return with_error(value, float(values[error])) + parts
    if isinstance(value, str | bool):
        return format_words(case_rows(values, name).tallies(name)[0])
    # A mean of counts is no whole number: more digits than its scatter allows would look like knowledge.
    if name in variables.counts() and value != round(value):
        decimals = 0 if abs(value) >= FEW_COUNTED else 1
        return format_number(round(value, decimals), digits)
    return format_number(value, digits)


def _not_found(values: xr.Dataset, name: str) -> str:
    """Reason why a critical velocity is missing, as `always sticks`; NOTHING for other numbers, or if it is unknown."""
    tally = dict(search_results(values, name))
    if not tally or list(tally) == ["unknown"]:
        return NOTHING
    return format_words(tally)


def search_results(values: xr.Dataset, name: str) -> Iterator[tuple[str, int]]:
    """Results of the search for a critical velocity, in words, and how many starts have each; none of other numbers."""
    search = f"{name}_search"
    if search in values:
        for word, count in case_rows(values, search).tallies(search)[0].items():
            yield word.replace("_", " "), count


# Masks of cases are variables: nothing here needs coordinates, which take ten times as long to compare.


def _inertial(values: xr.Dataset) -> xr.Variable:
    """True if inertia and damper add more than INERTIAL to the contact's own peak in μ_s."""
    excess = values.variables.get("static_friction_excess", xr.Variable((), 0.0))
    return excess > INERTIAL * (values.variables["static_friction"] - excess)


def _two_parts(values: xr.Dataset) -> str:
    """The contact's own part of μ_s and that of inertia and damper, as ` (0.498 + 0.415)`; empty if that is within its ±."""
    excess = values.variables.get("static_friction_excess", xr.Variable((), 0.0)).values.item()
    # A difference within the ± would only be noise of the two parts.
    beyond_error = excess > values.variables["static_friction_uncertainty"].values.item()
    if not (beyond_error or bool(_inertial(values))):
        return ""
    own_part = values.variables["static_friction"].values.item() - excess
    return f" ({own_part:.3g} + {excess:.3g})"


MOST_ROWS: Final = 500
"""The most rows of a table on the page."""
MOST_LINES: Final = 40
"""Most rows of a table on the terminal, so that the text below it stays visible."""
COMPLETED: Final = Ending.COMPLETED.value
FEW: Final = 50
"""Drives whose endings are not counted."""


class RowLabel(NamedTuple):
    """A column of a table with a parameter in which its rows differ."""

    title: str
    name: str
    twin: str = ""
    """Coordinate in SI whose values are shown, if any."""
    factor: float = 1.0
    """To the unit in the title."""

    def cell(self, case: xr.Dataset, scales: Scales | None) -> str:
        """The value of a row; in units of the scales with its size behind it."""
        if not self.twin:
            return with_size(self.name, case[self.name].item(), scales)
        value = case[self.twin].item()
        if math.isfinite(value):
            value *= self.factor
        return format_value(value)


def row_label(rows: CaseRows, name: str) -> RowLabel:
    """The column of a parameter, in SI with a prefix where the campaign is given in SI."""
    twin = si_name(rows.root, name)
    if not is_given_in_si(rows.root) or not is_prefixed(twin):
        return RowLabel(symbol_with_unit(parameter_symbol(name), name), name)
    values = rows.values(twin)
    if values.dtype.kind != "f":
        return RowLabel(symbol_with_unit(parameter_symbol(name), name), name)
    factor, unit = prefix_factor(values, variable_description(twin).units)
    return RowLabel(symbol_and_unit(twin, unit), name, twin, factor)


def each_case(rows: CaseRows, most: int) -> list[xr.Dataset]:
    """Scalars of at most `most` rows, in their order; finished cases come before unfinished ones."""
    outcomes = [ending.name for ending, *_ in variables.OUTCOMES.values()]
    endings = [name for name in outcomes if name in rows.root]
    pending = [rows.values(name) == PENDING for name in endings]
    waiting = np.any(pending, axis=0)
    # Stable: the finished rows keep their order, and so do the others.
    finished_first = np.argsort(waiting, kind="stable")
    shown = np.sort(finished_first[:most])
    scalars = [name for name in rows.root.data_vars if rows.has(str(name))]
    # Loaded once: a file would be opened and read for every cell.
    root = rows.root[scalars].load()
    return list(replace(rows, root=root).at(shown))


def scalar_table(dataset: xr.Dataset, why: bool = True, most: int = MOST_ROWS, scales: Scales | None = None) -> Table:
    """Table with one row for each case and drive, at most `most`.

    why: behind an outcome its message, too. scales: to have lengths and loads of the axes in SI beside them.
    """
    asked = _answer_columns(dataset)
    names = [name for name in (*asked, *SHOWN) if name in dataset]
    # Numbers of cycles would be empty columns beside a path that has none.
    names = [name for name in names if not _has_no_cycles(dataset, name)]
    # Periods and amplitudes exist for stick-slip alone; a campaign without it needs no empty columns.
    names = [name for name in names if name not in _OF_CYCLES or dataset[name].notnull().any()]
    columns = {name: SHOWN.get(name) or column_title(name, dataset) for name in names}
    dataset, units = convert_to_si(_select_shown(dataset, columns), names)
    columns |= {name: f"{_UNIT.sub('', columns[name])} ({unit})" for name, unit in units.items()}
    all_rows = case_rows(dataset)
    varying = {name: row_label(all_rows, name) for name in _differing_coordinates(all_rows)}
    labels = [label.title for label in varying.values()]
    # A punch is given its own half-width.
    titles = [f"{title} of contact" if title in labels else title for title in columns.values()]
    shared, flagged = _shared_flags(dataset)
    header = (*labels, *titles, "outcome [flag]" if flagged else "outcome")
    rows: list[tuple[str, ...]] = []
    failed = set()
    for case in each_case(all_rows, most):
        ending, flags, message = _ending(case, shared)
        missing = bool(_has_missing_number(case)) and not bool(_has_regime_answer(case))
        if ending not in _UNHURT and missing:
            failed.add(len(rows))
        outcome = f"{ending}{flags if flagged else ''}{message if why else ''}"
        parameters = [label.cell(case, scales) for label in varying.values()]
        numbers = [format_scalar(case, name, 5) + variables.fewer(case, name) for name in columns]
        rows.append((*parameters, *numbers, outcome))
    more = len(all_rows) - len(rows)
    if more:
        blank = ["…"] * (len(header) - 1)
        rows.append((*blank, f"{more} more"))
    return Table(
        header, tuple(rows), labels=len(varying), failed=frozenset(failed), asked=len(asked), names=tuple(names)
    )


_UNIT: Final = re.compile(r"/L_x$|/\(.*\)$|·L_x·L_y/W$| \(.*\)$")
"""Unit at the end of a column's title."""


def _shared_flags(dataset: xr.Dataset) -> tuple[int, bool]:
    """Bits of the validity flags that all of several cases have, which are named once below a table; True if any has
    others."""
    if variables.VALIDITY.name not in dataset:
        return 0, False
    flags = dataset[variables.VALIDITY.name].values
    masks = flags.astype(np.int64).ravel()
    # A single case shares its flags with nobody.
    shared = 0
    if len(masks) > 1:
        shared = int(np.bitwise_and.reduce(masks))
    return shared, bool((masks & ~shared).any())


def _answer_columns(dataset: xr.Dataset) -> list[str]:
    """Columns of a table that a campaign requests: its main numbers and the regime of its drives."""
    asked = (*main_numbers(dataset), "regime", *variables.own_numbers(dataset))
    names = [name for name in asked if name in dataset]
    if "static_friction" not in names or "plateau_mean" not in dataset or "plateau_mean" in names:
        return names
    # A pin that never slips has the friction of the plateau.
    never_slips = bool(dataset["static_friction"].isnull().any())
    return [*names, "plateau_mean"] if never_slips else names


def _select_shown(dataset: xr.Dataset, columns: Collection[str]) -> xr.Dataset:
    """The variables that a table with these columns needs: of millions of cases, other numbers stay in their file."""
    names = {"static_friction_excess", variables.VALIDITY.name, *columns}
    names |= {variables.MEMBERS.name, variables.DRIVE_MEMBERS.name}
    for column in columns:
        names |= {f"{column}{UNCERTAINTY}", f"{column}_members"}
        counts = variables.words_counted().get(column, {})
        names.update(counts.values())
    # Texts stay, as outcomes and messages are among them.
    shown = [name for name, values in dataset.data_vars.items() if name in names or are_texts(values.variable)]
    return dataset[shown]


def _has_no_cycles(dataset: xr.Dataset, name: str) -> bool:
    """True for a number of cycles where no path has any."""
    is_of_cycles = name in quantities(Loops)
    return is_of_cycles and bool(dataset[name].isnull().all())


def main_numbers(dataset: xr.Dataset) -> list[str]:
    """Requested numbers of a campaign: the numbers in [target] and the main numbers of the last stage."""
    named = _target(dataset)[1]
    if "drive_outcome" in dataset:
        of_drives = ("static_friction", "kinetic_friction", *OF_STAGES)
        named = (*named, *(name for name in of_drives if name in dataset))
    elif "plateau_mean" in dataset:
        named = (*named, "plateau_mean")
    elif "loss_per_cycle" in dataset and not _has_no_cycles(dataset, "loss_per_cycle"):
        named = (*named, "loss_per_cycle")
    critical = (CRITICAL,) if CRITICAL in dataset else ()
    # Without repetitions: [target] may name what the stage has anyway.
    numbers = filter(None, (*named, *critical))
    return list(dict.fromkeys(numbers))


def _has_missing_number(dataset: xr.Dataset) -> xr.Variable:
    """True if a requested number is missing: of [target], or μ_s of a drive with `max_slips`."""
    names = _target(dataset)[1]
    if not names and {"max_slips", "static_friction"} <= set(dataset.variables):
        # A drive with `max_slips` has all that it is to find once it has μ_s; any other needs its whole duration.
        return _missing_mask(dataset, ("static_friction", "max_slips"))
    if not names or any(name not in dataset for name in names):
        return xr.Variable((), True)
    return _missing_mask(dataset, names)


def _has_regime_answer(dataset: xr.Dataset) -> xr.Variable:
    """True for drives whose regime is the answer without μ_s, unless [target] names numbers.

    A pin follows in micro slips, or sticks below a critical velocity that is known.
    """
    if "regime" not in dataset or _target(dataset)[1]:
        return xr.Variable((), False)
    is_critical_known = xr.Variable((), False)
    if CRITICAL in dataset:
        is_critical_known = dataset.variables[CRITICAL].notnull()
    regime = dataset.variables["regime"]
    return (regime == "micro_slip") | (regime == "sticks") & is_critical_known


def flag_summary(dataset: xr.Dataset) -> dict[str, str]:
    """Validity flag -> a line: how many cases have it, the first of them, and the advice."""
    if variables.VALIDITY.name not in dataset:
        return {}
    masks = dataset[variables.VALIDITY.name]
    rows = case_rows(dataset, str(masks.name))
    # A single case needs no place.
    first = partial(_place, rows) if masks.size > 1 else lambda _: ""
    return flag_lines(masks.values.ravel().tolist(), first)


def _target(dataset: xr.Dataset) -> tuple[float, tuple[str, ...]]:
    """Target of a campaign: its relative error, NaN without one, and its variables."""
    document = from_toml(dataset.attrs.get("manifest", ""))
    if "target" not in document:
        return math.nan, ()
    # If [target] names no variables, it means the main numbers of the last stage.
    last: Stage = "contact"
    if "drive_outcome" in dataset:
        last = "dynamics"
    elif "plateau_mean" in dataset:
        last = "slip"
    target = TargetTable(**document["target"])
    of_stages_only = "leg_regime" in dataset and "regime" not in dataset
    return target.within, target.variables(last, of_stages_only)


def short_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each number that misses its target, or has no mean, in some complete cases."""
    enough, names = _target(dataset)
    lines = []
    for name in names:
        if not {name, f"{name}_uncertainty"} <= set(dataset.data_vars):
            continue
        # More starts reduce one cause and not the other, so each cause has its line and its cure.
        for short, remark in _shortfalls(dataset, name, enough):
            positions = np.flatnonzero(short.values).tolist()
            if positions:
                where = _where(case_rows(dataset, name), positions)
                lines.append(f"{name} is not known within {enough:.2g}: {where}; {remark}")
    return lines


def _shortfalls(dataset: xr.Dataset, name: str, enough: float) -> Iterator[tuple[xr.DataArray, str]]:
    """Masks of the cases in which a number misses its target, or has no mean, and a remark on each mask."""
    mean = dataset[name]
    # [target] asks for an interval: twice the ±, and all of a change that is no matter of chance.
    width = 2.0 * abs(dataset[f"{name}_uncertainty"] / mean)
    if LEFT_OUT_ERROR.name in dataset:
        left_out = dataset[LEFT_OUT_ERROR.name]
        if set(left_out.dims) <= set(width.dims):
            width = width + left_out
    spacing = _spacing_change(dataset, mean)
    decided = spacing > enough
    if decided.any():
        change = (
            f"twice the node spacing changes it by up to {float(spacing.max()):.1%}, which no further starts reduce"
        )
        yield decided, f"{change}: raise n_x; nanoslip explain estimates the time of half the spacing"
    width = (width + spacing.fillna(0.0)).where(~decided, 0.0)
    worst = float(width.max())
    yield width > enough, f"the worst to {worst:.1%}; raise target.most, or limits.presliding"
    outcomes = [ending.name for ending, *_ in variables.OUTCOMES.values()]
    endings = [dataset[name] for name in outcomes if name in dataset]
    endings = [ending for ending in endings if set(ending.dims) <= set(mean.dims)]
    if endings:
        yield width.isnull() & (endings[-1] == COMPLETED), "members lack a value, or do not differ"


def _spacing_change(dataset: xr.Dataset, number: xr.DataArray) -> xr.DataArray:
    """Relative change of a number by twice the node spacing: of its drive, else of its record; NaN if unknown."""
    for name in (f"drive_{SPACING_CHANGE}", SPACING_CHANGE):
        if name in dataset and set(dataset[name].dims) == set(number.dims):
            return dataset[name]
    return xr.full_like(number, math.nan)


def omission_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each effect that was left out of most members of a drive, with the number of drives and the largest
    change."""
    if LEFT_OUT.name not in dataset:
        return []
    effects = np.ravel(dataset[LEFT_OUT.name].values)
    errors = np.ravel(dataset[LEFT_OUT_ERROR.name].values)
    lines = []
    for word in LEFT_OUT.words[1:]:
        without = effects == word
        if without.any():
            count = f"{without.sum()} of {effects.size} drives"
            change = f"the numbers asked for change by {errors[without].max():.2%} at most"
            effect = word.replace("_", " ")
            lines.append(f"left out: {effect} in {count}; {change}, what else depends on it is not known")
    return lines


def _ending_groups(rows: CaseRows, run: str) -> list[tuple[str, str, list[int]]]:
    """Outcome, cause and positions of cases, or drives, that ended alike by themselves; the most frequent first.

    Messages with the same cause count as the same. Drives that ended as their case did are left out.
    """
    ending_name = variables.OUTCOMES[run].ending.name
    endings = rows.values(ending_name).tolist()
    case_ending_name = variables.OUTCOMES[""].ending.name
    case_endings = rows.values(case_ending_name).tolist()
    groups: dict[tuple[str, str], list[int]] = {}
    kinds, case_kinds = _kinds(rows, run), _kinds(rows, "")
    pairs = zip(endings, case_endings, kinds, case_kinds, strict=True)
    for number, (ending, case_ending, kind, case_kind) in enumerate(pairs):
        # A drive that could not run as its case failed would report the same failure twice.
        same_cause = kind != "" and kind == case_kind
        same_failure = ending == case_ending and case_ending not in _UNHURT
        if not run or not (same_cause or same_failure):
            groups.setdefault((ending, kind), []).append(number)
    listed = [(*cause, numbers) for cause, numbers in groups.items()]
    return sorted(listed, key=lambda group: -len(group[2]))


def _kinds(rows: CaseRows, run: str) -> list[str]:
    """Cause of each outcome, or else its message, as in `Outcome.kind`."""
    outcome = variables.OUTCOMES[run]
    messages: list[str] = rows.values(outcome.message.name).tolist()
    if not rows.has(outcome.cause.name):
        return messages
    # Messages contain numbers of their case: the cause groups them.
    causes = rows.values(outcome.cause.name).tolist()
    pairs = zip(causes, messages, strict=True)
    return [cause or message for cause, message in pairs]


def endings(dataset: xr.Dataset) -> list[tuple[str, bool]]:
    """Numbers of cases, then drives by ending, each with True if it is a failure: failures first, the most frequent first."""
    answered = _has_regime_answer(dataset)
    counts = []
    for kind, (ending, *_) in variables.OUTCOMES.items():
        if ending.name not in dataset:
            continue
        endings = dataset.variables[ending.name]
        words = filter(None, endings.values.ravel().tolist())
        for word, count in Counter(words).most_common():
            # A drive that sticks has answered by its regime.
            all_answered = bool((answered | (endings != word)).all())
            failed = word != COMPLETED and not all_answered
            plural = "s" if count > 1 else ""
            counts.append((f"{count} {kind or 'case'}{plural}: {word.replace('_', ' ')}", failed))
    return sorted(counts, key=lambda line: not line[1])


def cautions(dataset: xr.Dataset) -> list[str]:
    """Cautions: effects left out, missed targets, validity flags."""
    others = failure_summary(dataset, asked=False).values()
    beside = (*own_number_summary(dataset), *others)
    flags = flag_summary(dataset).values()
    return [*omission_summary(dataset), *short_summary(dataset), *beside, *flags]


def own_number_summary(dataset: xr.Dataset) -> list[str]:
    """A line for each message on one's own numbers: how many cases, or drives, have it, and the first of them."""
    lines = []
    for kind, variable in variables.OWN_MESSAGES.items():
        if variable.name not in dataset:
            continue
        rows = case_rows(dataset, variable.name)
        messages = rows.values(variable.name).tolist()
        for message in dict.fromkeys(filter(None, messages)):
            alike = [number for number, text in enumerate(messages) if text == message]
            where = _where(rows, alike, "drives" if KINDS[kind].driven else "cases")
            lines.append(f"own numbers: {message}: {where}")
    return lines


def failure_summary(dataset: xr.Dataset, asked: bool = True) -> dict[Hashable, str]:
    """Cause -> a line for each way in which cases, then drives failed: how many, the first of them, why and what to
    do.

    asked: True for cases that miss a requested number, False for cases that failed without that. A remark on a completed case
    is left out if it is on a number that nobody requested.
    """
    lines: dict[Hashable, str] = {}
    missed = _has_missing_number(dataset) & ~_has_regime_answer(dataset)
    lacking = missed & _missing_mask(dataset, main_numbers(dataset))
    for run, (outcome, message, *_) in variables.OUTCOMES.items():
        if outcome.name not in dataset:
            continue
        rows = case_rows(dataset, outcome.name)
        outcomes = dataset.variables[outcome.name]
        hurt, remarked = _outcome_mask(outcomes, missed), _outcome_mask(outcomes, lacking)
        messages = rows.values(message.name).tolist()
        for ending, kind, alike in _ending_groups(rows, run):
            # A remark on numbers that nobody requested is no advice.
            if ending in _UNHURT and not asked:
                continue
            failed = remarked if ending in _UNHURT else hurt
            numbers = [number for number in alike if failed[number] == asked]
            if numbers and ending and (kind or ending not in _UNHURT):
                where = _where(rows, numbers, f"{run or 'case'}s")
                reason = _first_message([messages[number] for number in numbers])
                parts = filter(None, (ending, where, reason))
                lines[run, ending, kind] = ": ".join(parts)
    return lines


def _first_message(messages: Sequence[str]) -> str:
    """First message of a cause, marked if other messages of the same cause differ in their numbers."""
    alike = len(set(messages)) == 1
    return messages[0] if alike else f"{messages[0]}; the others differ in numbers"


def _outcome_mask(outcomes: xr.Variable, which: xr.Variable) -> NDArray[np.bool_]:
    """A mask of each outcome, in their order; True of all where it lies along other dimensions."""
    # A mask of drives has a dimension that outcomes of cases lack: then all of these count.
    fits = set(which.dims) <= set(outcomes.dims)
    mask = which if fits else xr.Variable((), True)
    in_order = mask.set_dims(dict(outcomes.sizes))  # type: ignore[no-untyped-call]
    return np.asarray(in_order.values.ravel(), np.bool_)


def _missing_mask(dataset: xr.Dataset, names: Sequence[str]) -> xr.Variable:
    """True where any of these numbers is missing."""
    missing = [dataset.variables[name].isnull() for name in names if name in dataset]
    return functools.reduce(operator.or_, missing, xr.Variable((), False))


def _where(rows: CaseRows, numbers: Sequence[int], what: str = "cases") -> str:
    """Report the number of some rows, and the first of them."""
    place = _place(rows, numbers[0])
    return f"{len(numbers)} of {len(rows)} {what}" + (f", first {place}" if place else "")


def _place(rows: CaseRows, number: int) -> str:
    """Parameters of a row that differ between rows."""
    row = rows.at([number])
    label = {name: row.values(name).tolist()[0] for name in _differing_coordinates(rows)}
    return label_text(label)


def drive_summary(dataset: xr.Dataset) -> list[str]:
    """Number of drives by outcome and by regime (of most members), nothing of few, as the table shows them; and advice on μ_s."""
    lines = []
    for name in ("drive_outcome", "regime"):
        if name not in dataset or dataset[name].size <= FEW:
            continue
        values = dataset[name].values.ravel()
        words = filter(None, values.tolist())
        tally = Counter(words)
        counts = ", ".join(f"{count} {hyphenate(word)}" for word, count in tally.most_common())
        if counts:
            lines.append(f"{name} of {dataset[name].size} drives: {counts}")
    inertial = _inertial(dataset) if "static_friction" in dataset else xr.Variable((), False)
    count = int(inertial.sum())
    if count:
        share = f"inertia and damper add over {INERTIAL:.0%} to the contact's peak, as (peak + addition)"
        cure = "lower stage_velocity, spring_stiffness or damping_ratio"
        lines.append(f"μ_s of {count} of {inertial.size} drives: {share}; {cure}")
    return lines


def label_text(label: Mapping[str, Value], scales: Scales | None = None) -> str:
    """Format a label by the names of a campaign file: `R/L_x = 200, slip_order = worst_first, V_o = 2 mm/s`.

    Parameters that it has not, as a scheme its settings, are left out. scales: to have lengths and loads in SI: `R = 5 mm`.
    """
    parts = []
    for name, value in label.items():
        # Where a case has no such parameter, a text is empty and a number NaN.
        if value != "" and value == value:  # noqa: PLR0124  NaN is not
            si = si_text(scales, name, value) if scales else ""
            size = f"{variables.si_coordinates()[name].symbol} = {si}" if si else ""
            parts.append(size or f"{parameter_symbol(name)} = {value_with_unit(name, value)}")
    return ", ".join(parts)


SHOWN: Final = {
    "static_friction": "μ_s",
    "kinetic_friction": "μ_k",
    "regime": "regime",
    "stick_slip_period": "period (s)",
    "spring_force_amplitude": "amplitude/W",
    CRITICAL: "V_c (m/s)",
    **{"loop_energy": "loop/(W·L_x)", "midstroke_friction": "F/W at mid-stroke"},
    **{"turn_static_friction": "μ_s at turns", "leg_regime": "legs", "pin_stroke": "pin stroke/L_x"},
    "plateau_mean": "plateau F/W",
    "peak_friction": "peak F/W",
    "cycle_stroke": "stroke/L_x",
    "loss_per_cycle": "loss/(W·L_x)",
    "turn_friction": "F/W at turns",
    "equivalent_damping": "damping ζ",
    "closure": "closure F/W",
    "shaken_down": "shaken down",
    "slips_exponent": "τ of slips",
    "slips_goodness": "goodness of τ",
    "surface_stiffness": "K/(G·L_y)",
    "events": "events",
    "record_spacings": "spacings",
    "final_displacement": "δ_p/L_x",
    "contact_half_width": "a/L_x",
    "approach": "approach/L_x",
    "mean_pressure": "mean p·L_x·L_y/W",
    "maximum_pressure": "max p·L_x·L_y/W",
    "members": "members",
}
"""Variable -> title of its column in tables of cases, on the terminal and on a page; numbers of a single case have
this order, too. The main results come first, as a narrow terminal leaves out the last columns."""
_OF_CYCLES: Final = ("stick_slip_period", "spring_force_amplitude")
OF_STAGES: Final = ("loop_energy", "midstroke_friction", "turn_static_friction")
_UNHURT: Final = (COMPLETED, PENDING)
"""Endings that are no failure."""
LEFT_OUT, LEFT_OUT_ERROR = quantities(LeftOut).values()
"""Variables: the effect that was left out of a case, and the relative change that this may cause."""


(SPACING_CHANGE,) = quantities(SpacingChange)
"""Variable: the influence of the node spacing on a record's numbers; `drive_` before it, on a drive's."""


def _differing_coordinates(rows: CaseRows) -> list[str]:
    """The coordinates in which rows differ; of a list of cases alike in all parameters their number."""
    names = list(rows.differing())
    alike = CASE in rows.sizes and set(names) <= rows.sizes.keys()
    return [CASE, *names] if alike else names


def _ending(values: xr.Dataset, shared: int) -> tuple[str, str, str]:
    """Outcome of a case and its drive: the first bad outcome, the case's flags in brackets, advice on that outcome.

    shared: flags that all cases have.
    """
    good = (COMPLETED, "")
    failures = [ended for ended in read_endings(values).values() if ended != good]
    ending, message = failures[0] if failures else good
    mask = int(values.get(variables.VALIDITY.name, 0)) & ~shared
    flags = decode_flags(mask)
    names = ", ".join(flag.name for flag in flags)
    return ending, f" [{names}]" if flags else "", f": {message}" if message else ""
