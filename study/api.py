"""Campaigns from Python: compute one in this process and get its dataset, or open a dataset that is there."""

import os
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import scipy
import threadpoolctl
import xarray as xr

from nanoslip.solver.outcome import Outcome
from nanoslip.study import shipped
from nanoslip.study.dataset import access as accessor
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.concatenation import joined
from nanoslip.study.dataset.file import loaded
from nanoslip.study.exit_codes import FAILURES, WRONG_INPUT
from nanoslip.study.manifest.checker import ManifestError, read_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.outlook import shortages
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.plan.task import Task
from nanoslip.study.report.console import console
from nanoslip.study.results.store import Lease, Store, StoreError, merge_shards
from nanoslip.study.run.dispatch import Tally
from nanoslip.study.run.executor import Diary, drop_intermediates, left, unseen
from nanoslip.study.run.farm import SerialFarm
from nanoslip.study.run.journal import Journal, measured_in
from nanoslip.study.run.launch import computing
from nanoslip.study.run.progress import open_progress
from nanoslip.study.toml_text import as_toml

Place = str | os.PathLike[str]
Campaign = Place | Mapping[str, Any]
"""A campaign file, the name of one that comes with nanoslip, or the content of one."""

Source = Place | xr.Dataset
"""A dataset, its path, or the folder it is in."""
Accessor = accessor.Accessor
"""What `.nanoslip` of a dataset is; importing it makes xarray know it."""

DICT = Path("campaign")
"""What messages call a campaign that is no file. Files that it names are looked for in the working folder."""


def run(
    campaign: Campaign,
    out: Place | None = None,
    *,
    recompute_foreign: bool = False,
    retry: bool = False,
    progress: bool | None = None,
) -> xr.Dataset:
    """Compute a campaign in this process and return its dataset.

    campaign: a campaign file, the name of a campaign that comes with nanoslip, or a dict with the keys of a campaign file.
    out: folder of the results, as `nanoslip run --out` uses it: finished tasks are not computed again, and the dataset reads
        its values from results.nc there when they are used. None: a temporary folder, and the dataset is in memory.
    recompute_foreign: compute again what other software computed.
    retry: try again what has failed.
    progress: print progress on standard error. None: on a terminal and in a notebook.

    Raises ManifestError where the campaign is wrong, StoreError where the folder cannot be used or another run is at work there,
    MemoryError where a task needs more memory than this machine has. A task that fails is a warning, and an outcome of its cases.

    >>> import nanoslip
    >>> data = nanoslip.run({
    ...     "title": "Contact under two loads",
    ...     "stages": ["contact"],
    ...     "axes": {"normal_load": [1e-3, 2e-3]},
    ...     "numerics": {"n_x": 17},
    ... })
    >>> data.initial_contact_size.dims[-1], data.outcome.values.ravel().tolist()
    ('normal_load', ['completed', 'completed'])
    """
    plan = make_plan(_manifest(campaign))
    with ExitStack() as stack:
        stack.enter_context(_one_thread())
        folder = Path(stack.enter_context(TemporaryDirectory()) if out is None else out)
        farm = SerialFarm(computing(folder).load)
        lease = stack.enter_context(Lease(folder, farm.interruption.request))
        _compute(farm, plan, folder, recompute_foreign, retry, progress)
        if lease.look():
            raise StoreError(lease.lost)
        path = folder / file.FILE
        file.write(collect(plan, Store(folder)), path)
        if out is not None:
            return file.read(path)
        with file.read(path) as opened:
            return loaded(opened)


def _one_thread() -> threadpoolctl.threadpool_limits:
    """One thread for linear algebra while the context lasts, as sums depend on their number."""
    _ = scipy.linalg  # loads its library, which brings threads of its own: what is loaded later would keep them
    return threadpoolctl.threadpool_limits(limits=1)


def open_dataset(path: Place) -> xr.Dataset:
    """Open a dataset: results.nc, or the folder it is in. Values are read when they are used. Raises StoreError.

    What is returned has the scalars of the cases. Records, trajectories and contacts are asked for by its accessor `.nanoslip`
    (`nanoslip.study.dataset.access`); `xr.open_datatree` of the file has everything.

    Axes of one value stay dimensions: `.sel(radius=200.0)` means the same in every campaign, and `concat` finds where cases
    belong. `.squeeze()` leaves such dimensions out; the accessor does so by itself.
    """
    given = Path(path)
    return file.read(given / file.FILE if given.is_dir() else given)


def concat(sources: Iterable[Source]) -> xr.Dataset:
    """One dataset, in memory, of the cases of several: scalars, records, trajectories, contacts, whatever they have.

    sources: datasets of `open` or `run`, paths of results.nc, or folders with one. Their cases make up a full product of
    their axes and of parameters that each has one value of; or all are lists of cases, which are numbered on. Attributes that
    differ are left out, so `nanoslip verify` has to be asked about the parts.

    Raises StoreError where a path is no dataset, ValueError with what differs where they do not fit together.
    """
    given = list(sources)
    names = [f"dataset {number}" if isinstance(each, xr.Dataset) else str(each) for number, each in enumerate(given, 1)]
    with ExitStack() as stack:
        roots = [each if isinstance(each, xr.Dataset) else stack.enter_context(open_dataset(each)) for each in given]
        return joined(roots, names)


def _manifest(campaign: Campaign) -> Manifest:
    if not isinstance(campaign, Mapping):
        return load_manifest(shipped.campaign_file(Path(campaign)))
    try:
        text = as_toml(campaign)
    except TypeError as error:
        raise ManifestError([f"{DICT}: {error}"]) from None
    return parse_manifest(DICT, text, _files_named_in(campaign))


def _files_named_in(campaign: Mapping[str, Any]) -> dict[str, str]:
    """The texts of the files that a campaign names, by their keys. Raises ManifestError."""
    heterogeneity = campaign.get("heterogeneity")
    roughness = heterogeneity.get("roughness") if isinstance(heterogeneity, Mapping) else None
    named = {"table": campaign.get("table"), "front": campaign.get("front"), "roughness": roughness}
    return {key: read_text(Path(name))[1] for key, name in named.items() if isinstance(name, str | os.PathLike)}


def _compute(
    farm: SerialFarm, plan: Plan, folder: Path, recompute_foreign: bool, retry: bool, progress: bool | None
) -> None:
    store = Store(folder)
    store.prepare()
    for problem in merge_shards(folder):
        warnings.warn(problem, RuntimeWarning, stacklevel=3)
    finished = store.inventory()
    foreign = plan.foreign(finished) if recompute_foreign else {}
    work = left(plan, store.failures(), finished.keys() - foreign.keys(), retry)
    tasks = work.tasks
    if short := shortages(plan, tasks, 1):
        raise MemoryError("\n".join(short))
    journal = Journal(folder, "nanoslip.run")
    if tasks:
        journal.begin(farm.size, farm.unit)
    tally, undone = _run_tasks(farm, tasks, folder, journal, progress)
    journal.computed(tally)
    store.settle()
    failed = tally.crashed + len(work.given_up)
    journal.end(WRONG_INPUT if tally.halt else FAILURES if failed else 0)
    if tally.halt:
        raise StoreError(tally.halt)
    if not tally.interrupted and (missing := unseen(tasks, undone, store)):
        raise StoreError(missing)
    if failed:
        said = f"{failed} tasks failed, now or before, or needed one that did (see `outcome` and `message`)"
        warnings.warn(said, RuntimeWarning, stacklevel=3)
    elif tasks and not tally.interrupted:
        drop_intermediates(plan, store)


def _run_tasks(
    farm: SerialFarm, tasks: Sequence[Task], folder: Path, journal: Journal, progress: bool | None
) -> tuple[Tally, set[str]]:
    """Compute tasks; returns the keys of those that have no result, too.

    The farm is not entered: Ctrl-C stays Python's, and results are whole files.
    """
    errors = console(stderr=True)
    watched = bool(tasks) and (errors.is_terminal or errors.is_jupyter)
    with ExitStack() as stack:
        shown = watched if progress is None else progress
        bar = open_progress(tasks, errors, measured=measured_in(folder)) if shown else None
        diary = Diary(folder, journal.noting(stack.enter_context(bar) if bar else _silent))
        return farm.run(tasks, diary.report, diary.fail), diary.undone


def _silent(_tasks: Sequence[Task], _outcome: Outcome, _seconds: Collection[float]) -> None:
    """Report nothing."""
