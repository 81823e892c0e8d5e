"""Access to a dataset: one case, all of its events, flat tables, several datasets joined into one."""

import difflib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from html import escape
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import NanoslipError
from nanoslip.solver.parameter import attributes
from nanoslip.solver.sliding.record import drops
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.study.dataset.file import FORMAT, LostGroupsError, carrying, groups_of, tree_of, with_texts
from nanoslip.study.dataset.texts import are_texts
from nanoslip.study.dataset.variables import (
    DRIVE_NAME,
    EVENT_DROP,
    OUTCOMES,
    SOFTWARE,
    Group,
    all_groups,
    counts_of,
    parameters,
    run_names,
    windows,
)
from nanoslip.study.manifest.cases import value_of
from nanoslip.study.manifest.parameters import words
from nanoslip.study.plan.task import PENDING

# Selection of cases, and of their records and trajectories, by values of coordinates: `radius=200`.

Selection = Mapping[str, Any]
"""Name of a coordinate -> its value, perhaps as text with a unit (`radius="20 cm"`), or a list of values."""


@dataclass(frozen=True, slots=True)
class Places:
    """Selected cases of a dataset, and the coordinates that identify them."""

    root: xr.Dataset
    dims: tuple[str, ...]
    positions: NDArray[np.int64]
    """(cases, dims)"""

    def __iter__(self) -> Iterator[xr.Dataset]:
        """The scalars of each case with its parameters."""
        along = set(self.dims)
        names = [name for name, each in self.root.variables.items() if set(each.dims) <= along]
        scalars = self.root[names].drop_vars([name for name in self.root.coords if name not in names], errors="ignore")
        for position in self.positions.tolist():
            yield scalars.isel(dict(zip(self.dims, position, strict=True)))

    def values(self, name: str) -> NDArray[Any]:
        """A variable or coordinate over the cases that the selection names."""
        each = self.root[name]
        indices = [self.positions[:, self.dims.index(str(dim))] for dim in each.dims]
        return np.asarray(each.values[tuple(indices)]) if indices else np.full(len(self.positions), each.values)


def places(root: xr.Dataset, name: str, selection: Selection) -> Places:
    """Positions where a variable has the selected coordinates. Raises KeyError if no case has them."""
    along = root[name]
    chosen = xr.DataArray(np.ones(along.shape, np.bool_), dims=along.dims)
    for key, wanted in selection.items():
        if key not in along.coords:
            near = difflib.get_close_matches(key, map(str, along.coords), 1)
            known = f"did you mean {near[0]}?" if near else f"there are {', '.join(map(str, along.coords))}"
            raise KeyError(f"{key}: no coordinate of these cases; {known}")
        coordinate, values = along.coords[key].variable, np.atleast_1d(np.asarray(wanted))
        if values.dtype.kind == "U" and not are_texts(coordinate):
            values = np.array([value_of(key, text, scales_of(root.attrs)) for text in values.tolist()])
        hits = coordinate.to_base_variable().copy(data=np.isin(coordinate.values, _nearest(coordinate.values, values)))
        if not hits.any():
            given, there = ",".join(map(str, np.ravel(wanted))), _some(along.coords[key].values.ravel().tolist())
            raise KeyError(f"{key} = {given}: no such case; there are {there}")
        chosen = chosen & hits
    positions = np.argwhere(chosen.transpose(*along.dims).values)
    if not len(positions):
        raise KeyError(f"{_words(selection)}: no case is all of that")
    return Places(root, tuple(map(str, along.dims)), positions)


NEAR: Final = 1e-9
"""Relative difference by which a number may differ from a coordinate, as 0.3 from 0.1 + 0.2."""


def _nearest(there: NDArray[Any], wanted: NDArray[Any]) -> NDArray[Any]:
    """Wanted values, with the only one of a coordinate that is nearly a number in place of that number."""
    if there.dtype.kind not in "iuf" or wanted.dtype.kind not in "iuf":
        return wanted
    known = np.unique(there)
    near = [known[np.isclose(known, each, rtol=NEAR, atol=0.0)] for each in wanted]
    return np.array([found[0] if len(found) == 1 else each for found, each in zip(near, wanted, strict=True)])


def run_of(root: xr.Dataset, name: str, selection: Selection) -> tuple[xr.Dataset, xr.Dataset]:
    """The run of one case in a group, as it stands there, and the case's scalars.

    Raises KeyError if no case is like that, ValueError if several are or the one has no run.
    """
    found = places(root, id_of(root, name), selection)
    if len(found.positions) != 1:
        several = [
            f"{dim} has {len(set(column))} values"
            for dim, column in zip(found.dims, found.positions.T.tolist(), strict=True)
            if len(set(column)) > 1
        ]
        raise ValueError(f"{_words(selection)}: needs to single out one case, but {', '.join(several)}")
    case = next(iter(found))
    slices = cut(root, name, [case[id_of(root, name)].values.item()])
    if slices is None:
        raise ValueError(f"{_words(selection)}: this case has no {name}")
    group = groups_of(root)[name]
    group = group.drop_vars([each for each in group.variables if name in group[each].dims])
    return group.isel({dim: windows_[0] for dim, windows_ in slices.items()}), case


def id_of(root: xr.Dataset, name: str) -> str:
    """The variable that names the run of each case. Raises ValueError if a dataset has no such group."""
    known = all_groups()[name].id.name
    groups = groups_of(root)
    if not groups:
        raise ValueError(
            f"this dataset was saved without its groups, {name} too: .nanoslip.tree.to_netcdf(path) keeps them"
        )
    if name not in groups:
        raise ValueError(f"this dataset has no group {name}: its campaign leaves that out (see [outputs] and stages)")
    if known not in root:
        raise ValueError(f"this dataset has lost {known}: keep it when choosing variables")
    return known


def cut(root: xr.Dataset, name: str, ids: list[Any]) -> dict[str, list[slice]] | None:
    """Sample dimension -> where the runs of these names are; None if there is none of a name."""
    group = groups_of(root)[name]
    numbers = {label: number for number, label in enumerate(group[name].values.tolist())}
    if not all(isinstance(each, str) and each for each in ids):
        return None
    if strangers := [each for each in ids if each not in numbers]:
        raise ValueError(
            f"{name} {strangers[0]}: not in the group of this dataset: join datasets with nanoslip.concat, "
            f"not xarray's functions"
        )
    return {
        sample: [slice(int(first[numbers[each]]), int(first[numbers[each] + 1])) for each in ids]
        for sample, first in windows(group, all_groups()[name]).items()
    }


def _some(values: Iterable[Any]) -> str:
    found = list(dict.fromkeys(values))
    return ", ".join(map(str, found[:8])) + (", …" if len(found) > 8 else "")


def _words(selection: Selection) -> str:
    return ", ".join(f"{name} = {value}" for name, value in selection.items()) or "no selection"


# One case of a dataset by the values of its parameters, in a manifest's words: with all its drives, or with one of them.


def scales_of(attributes: Mapping[Any, Any]) -> Scales | None:
    """The scales of a dataset, from its attributes; None if these do not state them."""
    try:
        return Scales(**{each.name: float(attributes[each.name]) for each in fields(Scales)})
    except KeyError:
        return None


def one_case(root: xr.Dataset, given: Mapping[str, str]) -> xr.Dataset:
    """One case of a dataset, without dimensions of one value; it may have several drives.

    given: parameter, as manifests or datasets call it -> its value as text, perhaps with a unit.
    Raises KeyError if no case matches, ValueError with the remaining choices if several do.
    """
    found = places(root, _ending(root), {words().get(word, word): text for word, text in given.items()})
    left = {dim: np.unique(column) for dim, column in zip(found.dims, found.positions.T, strict=True)}
    part = root.isel({dim: where if len(where) > 1 else where[0] for dim, where in left.items()})
    if several := [str(dim) for dim in root["case_id"].dims if len(left[str(dim)]) > 1]:
        raise ValueError(f"needs to be one case: give also {'; '.join(_choices(part, several))}")
    return part


def _ending(root: xr.Dataset) -> str:
    """Outcome of drives, or of cases without drives; for cases without results their name."""
    return next((name for kind in ("drive", "") if (name := OUTCOMES[kind][0].name) in root), "case_id")


def _choices(part: xr.Dataset, dims: Iterable[str]) -> list[str]:
    """The parameters in which cases differ along dimensions, each with its values."""
    along = [str(name) for name in part.coords if set(part[name].dims) & set(dims) and name != "case_id"]
    values = {
        name: part[name].to_series().dropna().unique().tolist() for name in along if name != "case" or len(along) == 1
    }
    return [f"{name} = {_some(found)}" for name, found in values.items() if len(found) > 1]


# `dataset.nanoslip`: records, trajectories, contacts and events of a dataset, each with its case's scalars.

FRICTION = ("event_friction_before", "event_friction_after")
"""Either side of the drop of an event."""


class Accessor:
    """Ways to the groups of a dataset of `nanoslip.open`, `nanoslip.run` or `nanoslip.concat`, or of a selection of one.

    selection: values of coordinates, `intrinsic_friction=0.5, radius=[50.0, 200.0]`.
    Results have the scalars of their case as variables, its parameters as coordinates. All methods raise KeyError if no case
    matches; ValueError without such data or groups, or if several cases match instead of one.
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
        return tree_of(self._dataset)

    def record(self, **selection: Any) -> xr.Dataset:
        """The friction record of one case over `event`, numbered from 1, with the coordinate `displacement`, and `event_drop`.

        >>> data.nanoslip.record(radius=200).event_friction_after.plot(x="displacement")  # doctest: +SKIP
        """
        run, case = run_of(self._dataset, "record", selection)
        return _dropping(_with(run, case)).assign_coords(event=_numbers(run.sizes["event"]))

    def teeth(self, **selection: Any) -> xr.Dataset:
        """F/W of one case as a line over `point`: start, both sides of each drop, end; with the coordinate `displacement`."""
        run, case = run_of(self._dataset, "record", selection)
        start, end, last = (case[name].item() for name in ("initial_friction", "final_friction", "final_displacement"))
        sides = np.column_stack([run[name].values for name in FRICTION])
        force = np.concatenate(([start], sides.ravel(), [end]))
        displacement = np.concatenate(([0.0], np.repeat(run["displacement"].values, 2), [last]))
        words = {"long_name": "friction force over load", "units": "1", "symbol": "F/W"}
        found = xr.Dataset(
            {"friction_force": ("point", force, words)},
            {"displacement": ("point", displacement, run["displacement"].attrs)},
        )
        return _with(found, case)

    def events(self, **selection: Any) -> xr.Dataset:
        """All events of all cases that are selected over `event`: one long table, for `to_dataframe()`.

        The cases' parameters that vary are coordinates along `event`, as are `case_id` and the number in the record,
        `event_number`. Cases without a record have no rows.
        """
        return _dropping(self._joined("record", "event", selection))

    def event_sizes(self, size: str = "slips", **selection: Any) -> xr.Dataset:
        """A size of the events of all members of one case in bins of equal ratio, over `bin` with the coordinate `bin_middle`.

        size: slips, extent, drop, energy or step. Of campaigns with `[outputs] statistics`.
        """
        run, case = run_of(self._dataset, "event_sizes", selection)
        if size not in SIZES:
            raise KeyError(f"size = {size!r}: needs one of {', '.join(SIZES)}")
        there = np.flatnonzero(run["bin_of"].values == list(SIZES).index(size))
        return _with(run.isel(bin=there).drop_vars("bin_of"), case)

    def trajectory(self, **selection: Any) -> xr.Dataset:
        """The motion of the pin of one case and drive over `sample` with the coordinate `time`; its slips over `slip_phase`."""
        return _with(*run_of(self._dataset, "trajectory", selection))

    def samples(self, **selection: Any) -> xr.Dataset:
        """All samples of the motion in all cases and drives that are selected over `sample`: one long table, as `events`."""
        return self._joined("trajectory", "sample", selection)

    def path(self, **selection: Any) -> xr.Dataset:
        """The path of pin and load of one case: F/W over `path_point` with `path_displacement`, its legs over `turn`."""
        return _with(*run_of(self._dataset, "path", selection))

    def paths(self, **selection: Any) -> xr.Dataset:
        """All points of the paths of all cases that are selected over `path_point`: one long table, as `events`."""
        return self._joined("path", "path_point", selection)

    def contact(self, event: int | None = None, **selection: Any) -> xr.Dataset:
        """Pressure, shear, slip and gap of the surface nodes of one case, with the coordinate `x`.

        event: of the record, after which the contact is seen; 0 is initial contact. None: all that there are, over `event`
            where they are several.
        """
        return self._seen("contact", event, selection)

    def row(self, **selection: Any) -> xr.Dataset:
        """Contact of one case after all its events; of a plane of nodes the row with the largest pressure."""
        seen = self.contact(**selection)
        if "y" not in seen.coords or not np.ptp(seen["y"].values):
            return seen
        pressure = seen["pressure"].transpose(..., "contact_node").values
        y = seen["y"].values
        return seen.isel(contact_node=np.flatnonzero(y == y[int(pressure.reshape(-1, len(y)).max(axis=0).argmax())]))

    def interior(self, event: int | None = None, **selection: Any) -> xr.Dataset:
        """Displacements and stresses of the nodes inside the slab of one case, with the coordinates `x` and `z`; as `contact`."""
        return self._seen("interior", event, selection)

    def _seen(self, name: str, event: int | None, selection: Selection) -> xr.Dataset:
        run, case = run_of(self._dataset, name, selection)
        dim = f"{name}_node"
        of_nodes = run["event"].values
        there = list(dict.fromkeys(of_nodes.tolist()))
        if event is not None and event not in there:
            raise KeyError(f"event = {event}: this case has its {name} after events {', '.join(map(str, there))}")
        wanted = there if event is None else [event]
        parts = [run.drop_vars("event").isel({dim: np.flatnonzero(of_nodes == each)}) for each in wanted]
        if len(parts) == 1:
            return _with(parts[0].assign_coords(event=wanted[0]), case)
        over = xr.concat(parts, "event", coords="minimal", compat="override", data_vars="all")
        return _with(over.assign_coords(event=("event", wanted, run["event"].attrs)), case)

    def _joined(self, name: str, sample: str, selection: Selection) -> xr.Dataset:
        """Concatenate the runs of a group, with the parameters that vary and the number within a run as coordinates."""
        found = places(self._dataset, id_of(self._dataset, name), selection)
        ids = found.values(id_of(self._dataset, name))
        here = np.array([isinstance(each, str) and each != "" for each in ids], np.bool_)
        group = groups_of(self._dataset)[name]
        names = [each for each in group.variables if group[each].dims == (sample,)]
        if not names:
            raise ValueError(f"this dataset has no {sample}s: its campaign leaves them out (see [outputs])")
        slices = (cut(self._dataset, name, ids[here].tolist()) or {}).get(sample, [])
        counts = [each.stop - each.start for each in slices]
        table = group[names].isel(
            {sample: np.concatenate([np.arange(0), *(np.arange(each.start, each.stop) for each in slices)])}
        )
        table = table.drop_vars([each for each in table.coords if each not in names])
        labels = {
            each: (sample, np.repeat(found.values(each)[here], counts), self._dataset[each].attrs)
            for each in self._varying(found.dims)
        }
        numbers = np.concatenate([np.arange(0), *map(_numbers, counts)])
        labels[f"{sample}_number"] = (sample, numbers, {"long_name": f"number of the {sample}"})
        return table.assign_coords(labels)

    def _varying(self, dims: tuple[str, ...]) -> list[str]:
        """Parameters that differ between cases or drives, and names of these."""
        known = {*parameters(), DRIVE_NAME.name, "case_id", "case"}
        along = {str(name): each.dims for name, each in self._dataset.coords.items() if name in known}
        return [name for name, own in along.items() if own and set(own) <= set(dims)]


xr.register_dataset_accessor("nanoslip")(Accessor)  # type: ignore[no-untyped-call]

MAIN: Final = ("static_friction", "kinetic_friction", "plateau_mean", "contact_half_width")
"""Numbers that a dataset is introduced with."""


def _facts(root: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Summary of a dataset or a selection: name and text of each fact."""
    yield "campaign", str(root.attrs.get("title", "no dataset of nanoslip"))
    for kind, (ending, _) in OUTCOMES.items():
        if ending.name in root:
            counts = Counter(root[ending.name].values.ravel().tolist())
            along = ", ".join(f"{dim} ({size})" for dim, size in root[ending.name].sizes.items() if size > 1)
            what = f"{root[ending.name].size} ({', '.join(f'{count} {word}' for word, count in counts.most_common())})"
            yield f"{kind}s of cases" if kind else "cases", f"{what} along {along}" if along else what
    for name in MAIN:
        if name in root and bool(root[name].notnull().any()):
            ends = dict.fromkeys(f"{float(end):.4g}" for end in (root[name].min(), root[name].max()))
            units = {"1": ""}.get(unit := str(root[name].attrs.get("units", "1")), f" {unit}")
            yield name, " to ".join(ends) + units
    try:
        yield "groups", ", ".join(name for name in groups_of(root) if name != SOFTWARE[0].name) or "none"
    except LostGroupsError:
        yield "groups", "lost"
    facts = {"by": "creator_name", "licence": "license", "nanoslip": "nanoslip_version", "commit": "source_commit"}
    yield from ((name, str(root.attrs[key])) for name, key in facts.items() if root.attrs.get(key))


def _dropping(run: xr.Dataset) -> xr.Dataset:
    """Events with the drop of friction force in each."""
    before, after = (run[name].values for name in FRICTION)
    return run.assign({EVENT_DROP.name: ("event", drops(before, after), attributes(EVENT_DROP))})


def _with(run: xr.Dataset, case: xr.Dataset) -> xr.Dataset:
    """A run with its case's parameters as coordinates, its scalars as variables."""
    apart = run.variables.keys() | run_names()
    own = {name: each for name, each in case.variables.items() if name not in apart}
    found = run.assign(own).set_coords([name for name in own if name in case.coords])
    found.encoding = {}
    return found


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
"""Tables of runs, by what they are rows of."""


def columns_of(root: xr.Dataset, table: str | None = None) -> list[Column]:
    """Every parameter and scalar of a dataset over its cases, or over its cases and drives where it has drives.

    table: of _TABLES, for every event of every friction record, or every sample of every drive or every point of
        every path. Raises ValueError without them.
    """
    if table:
        return _long(_TABLES[table](Accessor(root)))
    ending = root[_ending(root)]
    names = [name for name in (*ending.dims, *root.coords, *root.data_vars) if set(root[name].dims) <= set(ending.dims)]
    return [_column(root[name], ending) for name in dict.fromkeys(names) if name not in run_names()]


def _long(table: xr.Dataset) -> list[Column]:
    """The runs of a group: whose they are, the number within a run, then the group's own columns."""
    own = {name for group in all_groups().values() for name in group.columns}
    labels = [name for name in table.coords if name not in (*own, *table.dims)]
    names = dict.fromkeys([*labels, *table.coords, *table.data_vars])
    return [_column(table[name], table[labels[0]]) for name in names if name not in table.dims]


def _column(values: xr.DataArray, over: xr.DataArray) -> Column:
    attrs = values.attrs
    return Column(str(values.name), attrs.get("units", ""), attrs.get("long_name", ""), values_over(values, over))


def values_over(values: xr.DataArray, over: xr.DataArray) -> list[Any]:
    """Values of a variable at each position of another one, which lies along all its dimensions; in order."""
    laid = values.variable.set_dims(dict(over.sizes))  # type: ignore[no-untyped-call]  # without eighty coordinates
    found: list[Any] = laid.values.ravel().tolist()
    return found


def tallies_over(root: xr.Dataset, name: str, over: xr.DataArray) -> list[dict[str, int]]:
    """Members by word at each position of another variable, the most frequent first; one word where none are counted."""
    counts = {word: values_over(each, over) for word, each in counts_of(root, name).items()}
    found = []
    for place, said in enumerate(values_over(root[name], over)):
        there = {word: int(column[place]) for word, column in counts.items() if column[place]}
        found.append(dict(sorted(there.items(), key=lambda each: -each[1])) if said and there else {str(said): 1})
    return found


# Several datasets as one: scalars side by side, groups one behind the other.

# The variables of several datasets over the union of their axes.


class NotJoinableError(NanoslipError, ValueError):
    """Datasets that cannot be joined; the message names the difference."""


def added_axes(dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]) -> list[str]:
    """Parameters with one value in each dataset, as few as distinguish the cases of all datasets beside their dimensions."""
    single = [name for name in parameters() if all(name in root.coords and not root[name].dims for root in roots)]
    candidates = [name for name in single if name not in dims and len(_values(name, roots)) > 1]
    for count in range(len(candidates)):
        with suppress(NotJoinableError):  # two cases in one place
            _merged(["case_id"], candidates[:count], dims, roots, sources)
            return candidates[:count]
    return candidates


def _merged(
    names: Iterable[str], added: Sequence[str], dims: Sequence[str], roots: Sequence[xr.Dataset], sources: Sequence[str]
) -> xr.Dataset:
    """Variables of all datasets; NaN where no dataset has a place. Raises NotJoinableError if two differ at one place."""
    along = {name: _along(name, added, roots) for name in names}
    found = xr.Dataset()
    for root, source in zip(roots, sources, strict=True):
        labels = {dim: xr.Variable(dim, np.atleast_1d(root[dim].values), root[dim].attrs) for dim in (*added, *dims)}
        variables = {
            name: root[name].variable.set_dims({dim: labels[dim].size for dim in own})  # type: ignore[no-untyped-call]
            for name, own in along.items()
            if name in root.variables
        }
        try:
            found = xr.merge(
                [found, xr.Dataset(variables, labels)], compat="no_conflicts", join="outer", combine_attrs="override"
            )
        except xr.MergeError:
            odd = next(name for name in variables if _conflicts(found, xr.Dataset(variables, labels), name))
            raise NotJoinableError(f"{source}: {odd} differs from that of {sources[0]} in the same cases") from None
    return found.sel({dim: _union(dim, roots) for dim in (*added, *dims)})


def _conflicts(one: xr.Dataset, other: xr.Dataset, name: str) -> bool:
    """True if two datasets have different values of a variable in the same cases."""
    if name not in one:
        return False
    here, there = xr.align(one[name], other[name], join="inner", copy=False)
    return not bool((here.isnull() | there.isnull() | (here == there)).all())


def _along(name: str, added: Sequence[str], roots: Sequence[xr.Dataset]) -> tuple[str, ...]:
    """Dimensions of a variable: all that it has in any dataset, and the axes that are added.

    One value in each dataset stays one if it is the same in all; else it lies along the cases.
    """
    each = [tuple(map(str, root[name].dims)) for root in roots if name in root.variables]
    own = tuple(dict.fromkeys(dim for dims in sorted(each, key=len, reverse=True) for dim in dims))
    if not own and name != "case_id":
        return _along("case_id", added, roots) if len(_values(name, roots)) > 1 else ()
    return (*(each for each in added if each not in own), *own)


def _filled(name: str, values: xr.DataArray, kind: np.dtype[Any]) -> xr.DataArray:
    """A merged variable in its type, with fill values for missing ones, as if not computed."""
    if kind.kind == "O":
        return values.fillna(PENDING if name in {ending.name for ending, _ in OUTCOMES.values()} else "")
    if kind == np.int32:
        values = values.fillna(0)
    return values if bool(values.isnull().any()) else values.astype(kind)


def _union(name: str, roots: Sequence[xr.Dataset]) -> list[Any]:
    """All labels of a dimension, in their order where each dataset has them in order."""
    each: list[list[Any]] = [np.atleast_1d(root[name].values).tolist() for root in roots]
    found = list(dict.fromkeys(label for labels in each for label in labels))
    return sorted(found) if all(labels == sorted(labels) for labels in each) else found


def _values(name: str, roots: Sequence[xr.Dataset]) -> set[Any]:
    """Distinct values of a variable that each dataset has one value of; None for a missing one."""
    return {root[name].item() if name in root.variables else None for root in roots}


_TITLE: Final = "title"
_CASE: Final = "case"
"""The dimension of a list of cases."""


def joined(roots: Sequence[xr.Dataset], sources: Sequence[str], holes: bool = False) -> xr.Dataset:
    """One dataset, in memory, of all that the datasets have. Raises NotJoinableError, LostGroupsError.

    sources: names in messages. holes: whether cases of no dataset may be missing, as pending.
    """
    roots = [with_texts(root) for root in roots]
    _refuse_strangers(roots, sources)
    roots = _numbered(roots)
    dims = list(dict.fromkeys(str(dim) for root in roots for dim in root.dims))
    added = added_axes(dims, roots, sources)
    names = list(dict.fromkeys(str(name) for root in roots for name in root.variables if name not in (*added, *dims)))
    found = _merged(names, added, dims, roots, sources)
    if not holes and (missing := int(found["case_id"].isnull().sum())):
        along = " x ".join(f"{dim} ({size})" for dim, size in found["case_id"].sizes.items())
        raise NotJoinableError(
            f"{', '.join(sources)}: {found['case_id'].size - missing} of {found['case_id'].size} cases of {along} are there: "
            'needs cases that make up a full product, lists of cases (design = "zip" or a table), or join="outer"'
        )
    kinds = {name: np.result_type(*(root[name].dtype for root in roots if name in root.variables)) for name in names}
    found = found.assign({name: _filled(name, found[name], kind) for name, kind in kinds.items()})
    root = found.assign_attrs(_attributes(roots)).set_coords(
        list(dict.fromkeys(n for root in roots for n in root.coords))
    )
    groups = {name: _group(roots, group) for name, group in all_groups().items() if name in groups_of(roots[0])}
    software = SOFTWARE[0].name
    return carrying(root, groups | {software: _software([groups_of(each)[software] for each in roots])})


def shared_scalars(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with the variables alone that all of them have, and with no group but the software."""
    shared = set.intersection(*({*map(str, root.data_vars)} for root in roots)) - run_names() if roots else set()
    kept = [[str(name) for name in root.data_vars if name in shared] for root in roots]
    software = SOFTWARE[0].name
    return [
        carrying(root[names].copy(), {software: groups_of(root)[software]})
        for root, names in zip(roots, kept, strict=True)
    ]


def _refuse_strangers(roots: Sequence[xr.Dataset], sources: Sequence[str]) -> None:
    """Raise NotJoinableError unless all have the same variables and groups."""
    if not roots:
        raise NotJoinableError("no datasets: needs at least one")
    first = roots[0]
    for root, source in zip(roots, sources, strict=True):
        if "case_id" not in root.coords or FORMAT not in root.attrs:
            raise NotJoinableError(f"{source}: no dataset: needs what nanoslip.open or nanoslip.run returned")
        for mine, theirs in ((root.data_vars, first.data_vars), (groups_of(root), groups_of(first))):
            if odd := sorted(map(str, mine.keys() ^ theirs.keys())):
                said = f"{', '.join(odd[:4])}: {'there alone' if odd[0] in mine else f'only in {sources[0]}'}"
                raise NotJoinableError(
                    f"{source}: {said}: needs the same stages and outputs in all campaigns, or scalars=True"
                )
        if (_CASE in root.dims) != (_CASE in first.dims):
            raise NotJoinableError(f"{source}: a list of cases beside a product of axes: needs all of one design")


def _numbered(roots: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The datasets with lists of cases numbered on."""
    first, found = 0, []
    for root in roots:
        count = root.sizes.get(_CASE, 0)
        numbers = {_CASE: (_CASE, np.arange(first, first + count), root[_CASE].attrs)} if count else {}
        found.append(root.assign_coords(numbers))
        first += count
    return found


def _attributes(roots: Sequence[xr.Dataset]) -> dict[str, Any]:
    """Attributes that all share, and all titles."""
    kept = {
        name: value for name, value in roots[0].attrs.items() if all(root.attrs.get(name) == value for root in roots)
    }
    return {**kept, _TITLE: "; ".join(dict.fromkeys(str(root.attrs[_TITLE]) for root in roots))}


def _group(roots: Sequence[xr.Dataset], group: Group) -> xr.Dataset:
    """The runs of one group of all datasets in sequence, shared ones once."""
    known: set[str] = set()
    parts = []
    for root in roots:
        found = groups_of(root)[group.name]
        names = found[group.name].values.tolist()
        kept = [number for number, name in enumerate(names) if name not in known]
        known.update(names)
        within = {
            sample: np.concatenate([np.arange(0), *(np.arange(*first[at : at + 2]) for at in kept)])
            for sample, first in windows(found, group).items()
        }
        parts.append(found.isel({group.name: kept, **within}))
    return _behind(parts)


def _software(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """All software, each once, with how many results stem from it."""
    name, count = (quantity.name for quantity in SOFTWARE[:2])
    whole = _behind(parts)
    names, first, number = np.unique(whole[name].values.astype(str), return_index=True, return_inverse=True)
    found = whole.isel({name: first})
    found[count] = found[count].copy(data=np.bincount(number, whole[count].values, len(names)).astype(np.int64))
    return found


def _behind(parts: Sequence[xr.Dataset]) -> xr.Dataset:
    """Concatenate datasets whose variables lie along one dimension each, along all of these dimensions."""
    found = {
        name: xr.Variable(each.dims, np.concatenate([part[name].values for part in parts]), each.attrs)
        for name, each in parts[0].variables.items()
    }
    return xr.Dataset(found).set_coords(list(parts[0].coords))
