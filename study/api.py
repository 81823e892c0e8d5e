"""Campaigns from Python: compute one on this machine and get its dataset, or open a dataset that is there."""

import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, Literal, TypedDict, Unpack, overload

import scipy
import threadpoolctl
import xarray as xr

from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.parameter import require
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.study import shipped
from nanoslip.study.dataset import access as accessor, file
from nanoslip.study.dataset.collect import collect, losses
from nanoslip.study.dataset.file import dataset_hash, is_current_dataset, load_dataset, write_state
from nanoslip.study.dataset.join import join_datasets
from nanoslip.study.dataset.variables import refuse_taken_names
from nanoslip.study.inference.campaign import make_question
from nanoslip.study.inference.fit import MOST_COMPUTED, Fit, Target
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.checker import read_text
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.observables import KEY, Observable, source_files, stage_need
from nanoslip.study.manifest.parameters import BETWEEN, SMOOTH, file_parameters
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.origin import here
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.report.console import console
from nanoslip.study.report.summary import failure_summary
from nanoslip.study.results.store import Lease, Store, StoreError
from nanoslip.study.run.campaign import Rest, compute_campaign
from nanoslip.study.run.child import Agent
from nanoslip.study.run.dispatch import MeasuredTimes, Watch
from nanoslip.study.run.farm import Farm, ProcessFarm, SerialFarm, sharing
from nanoslip.study.run.journal import Journal
from nanoslip.study.run.launch import Program, processes_started, task_program
from nanoslip.study.run.progress import open_progress
from nanoslip.study.tasks.functions import load_all, read_functions
from nanoslip.study.toml_text import as_toml

AnyPath = str | os.PathLike[str]
Campaign = AnyPath | Mapping[str, Any]
"""A campaign file, the name of a campaign that comes with nanoslip, or the content of a campaign file."""

Source = AnyPath | xr.Dataset
"""A dataset, its path, or the folder it is in."""
Accessor = accessor.Accessor
"""Accessor `.nanoslip` of a dataset; importing it registers it with xarray."""

DICT = Path("campaign")
"""Name in messages of a campaign that is no file. Files that it names are searched in the working folder."""


MeasuredNumbers = Mapping[str, tuple[float, float]]
Vary = Mapping[str, tuple[Any, Any] | None] | Iterable[str]
Fixed = Mapping[str, Any]


Observables = Mapping[str, Callable[..., float]]


class Options(TypedDict, total=False):
    """Options of `run` beside the place."""

    recompute_foreign: bool
    retry: bool
    progress: bool | None
    jobs: int
    observables: Observables


@overload
def run(
    campaign: Campaign, out: AnyPath | None = None, *, comm: None = None, **options: Unpack[Options]
) -> xr.Dataset: ...
@overload
def run(campaign: Campaign, out: AnyPath, *, comm: Any, **options: Unpack[Options]) -> xr.Dataset | None: ...
def run(
    campaign: Campaign,
    out: AnyPath | None = None,
    *,
    recompute_foreign: bool = False,
    retry: bool = False,
    progress: bool | None = None,
    jobs: int = 1,
    observables: Observables = MappingProxyType({}),
    comm: Any = None,
) -> xr.Dataset | None:
    """Compute a campaign and return its dataset.

    campaign: a campaign file, the name of a campaign that comes with nanoslip, or a dict with the keys of a campaign file.
    out: folder of the results, as `nanoslip run --out`; finished tasks are not computed again. None: a temporary folder, and the
        dataset is in memory.
    recompute_foreign: compute results of other software again.
    retry: try failed tasks again.
    progress: print progress on standard error. None: on a terminal and in a notebook.
    jobs: processes, as `nanoslip run -j`: a task that ends its process fails alone. 1: this process itself.
    observables: additional numbers of the user: name of a variable -> function of a FrictionRecord, or of a FrictionRecord
        and the DynamicsResult of a drive over it; in the solver's units. Other processes (jobs, comm) import it by name.
    comm: communicator (mpi4py) whose ranks all call this and share the tasks. Rank 0 returns the dataset, the others None. Needs
        `out`, a folder that all ranks see.

    Raises ManifestError if the campaign is wrong, StoreError if the folder cannot be used or not all was computed, MemoryError if
    tasks need more memory than there is. A failed task is a warning and an outcome of its cases. One of several MPI ranks without
    `comm` computes everything itself, with a warning; with `comm` an error is raised on all ranks.

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
    manifest = read_campaign(campaign)
    if observables or manifest.observables:
        apart = jobs != 1 or comm is not None
        manifest = with_own_numbers(manifest, read_functions(observables, apart=apart))
    plan = make_plan(manifest)
    with ExitStack() as stack:
        folder, farm = _computing(stack, out, jobs, comm)
        if not farm.root:
            return None
        lease = stack.enter_context(Lease(folder, farm.interruption.request))
        show = partial(_observe_progress, progress)
        warn = partial(_warn, 5)
        journal = Journal(folder, "nanoslip.run")
        ended = compute_campaign(
            farm, plan, journal, lease, show, warn, recompute_foreign=recompute_foreign, retry=retry
        )
        if failed := ended.failed + ended.given_up:
            _warn(3, f"{failed} tasks failed, now or before, or needed one that did (see `outcome` and `message`)")
        path, made = folder / file.FILE, dataset_hash(plan.manifest, ended.store)
        # Reading a dataset takes far less than collecting one, but somebody may have changed its file meanwhile.
        if not (is_current_dataset(path, ended.store, made) and file.has_its_bytes(path)):
            collected = collect(plan, ended.store)
            # It sets aside what could not be read.
            ended.store.prepare()
            if lost := losses(path, collected):
                raise StoreError(f"{path}: not replaced: has {'; '.join(lost)}; run again to continue")
            if kept := file.keep_edited(path):
                _warn(3, f"{kept}: the dataset that somebody has changed since it was collected")
            file.write_netcdf(collected, path)
            write_state(path, ended.store, made)
        if out is not None:
            return file.open_dataset(path)
        with file.open_dataset(path) as opened:
            return load_dataset(opened)


def with_own_numbers(manifest: Manifest, numbers: tuple[Observable, ...]) -> Manifest:
    """The manifest with additional numbers, all of which can be computed. Raises ManifestError, InvalidInput."""
    together = replace(manifest, observables=(*manifest.observables, *numbers))
    for number in numbers:
        need = stage_need(number, manifest.stages)
        require(KEY, number.name, not need, need)
    refuse_taken_names(together)
    load_all(together)
    return together


def fit(
    campaign: Campaign,
    numbers: MeasuredNumbers,
    vary: Vary = (),
    fixed: Fixed = MappingProxyType({}),
    out: AnyPath | None = None,
    *,
    points: int = MOST_COMPUTED,
    jobs: int = 1,
    progress: bool | None = None,
) -> Fit:
    """Find the parameters of a campaign that agree with measured numbers, as `nanoslip fit`.

    numbers: variable, symbol, or ratio of two -> (value, ± as standard deviation), as {"mu_s": (0.3, 0.01)}.
    vary: parameters to find -> their ranges; default: the campaign's axes. fixed: other parameters; `drive` names a
        drive.
    out, jobs, progress: as of `run`. points: largest number of points to compute.

    Raises ManifestError, StoreError; ValueError if too few points have the numbers.
    """
    targets = [Target(name, *measured) for name, measured in numbers.items()]
    ranges = vary if isinstance(vary, Mapping) else dict.fromkeys(vary)
    question = make_question(read_campaign(campaign), targets, ranges, fixed)
    question.check(Path("" if out is None else out))
    with ExitStack() as stack:
        folder, farm = _computing(stack, out, jobs)
        lease = stack.enter_context(Lease(folder, farm.interruption.request))
        show, warn = partial(_observe_progress, progress), partial(_warn, 4)

        def compute(plan: Plan) -> Store:
            journal = Journal(folder)
            return compute_campaign(farm, plan, journal, lease, show, warn).store

        return question.answer(compute, folder, points, failure_summary)


def records(campaign: Campaign, **selection: Any) -> list[FrictionRecord]:
    """The friction records of all members of a campaign's case, in the order of members, computed in this process.

    A dataset has only the first member's record, and means over all members. selection: parameters of the case,
    `radius=50.0`.

    Raises ManifestError if the campaign is wrong, KeyError for unknown parameters or without such a case, ValueError
    if several cases match, SolverError if the case cannot be computed.

    >>> import nanoslip
    >>> campaign = {"title": "Peaks", "numerics": {"n_x": 17}, "limits": {"events": 50}, "ensemble": {"members": 3}}
    >>> peaks = [record.highest_force / record.normal_load for record in nanoslip.records(campaign)]
    >>> mean = nanoslip.mean_of(peaks)  # its ± does not contain what longer records would add
    >>> len(peaks), bool(mean.uncertainty > 0.0)
    (3, True)
    """
    from nanoslip.study.tasks.record import record_of_member  # noqa: PLC0415  other calls do without the solver's bodies

    manifest = read_campaign(campaign)
    possible = [campaign_case.case for campaign_case in expand(manifest) if campaign_case.case is not None]
    if strangers := selection.keys() - parameters_of_a_case().keys():
        raise KeyError(f"{sorted(strangers)[0]}: no parameter of a case")
    matching = [case for case in possible if _has_values(case, selection)]
    if not matching:
        raise KeyError(f"no case has {selection}")
    if len(matching) > 1:
        raise ValueError(f"{len(matching)} cases have {selection}: needs to single out one")
    case, ensemble = matching[0], manifest.ensemble
    # Sums depend on the number of threads.
    with threadpoolctl.threadpool_limits(limits=1):
        compliance = surface_compliance(case.slab)
        numbers = range(ensemble.members)
        return [record_of_member(case, compliance, ensemble, number) for number in numbers]


def _has_values(case: Case, selection: Mapping[str, Any]) -> bool:
    return all(case.flat[name] == value for name, value in selection.items())


def _computing(stack: ExitStack, out: AnyPath | None, jobs: int, comm: Any = None) -> tuple[Path, Farm]:
    """The folder of the results, and the farm that computes there: ranks other than 0 have done their share. Raises
    StoreError."""
    if comm is not None and (jobs != 1 or out is None):
        raise ValueError(f"comm with jobs = {jobs!r}, out = {out!r}: needs out, and no jobs")
    if comm is None and (ranks := processes_started()) > 1:
        _warn(4, f"one of {ranks} ranks computes all of it itself: ranks share a run with comm=MPI.COMM_WORLD")
    # scipy's own library brings threads, too: one that is loaded later would keep them.
    _ = scipy.linalg
    # Sums depend on the number of threads.
    stack.enter_context(threadpoolctl.threadpool_limits(limits=1))
    folder = Path(stack.enter_context(TemporaryDirectory()) if out is None else out)
    program = task_program(folder)
    farm = _farm(program, jobs, stack) if comm is None else stack.enter_context(sharing(comm, program))
    # Other ranks work here until rank 0 lets them go; they raise if it ended by an error, so that none of them hangs.
    if not farm.root and farm.serve():
        raise StoreError(f"{folder}: not computed: rank 0 has raised the error")
    return folder, farm


def _warn(level: int, text: str) -> None:
    """Warn the caller of `run`. level: number of frames from there to here."""
    warnings.warn(text, RuntimeWarning, stacklevel=level)


def open(path: AnyPath, *, si: bool = False) -> xr.Dataset:
    """Open a dataset: results.nc, or the folder it is in. Values are read when they are used. Raises StoreError.

    si: lay cases along lengths and loads in m and N, as `.sel(normal_load_si=0.2)`; the scaled ones stay coordinates beside them.
    Raises ValueError without [scales].

    The dataset has the scalars of the cases, its accessor `.nanoslip` (`nanoslip.study.dataset.access`) records, trajectories and
    contacts. Axes with a single value stay dimensions, so `.sel(radius=200.0)` means the same in every campaign.
    """
    location = Path(path)
    if location.suffix == ".toml":
        raise StoreError(f"{path}: a campaign: needs results.nc, which its run writes, or the folder that it is in")
    dataset = file.open_dataset(location / file.FILE if location.is_dir() else location)
    return accessor.lay_along_si(dataset) if si else dataset


def concat(
    sources: Iterable[Source], join: Literal["product", "outer"] = "product", *, scalars: bool = False
) -> xr.Dataset:
    """One dataset, in memory, of the cases of several, with records, trajectories and contacts.

    sources: datasets, paths of results.nc, or folders with one; cases of a full product of axes, or lists of cases, numbered on.
    join: "outer" if cases of the product may be missing (`pending`). Attributes that differ are omitted.
    scalars: join the numbers that all have (with "outer" all numbers), without records, trajectories and contacts: stages and
        outputs may differ. Scales must be the same.

    Raises StoreError if a path is no dataset, ValueError with the differences if they do not fit together.
    """
    if join not in ("product", "outer"):
        raise ValueError(f'join = {join!r}: needs "product" or "outer"')
    if isinstance(sources, str | Path | xr.Dataset):
        raise ValueError(f"sources: needs a list of datasets or paths, and is one {type(sources).__name__}")
    listed = list(sources)
    names, roots = list[str](), list[xr.Dataset]()
    with ExitStack() as stack:
        for number, source in enumerate(listed, 1):
            if isinstance(source, xr.Dataset):
                names.append(f"dataset {number}")
                roots.append(source)
            else:
                names.append(str(source))
                roots.append(stack.enter_context(open(source)))
        return join_datasets(roots, names, holes=join == "outer", scalars=scalars)


def read_campaign(campaign: Campaign) -> Manifest:
    """Read a campaign: a file, the name of a shipped one, or a dict. Raises ManifestError."""
    need = "a file, a shipped campaign's name, or a dict"
    is_known_kind = isinstance(campaign, Mapping | str | os.PathLike)
    require("campaign", campaign, is_known_kind, need)
    if not isinstance(campaign, Mapping):
        return load_manifest(shipped.campaign_file(Path(campaign)))
    content, frames = dict(campaign), dict[str, str]()
    frame: Any = content.get("table")
    # A DataFrame of pandas.
    if hasattr(frame, "to_csv"):
        content["table"], frames["table"] = "table.csv", frame.to_csv(index=False)
    try:
        text = as_toml(content)
    except TypeError as error:
        raise ManifestError.in_file(DICT, remark=str(error)) from None
    beside = {}
    for key, names in _find_files(content).items():
        if key not in frames:
            texts = [read_text(Path(name)) for name in names]
            beside[key] = BETWEEN.join(texts)
    return parse_manifest(DICT, text, beside | frames)


def _farm(program: Program, jobs: int, stack: ExitStack) -> Farm:
    """Farm of this process, or of `jobs` children. It is not entered: Ctrl-C stays Python's, and results are whole files."""
    if jobs == 1:
        return SerialFarm(program.load)
    if not isinstance(jobs, int) or jobs < 1:
        raise ValueError(f"jobs = {jobs!r}: needs a whole number from 1 on")
    agents = [Agent(program, number) for number in range(jobs)]
    for agent in agents:
        stack.callback(agent.close)
        agent.adopt(here())
    return ProcessFarm(agents)


def _find_files(campaign: Mapping[str, Any]) -> dict[str, list[str]]:
    """The files that the content of a campaign names, by the keys that name them; of an axis several."""
    # A dict of Python may hold any type anywhere: nothing is checked yet, and what is no name is refused later on.
    candidates: dict[str, list[Any]] = {"table": [campaign.get("table")]}
    for word, stated in file_parameters().items():
        tables = (campaign.get(table) for table in (stated.table, "axes"))
        values = [table[word] for table in tables if isinstance(table, Mapping) and word in table]
        if values and isinstance(values[0], list):
            values = values[0]
        candidates[word] = [_file_name(value) for value in values]
    files = {}
    for key, names in candidates.items():
        files[key] = [str(name) for name in names if isinstance(name, str | os.PathLike)]
    files["roughness"] = [name for name in files["roughness"] if name != SMOOTH]
    outputs = campaign.get("outputs")
    if isinstance(outputs, Mapping):
        files[KEY] = source_files(outputs.get(KEY))
    return {key: names for key, names in files.items() if names}


def _file_name(value: Any) -> Any:
    """The file of a value that names one, as text or as a table with more about it."""
    return value.get("file") if isinstance(value, Mapping) else value


def _observe_progress(
    progress: bool | None, rest: Rest, ranks: int, measured: MeasuredTimes
) -> AbstractContextManager[Watch]:
    """Show progress if requested, or if standard error is a terminal."""
    errors, tasks = console(stderr=True), rest.tasks
    watched = bool(tasks) and (errors.is_terminal or errors.is_jupyter)
    if watched if progress is None else progress:
        return open_progress(tasks, errors, ranks, measured)
    return nullcontext(Watch())
