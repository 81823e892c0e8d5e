"""The cases of the campaign that sets an elastic slab against chains of blocks: their names, and the sizes of their events."""

from typing import Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.sliding.sizes import EventSizes, sizes_of_columns
from nanoslip.study.dataset.access import Accessor

CAMPAIGN: Final = "figures/chain"


def names(dataset: xr.Dataset) -> dict[int, str]:
    """Number of each case -> `slab`, or what a chain's springs are; as mathematics of matplotlib."""
    return {int(number): _name(dataset.sel(case=number)) for number in dataset["case"].values}


def _name(case: xr.Dataset) -> str:
    if str(case["scheme"].item()) != "chain":
        return "slab"
    return f"chain, $k_c/k_l$ = {float(case['coupling_stiffness']):g}"


def plain(name: str) -> str:
    """A name as text."""
    return name.replace("$", "")


def numbers_of(dataset: xr.Dataset, case: int) -> xr.Dataset:
    """The scalars of one case."""
    return dataset.sel(case=case).squeeze()


def steady(dataset: xr.Dataset, case: int) -> xr.Dataset:
    """The events of one case's steady part, those that its statistics are of."""
    run = Accessor(dataset).record(case=case)
    return run.isel(event=run["displacement"].values >= float(run["plateau_start"]))


def steady_sizes(dataset: xr.Dataset, case: int) -> EventSizes:
    """The sizes of the events of one case's steady part."""
    run = steady(dataset, case)

    def column(name: str) -> NDArray[np.float64]:
        return np.asarray(run[name].values)

    return sizes_of_columns(
        column("displacement"),
        run["event_slips"].values,
        run["event_extent"].values,
        column("event_friction_before") - column("event_friction_after"),
        column("event_dissipated"),
        float(run["normal_load"]),
        -np.inf,
    )
