"""Access to a dataset: runs of a case, all events of all cases, flat tables."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import attributes
from nanoslip.solver.sliding.record import drops
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.file import Groups, LostGroupsError, make_tree, read_groups, with_texts
from nanoslip.study.dataset.table import (
    CASE,
    CaseRows,
    Selection,
    case_rows,
    select_rows,
    selection_text,
    with_coordinates,
)
from nanoslip.study.tasks.kind import MEMBER


def read_run(root: xr.Dataset, name: str, selection: Selection) -> tuple[xr.Dataset, xr.Dataset]:
    """A case's run in a group, with the group's variables, and the case's scalars.

    Raises KeyError if no case matches, ValueError if several cases match or the case has no run.
    """
    rows = select_rows(root, run_id_name(root, name), selection)
    if len(rows) != 1:
        columns = rows.positions.items()
        counts = {dim: len(set(column)) for dim, column in columns}
        several = [f"{dim} has {count} values" for dim, count in counts.items() if count > 1]
        raise ValueError(f"{selection_text(selection)}: needs to single out one case, but {', '.join(several)}")
    case = next(iter(rows))
    run_id = case[run_id_name(root, name)].values.item()
    slices = cut(root, name, [run_id])
    if slices is None:
        raise ValueError(f"{selection_text(selection)}: this case has no {name}")
    group = read_groups(root)[name]
    # Names and counts lie over all runs of the group: samples are what is left of one run.
    over_runs = [variable for variable in group.variables if name in group[variable].dims]
    group = group.drop_vars(over_runs)
    samples = {dim: runs[0] for dim, runs in slices.items()}
    return group.isel(samples), case


def run_id_name(root: xr.Dataset, name: str) -> str:
    """The variable that names the run of each case. Raises ValueError if a dataset has no such group."""
    id_name = variables.all_groups()[name].id.name
    groups = read_groups(root)
    if not groups:
        raise ValueError(f"this dataset was saved without groups ({name}): .nanoslip.tree.to_netcdf(path) keeps them")
    if name not in groups:
        why = "its campaign leaves that out (see [outputs] and stages), or it was joined with scalars=True"
        raise ValueError(f"this dataset has no group {name}: {why}")
    if id_name not in root:
        raise ValueError(f"this dataset has lost {id_name}: keep it when choosing variables")
    return id_name


def cut(root: xr.Dataset, name: str, ids: list[Any]) -> dict[str, list[slice]] | None:
    """Sample dimension -> slices of the runs with these ids; None if any id is empty. Raises ValueError for an
    unknown id."""
    group = read_groups(root)[name]
    labels = group[name].values.tolist()
    numbers = {label: number for number, label in enumerate(labels)}
    if not all(isinstance(label, str) and label for label in ids):
        return None
    if strangers := [label for label in ids if label not in numbers]:
        raise ValueError(
            f"{name} {strangers[0]}: not in the group of this dataset: join datasets with nanoslip.concat, "
            f"not xarray's functions"
        )
    runs = [numbers[label] for label in ids]
    boundaries = variables.windows(group, variables.all_groups()[name])
    return {sample: _run_slices(starts, runs) for sample, starts in boundaries.items()}


def _run_slices(starts: NDArray[np.int64], runs: Iterable[int]) -> list[slice]:
    """The part of a sample dimension that each run takes. starts: of every run, then the end of the last one."""
    return [slice(int(starts[run]), int(starts[run + 1])) for run in runs]


def lay_along_si(root: xr.Dataset) -> xr.Dataset:
    """A dataset whose cases lie along the lengths and loads in SI, `normal_load_si` for `normal_load`. Raises ValueError."""
    names = {name: twin.name for name, twin in variables.si_coordinates().items()}
    twins = {name: twin for name, twin in names.items() if twin in root.coords}
    if not twins:
        raise ValueError("si = True: lengths and loads in SI need a campaign with [scales]")
    along = {name: twin for name, twin in twins.items() if name in root.dims}
    dataset = root.swap_dims(along)
    # `swap_dims` makes a dataset that does not know how to close its file.
    dataset.set_close(root.close)
    return dataset


# What the members of each case have, behind the means.


def read_members(rows: CaseRows, name: str) -> list[NDArray[Any]]:
    """Members' values of a number for each row, (members,) each: empty for a row without a result, and a single value
    for parameters and other numbers that do not differ between members."""
    try:
        groups = read_groups(rows.root)
    # A dataset of numbers alone, as that of joined campaigns.
    except LostGroupsError:
        groups = Groups({})
    for group_name, group in variables.all_groups().items():
        members = groups.get(group_name)
        if members is None or MEMBER not in group.samples or name not in members or not rows.has(group.id.name):
            continue
        starts = variables.windows(members, group)[MEMBER]
        labels = members[group_name].values.tolist()
        numbers = {label: number for number, label in enumerate(labels)}
        ids = rows.values(group.id.name).tolist()
        runs = [numbers.get(label) for label in ids]
        values = members[name].values
        return [_member_values(values, starts, run) for run in runs]
    return [np.array([value]) for value in rows.values(name)]


def _member_values(values: NDArray[Any], starts: NDArray[np.int64], run: int | None) -> NDArray[Any]:
    """The values of the members of a run; none without a run."""
    if run is None:
        return values[:0]
    return values[starts[run] : starts[run + 1]]


# `dataset.nanoslip`: records, trajectories, contacts and events of a dataset, each with its case's scalars.

FRICTION = ("event_force_before", "event_force_after")
"""Either side of the drop of an event."""


class Accessor:
    """Ways to the groups of a dataset of `nanoslip.open`, `nanoslip.run` or `nanoslip.concat`, or of a selection from
    it.

    selection: values of coordinates, `intrinsic_friction=0.5, radius=[50.0, 200.0]`.
    Results have the scalars of their case as variables, its parameters as coordinates. All methods raise KeyError if
    no case matches; ValueError without such data or groups, or if several cases match.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = with_texts(dataset)

    def __repr__(self) -> str:
        return "\n".join(f"{name}: {text}" for name, text in _facts(self._dataset))

    def _repr_html_(self) -> str:
        """Summary for notebooks: title, cases, main numbers and provenance of the dataset."""
        rows = (f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in _facts(self._dataset))
        return f"<table>{''.join(rows)}</table>"

    @property
    def tree(self) -> xr.DataTree:
        """The dataset with all its groups, as `xr.open_datatree` gives it of a file; `tree.to_netcdf(path)` keeps all of it."""
        return make_tree(self._dataset)

    def sel(self, **selection: Any) -> xr.Dataset:
        """The cases that are selected, as by xarray's `sel`; values may have units, `normal_load="0.2 N"`."""
        return with_coordinates(self._dataset, selection)

    def record(self, **selection: Any) -> xr.Dataset:
        """The friction record of a case over `event`, numbered from 1, with the coordinate `displacement`, and
        `event_drop`.

        >>> data.nanoslip.record(radius=200).event_force_after.plot(x="displacement")  # doctest: +SKIP
        """
        run, case = read_run(self._dataset, "record", selection)
        events = _dropping(_add_case(run, case))
        return events.assign_coords(event=_numbers(run.sizes["event"]))

    def teeth(self, **selection: Any) -> xr.Dataset:
        """F/W of a case as a line over `point`, with the coordinate `displacement`: both sides of each drop of its
        record.

        Start and end are included if the case has a single member; for several members a dataset has only means of
        both.
        """
        run, case = read_run(self._dataset, "record", selection)
        # Before and after in turn, at one displacement: each drop is a vertical line.
        sides = [run[name].values for name in FRICTION]
        force = np.column_stack(sides).ravel()
        displacement = np.repeat(run["displacement"].values, 2)
        if case.get(variables.MEMBERS.name, 1) == 1:
            names = ("initial_force", "final_force", "final_displacement")
            start, end, last = (case[name].item() for name in names)
            force = np.concatenate(([start], force, [end]))
            displacement = np.concatenate(([0.0], displacement, [last]))
        words = {"long_name": "friction force over load", "units": "1", "symbol": "F/W"}
        along = ("point", displacement, run["displacement"].attrs)
        forces = {"friction_force": ("point", force, words)}
        line = xr.Dataset(forces, {"displacement": along})
        return _add_case(line, case)

    def events(self, **selection: Any) -> xr.Dataset:
        """All events of all cases that are selected over `event`: one long table, for `to_dataframe()`.

        The cases' parameters that vary are coordinates along `event`, as are `case_id` and the number in the record,
        `event_number`. Cases without a record have no rows.
        """
        return _dropping(self._join_runs("record", "event", selection))

    def event_sizes(self, size: str = "slips", **selection: Any) -> xr.Dataset:
        """A size of the events of all members of a case, in bins of equal ratio, over `bin` with the coordinate
        `bin_middle`.

        size: slips, extent, drop, energy or step. Needs a campaign with `[outputs] statistics`.
        """
        run, case = read_run(self._dataset, "event_sizes", selection)
        if size not in SIZES:
            raise KeyError(f"size = {size!r}: needs one of {', '.join(SIZES)}")
        number = list(SIZES).index(size)
        bins = np.flatnonzero(run["bin_of"].values == number)
        return _add_case(run.isel(bin=bins).drop_vars("bin_of"), case)

    def trajectory(self, **selection: Any) -> xr.Dataset:
        """The motion of the pin of a case and drive over `sample` with the coordinate `time`; its slips over
        `slip_phase`."""
        return _add_case(*read_run(self._dataset, "trajectory", selection))

    def samples(self, **selection: Any) -> xr.Dataset:
        """All samples of the motion in all cases and drives that are selected over `sample`: one long table, as `events`."""
        return self._join_runs("trajectory", "sample", selection)

    def path(self, **selection: Any) -> xr.Dataset:
        """The path of pin and load of a case: F/W over `path_point` with `path_displacement`, its legs over
        `turn`."""
        return _add_case(*read_run(self._dataset, "path", selection))

    def paths(self, **selection: Any) -> xr.Dataset:
        """All points of the paths of all cases that are selected over `path_point`: one long table, as `events`."""
        return self._join_runs("path", "path_point", selection)

    def contact(self, event: int | None = None, **selection: Any) -> xr.Dataset:
        """Pressure, shear, slip and gap of a case's surface nodes, with the coordinate `x`.

        event: number of the event after which the contact is shown; 0 is initial contact. None: all stored contacts,
            over `event` if there are several.
        """
        return self._node_run("contact", event, selection)

    def row(self, **selection: Any) -> xr.Dataset:
        """Contact of a case after all its events; on a plane of nodes the row with the largest pressure."""
        seen = self.contact(**selection)
        if "y" not in seen.coords or not np.ptp(seen["y"].values):
            return seen
        pressure = seen["pressure"].transpose(..., "contact_node").values
        y = seen["y"].values
        # Of all events and members, at each node.
        largest = pressure.reshape(-1, len(y)).max(axis=0)
        row = y[int(largest.argmax())]
        return seen.isel(contact_node=np.flatnonzero(y == row))

    def interior(self, event: int | None = None, **selection: Any) -> xr.Dataset:
        """Displacements and stresses of the nodes inside a case's slab, with the coordinates `x` and `z`; `event` as
        in `contact`."""
        return self._node_run("interior", event, selection)

    def _node_run(self, name: str, event: int | None, selection: Selection) -> xr.Dataset:
        run, case = read_run(self._dataset, name, selection)
        dim = f"{name}_node"
        of_nodes = run["event"].values
        # Nodes follow each other event by event.
        there = list(dict.fromkeys(of_nodes.tolist()))
        if event is not None and event not in there:
            raise KeyError(f"event = {event}: this case has its {name} after events {', '.join(map(str, there))}")
        wanted = there if event is None else [event]
        nodes = run.drop_vars("event")
        places = [np.flatnonzero(of_nodes == number) for number in wanted]
        parts = [nodes.isel({dim: places_of_event}) for places_of_event in places]
        if len(parts) == 1:
            return _add_case(parts[0].assign_coords(event=wanted[0]), case)
        # The same nodes after each event: their places are taken from the first, not compared.
        over = xr.concat(parts, "event", coords="minimal", compat="override", data_vars="all")
        events = ("event", wanted, run["event"].attrs)
        return _add_case(over.assign_coords(event=events), case)

    def _join_runs(self, name: str, sample: str, selection: Selection) -> xr.Dataset:
        """Concatenate the runs of a group, with the parameters that vary and the number within a run as coordinates."""
        rows = select_rows(self._dataset, run_id_name(self._dataset, name), selection)
        ids = rows.values(run_id_name(self._dataset, name))
        # Of this type also without a case: numpy takes an empty list for floats, which are no mask.
        has_run = [isinstance(label, str) and label != "" for label in ids]
        here = np.array(has_run, np.bool_)
        group = read_groups(self._dataset)[name]
        names = [variable for variable in group.variables if group[variable].dims == (sample,)]
        if not names:
            raise ValueError(f"this dataset has no {sample}s: its campaign leaves them out (see [outputs])")
        run_ids = ids[here].tolist()
        runs = cut(self._dataset, name, run_ids) or {}
        slices = runs.get(sample, [])
        counts = [run.stop - run.start for run in slices]
        stretches = [np.arange(run.start, run.stop) for run in slices]
        # An empty array first: numpy does not concatenate none.
        places = np.concatenate([np.arange(0), *stretches])
        table = group[names].isel({sample: places})
        further = [coordinate for coordinate in table.coords if coordinate not in names]
        table = table.drop_vars(further)
        labels: dict[str, Any] = {}
        for parameter in _varying_labels(self._dataset):
            if rows.has(parameter):
                values = np.repeat(rows.values(parameter)[here], counts)
                labels[parameter] = (sample, values, self._dataset[parameter].attrs)
        by_run = map(_numbers, counts)
        numbers = np.concatenate([np.arange(0), *by_run])
        labels[f"{sample}_number"] = (sample, numbers, {"long_name": f"number of the {sample}"})
        return table.assign_coords(labels)


def _varying_labels(root: xr.Dataset) -> list[str]:
    """Parameters that differ between cases or drives, and names of these."""
    names = {*variables.parameters(), variables.DRIVE_NAME.name, "case_id", CASE}
    labels = [name for name in map(str, root.coords) if name in names]
    return [name for name in labels if root[name].dims]


xr.register_dataset_accessor("nanoslip")(Accessor)  # type: ignore[no-untyped-call]

MAIN: Final = ("static_friction", "kinetic_friction", "plateau_mean", "contact_half_width")
"""Numbers that a dataset is introduced with."""


def _facts(root: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Summary of a dataset or a selection: name and text of each fact."""
    yield "campaign", str(root.attrs.get("title", "no dataset of nanoslip"))
    for kind, (ending, *_) in variables.OUTCOMES.items():
        if ending.name in root:
            outcomes = root[ending.name]
            counts = Counter(outcomes.values.ravel().tolist())
            sizes = outcomes.sizes.items()
            along = ", ".join(f"{dim} ({size})" for dim, size in sizes if size > 1)
            words = ", ".join(f"{count} {word}" for word, count in counts.most_common())
            what = f"{outcomes.size} ({words})"
            yield f"{kind}s of cases" if kind else "cases", f"{what} along {along}" if along else what
    for name in MAIN:
        if name in root and bool(root[name].notnull().any()):
            extremes = (root[name].min(), root[name].max())
            # A number that all cases share is written once.
            ends = dict.fromkeys(f"{float(end):.4g}" for end in extremes)
            unit = str(root[name].attrs.get("units", "1"))
            yield name, " to ".join(ends) + ("" if unit == "1" else f" {unit}")
    software = variables.SOFTWARE[0].name
    try:
        groups = [name for name in read_groups(root) if name != software]
        yield "groups", ", ".join(groups) or "none"
    except LostGroupsError:
        yield "groups", "lost"
    facts = {"by": "creator_name", "licence": "license", "nanoslip": "nanoslip_version", "commit": "source_commit"}
    for name, key in facts.items():
        if root.attrs.get(key):
            yield name, str(root.attrs[key])


def _dropping(run: xr.Dataset) -> xr.Dataset:
    """Events with the drop of friction force in each."""
    before, after = (run[name].values for name in FRICTION)
    losses = ("event", drops(before, after), attributes(variables.EVENT_DROP))
    return run.assign({variables.EVENT_DROP.name: losses})


def _add_case(run: xr.Dataset, case: xr.Dataset) -> xr.Dataset:
    """A run with its case's parameters as coordinates, its scalars as variables."""
    apart = run.variables.keys() | variables.run_names()
    scalars = {name: variable for name, variable in case.variables.items() if name not in apart}
    labels = [name for name in scalars if name in case.coords]
    with_case = run.assign(scalars).set_coords(labels)
    # A run is no dataset with groups: the source in its encoding would lead to those of the file.
    with_case.encoding = {}
    return with_case


def _numbers(count: int) -> NDArray[np.int64]:
    return np.arange(1, count + 1)


# A dataset as one flat table: a row for each case (and drive), or for each event or sample; parameters first, then numbers.


@dataclass(frozen=True, slots=True)
class Column:
    """One variable over all rows."""

    name: str
    units: str
    """Empty where it has none: words, names, switches."""
    meaning: str
    values: list[Any]


_TABLES: Final = {"records": Accessor.events, "trajectories": Accessor.samples, "paths": Accessor.paths}
"""Tables of runs, by the meaning of their rows."""


def case_columns(root: xr.Dataset, table: str | None = None) -> list[Column]:
    """Every parameter and scalar of a dataset over its cases, or over its cases and drives where it has drives.

    table: of _TABLES, for every event of every friction record, or every sample of every drive or every point of
        every path. Raises ValueError without them.
    """
    if table:
        return _long(_TABLES[table](Accessor(root)))
    rows = case_rows(root)
    names = dict.fromkeys([*rows.sizes, *root.coords, *root.data_vars])
    runs = variables.run_names()
    columns = [name for name in names if rows.has(name) and name not in runs]
    return [_column(root[name], rows) for name in columns]


def _long(table: xr.Dataset) -> list[Column]:
    """The runs of a group: whose they are, the number within a run, then the group's own columns."""
    columns = {name for group in variables.all_groups().values() for name in group.columns}
    labels = [name for name in table.coords if name not in (*columns, *table.dims)]
    names = dict.fromkeys([*labels, *table.coords, *table.data_vars])
    rows = case_rows(table, str(labels[0]))
    return [_column(table[name], rows) for name in names if name not in table.dims]


def _column(values: xr.DataArray, rows: CaseRows) -> Column:
    units = values.attrs.get("units", "")
    meaning = values.attrs.get("long_name", "")
    cells = rows.values(values.variable).tolist()
    return Column(str(values.name), units, meaning, cells)
