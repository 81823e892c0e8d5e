"""`dataset.nanoslip`: records, trajectories, contacts and events of a dataset, each with its case's scalars."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.parameter import attributes
from nanoslip.solver.sliding.record import drops
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.study.dataset.access.selection import Selection, cut, id_of, places, run_of
from nanoslip.study.dataset.groups import groups_of, tree_of
from nanoslip.study.dataset.variables import DRIVE_NAME, EVENT_DROP, all_groups, parameters

FRICTION = ("event_friction_before", "event_friction_after")
"""Either side of the drop of an event."""


class Accessor:
    """Ways to the groups of a dataset of `nanoslip.open`, `nanoslip.run` or `nanoslip.concat`, or of a selection of one.

    selection: what singles out the cases, by names of coordinates: `intrinsic_friction=0.5, radius=[50.0, 200.0]`.
    What is returned carries the scalars of its case as variables and its parameters as coordinates. It is read when it is used.

    All raise KeyError where no case is like that, ValueError where the dataset has nothing of the sort, has lost its groups,
    or where several cases are like that and one is asked for.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

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
        ends = {name: case[name].values.item() for name in ("initial_friction", "final_displacement", "final_friction")}
        moved = np.repeat(run["displacement"].values, 2)
        force = np.column_stack([run[name].values for name in FRICTION]).ravel()
        line = {
            "displacement": np.concatenate(([0.0], moved, [ends["final_displacement"]])),
            "friction_force": np.concatenate(([ends["initial_friction"]], force, [ends["final_friction"]])),
        }
        words = {"long_name": "friction force over load", "units": "1", "symbol": "F/W"}
        found = xr.Dataset(
            {"friction_force": ("point", line["friction_force"], words)},
            {"displacement": ("point", line["displacement"], run["displacement"].attrs)},
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

    def contact(self, event: int | None = None, **selection: Any) -> xr.Dataset:
        """Pressure, shear, slip and gap of the surface nodes of one case, with the coordinate `x`.

        event: of the record, after which the contact is seen; 0 is initial contact. None: all that there are, over `event`
            where they are several.
        """
        return self._seen("contact", event, selection)

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
        """The runs of a group one behind the other, with the parameters that vary and the number within a run as coordinates."""
        found = places(self._dataset, id_of(self._dataset, name), selection)
        ids = found.values(id_of(self._dataset, name))
        here = np.array([isinstance(each, str) and each != "" for each in ids], np.bool_)
        group = groups_of(self._dataset)[name]
        names = [each for each in group.variables if group[each].dims == (sample,)]
        if not names:
            raise ValueError(f"this dataset has no {sample}s: its campaign leaves them out (see [outputs])")
        slices = (cut(self._dataset, name, ids[here].tolist()) or {}).get(sample, [])
        counts = [each.stop - each.start for each in slices]
        table = group[names].isel({sample: _concatenated([np.arange(each.start, each.stop) for each in slices])})
        table = table.drop_vars([each for each in table.coords if each not in names])
        varying = {each: np.repeat(found.values(each)[here], counts) for each in self._varying(found.dims)}
        labels = {each: (sample, values, self._dataset[each].attrs) for each, values in varying.items()}
        numbers = _concatenated([_numbers(count) for count in counts])
        return table.assign_coords(
            labels | {f"{sample}_number": (sample, numbers, {"long_name": f"number of the {sample}"})}
        )

    def _varying(self, dims: tuple[str, ...]) -> list[str]:
        """Parameters that are not the same in all cases and drives, and what those are called."""
        known = {*parameters(), DRIVE_NAME.name, "case_id", "case"}
        coordinates = self._dataset.coords
        return [
            str(name)
            for name in coordinates
            if name in known and coordinates[name].ndim > 0 and set(coordinates[name].dims) <= set(dims)
        ]


def _dropping(run: xr.Dataset) -> xr.Dataset:
    """Events with what the friction force drops in each."""
    before, after = (run[name].values for name in FRICTION)
    return run.assign({EVENT_DROP.name: ("event", drops(before, after), attributes(EVENT_DROP))})


def _with(run: xr.Dataset, case: xr.Dataset) -> xr.Dataset:
    """A run with its case's parameters as coordinates, its scalars as variables."""
    ids = {group.id.name for group in all_groups().values()}
    scalars = {name: each.variable for name, each in case.data_vars.items() if name not in run and name not in ids}
    labels = {name: each.variable for name, each in case.coords.items() if name not in run}
    found = run.assign(scalars).assign_coords(labels)
    found.encoding = {}
    return found


def _numbers(count: int) -> NDArray[np.int64]:
    return np.arange(1, count + 1)


def _concatenated(parts: list[NDArray[np.int64]]) -> NDArray[np.int64]:
    return np.concatenate(parts) if parts else np.empty(0, np.int64)
