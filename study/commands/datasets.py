"""Datasets for commands: a campaign's own, written and printed; a named dataset; one case of a dataset."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from pathlib import Path

import xarray as xr

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.study.commands.plans import command_text, plan_campaign
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import case_layout, collect, coordinates, count_pending, losses
from nanoslip.study.dataset.file import dataset_hash, is_current_dataset, write_state
from nanoslip.study.dataset.table import one_case
from nanoslip.study.dataset.units import read_scales
from nanoslip.study.dataset.variables import explain_means
from nanoslip.study.manifest.cases import CampaignCase, tables
from nanoslip.study.manifest.manifest import Manifest, drive_parameters
from nanoslip.study.manifest.parameters import word_for_symbol
from nanoslip.study.plan.plan import Plan
from nanoslip.study.report import summary
from nanoslip.study.report.console import FAILED, console, counting, note, print_sentences, print_table, whole
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import Store, StoreError


class FewerFinishedError(StoreError):
    """Refusal to replace a dataset by one with fewer finished cases or drives."""


def write_dataset(plan: Plan, store: Store, anew: bool = False, replace: bool = False) -> int:
    """Write the dataset of all stored results, and print it; returns how many outcomes are pending.

    anew: write it even if it exists. replace: write it even if the existing dataset has more finished cases or
        drives.
    Raises FewerFinishedError, StoreError.
    """
    if not anew and print_written(plan.manifest, store):
        return 0
    path = store.folder.parent / file.FILE
    with counting("{} cases collected") as heard:
        collected = collect(plan, store, heard)
    # Compared before anything is written: a dataset with more finished cases stays where it is.
    lost = [] if replace else losses(path, collected)
    if lost:
        campaign, into = plan.manifest.path, path.parent
        run = command_text("run", campaign, into)
        anyway = command_text("collect", campaign, into, "--replace")
        cure = f"{run} computes what is missing, {anyway} writes the dataset without it"
        raise FewerFinishedError(f"{path}: not replaced: has {'; '.join(lost)}; has the campaign changed? {cure}")
    # A file that somebody has changed is worth more than the results that it can be collected from again.
    kept = file.keep_edited(path)
    if kept:
        note(f"{kept}: the dataset that somebody has changed since it was collected", stderr=True)
    file.write_netcdf(collected, path)
    write_state(path, store, dataset_hash(plan.manifest, store))
    _print(collected, path)
    return count_pending(collected)


def print_written(manifest: Manifest, store: Store) -> bool:
    """Print the existing dataset if it is up to date with the results and lacks none; returns whether that is so."""
    path = store.folder.parent / file.FILE
    if is_current_dataset(path, store, dataset_hash(manifest, store)):
        file.require_closed(path)
        # A file that cannot be read is damaged, and written anew.
        with suppress(StoreError), file.reading(path) as dataset:
            if not count_pending(dataset):
                _print(dataset, path)
                return True
    return False


def _print(dataset: xr.Dataset, path: Path) -> None:
    print_summary(dataset)
    note(whole(f"dataset: {path}"))
    mixed = dataset.attrs.get(file.MIXED)
    if mixed:
        note(f"{mixed} (computed_by says which case is whose)")


def print_summary(dataset: xr.Dataset) -> None:
    """Print a dataset's cases, outcomes of its drives with advice, missed targets, and advice of validity flags."""
    has_sizes = any(str(name).endswith("_si") for name in dataset.coords)
    scales = read_scales(dataset.attrs) if has_sizes else None
    # Without messages, as failures have their own lines below the table.
    cases = summary.scalar_table(dataset, why=False, most=summary.MOST_LINES, scales=scales)
    table, alike = summary.factor_out_columns(cases)
    print_table(table)
    # What all rows have in common stands below the table, whatever its width.
    in_all_rows = {*cases.names} - {*table.names}
    shown = [*in_all_rows, *table.shown_names(console().width)]
    print_sentences([*alike, explain_means(dataset, shown), *summary.drive_summary(dataset)])
    print_sentences(summary.failure_summary(dataset).values(), FAILED)
    print_sentences(summary.cautions(dataset))


# A campaign's dataset: from the file that is named, from the campaign's own, or from the results that are there.


@contextmanager
def find_dataset(source: Path, out: Path | None = None) -> Iterator[xr.Dataset]:
    """Open a dataset: a file .nc, a folder with results.nc, or a campaign file.

    A campaign's own results.nc is taken where the campaign has not changed since; else its finished results, collected in
    memory. out: folder of a campaign's results. Raises StoreError, ManifestError.
    """
    if source.is_dir() or source.suffix == Path(file.FILE).suffix:
        with file.reading(source / file.FILE if source.is_dir() else source) as dataset:
            yield dataset
        return
    plan, into = plan_campaign(source), results_folder(source, out)
    if (into / file.FILE).is_file():
        with file.reading(into / file.FILE) as dataset:
            if has_manifest(dataset, plan.manifest):
                yield dataset
                return
    store = Store(into)
    if not store.finished():
        raise StoreError(f"{into}: no results of {source} there: {command_text('run', source, into)} computes them")
    note(f"{into}: no dataset of {source} as it is now: from the results that are finished", stderr=True)
    yield collect(plan, store)


def has_manifest(dataset: xr.Dataset, manifest: Manifest) -> bool:
    """True if a dataset belongs to the campaign file in its present form."""
    return bool(dataset.attrs.get("manifest_sha256") == manifest.sha256)


# KEY=VALUE on the command line, and the one case of a campaign that they single out: `radius=200 n_x=65`.


def assignments(words: Sequence[str]) -> dict[str, str]:
    """Words of a command line, `key=value` each, as a mapping; a key may be a parameter's symbol, or begin with its table.

    Raises Refusal.
    """
    values: dict[str, str] = {}
    for word in words:
        key, sign, value = word.partition("=")
        if not (sign and key and value):
            raise Refusal(f"{word}: needs key=value, as radius=50")
        table, _, name = key.rpartition(".")
        # As in a file, so that a line of it can be typed: `numerics.n_x` or `n_x`.
        owners = [owner for owner, keys in tables().items() if name in keys]
        if table and owners:
            if table not in (owners[0], "axes"):
                raise Refusal(f"{word}: {name} belongs in {owners[0]}")
            key = name
        key = word_for_symbol(key, {**parameters_of_a_case(), **drive_parameters()})
        if key in values:
            raise Refusal(f"{word}: {key} is given twice")
        values[key] = value
    return values


def choose_case(manifest: Manifest, cases: Sequence[CampaignCase], selection: Mapping[str, str]) -> CampaignCase:
    """The one case of a campaign that parameters single out. Raises Refusal."""
    # By an empty dataset of these cases: words mean the same whether anything is computed or not.
    names = [item.name for item in fields(Scales)]
    scales = {name: getattr(manifest.scales, name) for name in names}
    layout = coordinates(manifest, cases, case_layout(manifest))
    empty = xr.Dataset(coords=layout, attrs=scales)
    name = single(empty, selection)["case_id"].item()
    return next(case for case in cases if case.case_id == name)


def error_message(error: KeyError | ValueError) -> str:
    """The message of an error; KeyError's `str` would quote it."""
    return str(error.args[0] if isinstance(error, KeyError) else error)


def single(dataset: xr.Dataset, selection: Mapping[str, str]) -> xr.Dataset:
    """Select the only case of a dataset that matches these parameters. Raises Refusal."""
    try:
        return one_case(dataset, selection)
    except (KeyError, ValueError) as error:
        raise Refusal(error_message(error)) from None
