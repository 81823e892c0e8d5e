"""A dataset is computed again from itself alone: the same bits after a fresh run; what was changed is named with its case."""

import hashlib
import itertools
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from nanoslip.solver.outcome import Ending
from nanoslip.study.dataset import file, verify as verification
from nanoslip.study.dataset.agreement import Verdict
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.texts import NONE
from nanoslip.study.dataset.verify import Finding
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import computing_origin, here
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.kind import order_by_stage
from nanoslip.study.tasks.task import Task, TaskResult
from tests.conftest import SMALL

Change = Callable[[netCDF4.Dataset], None]


Run = Callable[[Task, Mapping[str, TaskResult]], TaskResult]


RECORDS = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")


STEADY = RECORDS.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[100.0, 200.0]").replace("= 17", "= 65")


STEADY = STEADY.replace("events = 200", "presliding = 3.0").replace("members = 1", "members = 3")


DRIVEN = STEADY.replace('"slip"]', '"slip", "dynamics"]').replace("[100.0, 200.0]", "[200.0]")


DRIVEN += '[[drives]]\nname = "a"\nsamples = 200\n'


KNOWN: dict[str, TaskResult] = {}


def once(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task, in this file's tests together once: what is tested is what is made of the results."""
    if task.key not in KNOWN:
        KNOWN[task.key] = run_task(task, inputs)
    return KNOWN[task.key]


def computed(
    folder: Path,
    text: str,
    leave_out: Callable[[Task], bool] = lambda _: False,
    fails: Callable[[Task], Ending | None] = lambda _: None,
) -> Path:
    """The dataset of a campaign; what stands beside it is gone.

    fails: how an attempt at a task ends that leaves no result; what needs it is left out, too.
    """
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_bytes(text.encode())
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    store.prepare()
    lost: set[str] = set()
    for task in order_by_stage(plan.tasks):
        if ending := fails(task):
            by = here().solver
            attempts.add_attempt(
                folder, Attempt(task.key, "a task", ending.value, "why", True, False, by, "rank 0", "2026")
            )
        if ending or not lost.isdisjoint(task.needs):
            lost.add(task.key)
        elif not leave_out(task):
            store.write(once(task, {key: store.read(key) for key in task.needs}))
    file.write_netcdf(collect(plan, store), folder / file.FILE)
    shutil.rmtree(folder / "results")
    for path in folder.iterdir():
        if path.name != file.FILE:
            path.unlink()
    return folder / file.FILE


def verified(path: Path, folder: Path, count: int | None = None, run: Run = once) -> list[Finding]:
    folder.mkdir(exist_ok=True)
    store = Store(folder / "again")
    store.prepare()
    with file.reading(path) as found:
        plan = verification.rebuilt(found, path)
        cases = verification.sample(verification.computed(plan, found), count)
        for task in verification.tasks_in_dataset(plan, cases, found):
            store.write(run(task, {key: store.read(key) for key in task.needs}))
        return list(verification.verify_cases(found, plan, cases, store))


def verdicts(findings: list[Finding]) -> list[Verdict]:
    return [each.verdict for each in findings]


CHANGES = [
    ("surface_stiffness", (0, 1, 0, 0), 1e-6, 2),
    ("events", (1, 1, 0, 0), 1, 4),
    ("record/event_force_after", 270, 1e-7, 2),
    ("record/event_force_after", -1, 1e-7, 4),
    ("record/event_node", 430, 1, 3),
    ("trajectory/sample_position", 41 * 7 + 3, 1e-9, 4),
    ("radius", 0, 1.0, 0),
    ("normal_load", (), 1e-6, 0),
    ("stage_velocity", 0, 1e-6, 0),
]
"""Variable, place and change, and the row of findings that differs."""


def test_a_record_that_is_not_the_cases_is_different(altered, tmp_path):
    """It is lost, or another case's."""

    def alter(opened: netCDF4.Dataset) -> None:
        opened["record_id"][0, 0, 0, 0] = int(str(opened["record/record"][1]), 16)
        opened["record_id"][1, 0, 0, 0] = NONE

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [0, Verdict.DIFFERENT, 0, Verdict.DIFFERENT, 0]
    for finding, key in zip((findings[1], findings[3]), ("case_id", "record_id"), strict=True):
        assert finding.remark.startswith(f"{key}: ")


def _in_no_group(opened: netCDF4.Dataset) -> None:
    opened["record_id"][0, 1, 0, 0] = int("ffffffffffff", 16)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda opened: opened.setncattr("manifest", opened.manifest.replace("0.25", "0.26")), "manifest: not what"),
        (lambda opened: opened.setncattr("manifest_sha256", "00"), "changed after it was written"),
        (lambda opened: opened.delncattr("manifest"), "no dataset of nanoslip"),
        (lambda opened: opened.renameVariable("case_id", "other"), "no dataset of nanoslip"),
        (_in_no_group, "record_id: ffffffffffff"),
        (lambda opened: opened.renameVariable("drive_outcome", "other"), "drive_outcome: missing"),
    ],
)
def test_what_cannot_be_computed_again_is_one_clear_message(altered, tmp_path, change, said):
    path = altered(change)
    with pytest.raises(StoreError, match=said) as refused:
        verified(path, tmp_path)
    assert str(refused.value).startswith(f"{path}: ")


def test_what_is_pending_is_not_computed(tmp_path):
    def late(task: Task) -> bool:
        case = task.case
        return case is not None and (case.radius, task.kind) in ((100.0, "record"), (100.0, "drive"), (50.0, "drive"))

    findings = verified(computed(tmp_path / "part", SMALL, late), tmp_path)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]  # all share; two cases of radius 50, without their drives
    assert len(Store(tmp_path / "again").finished()) == 1 + 2


TABLE = "intrinsic_friction, radius\r\n0.25, 50\r\n0.5, 100\r\n"


LOADS = "load\n0.5\n2.0\n"
ROUGH = "xi, height\n-0.1, 0\n0, 1e-5\n0.1, 0\n"


DESIGNS = {
    "a table": (
        'table = "../far/cases.csv"\n' + RECORDS.replace(RECORDS[RECORDS.index("[axes]") : RECORDS.index("[num")], "")
    ),
    "a zip and a byte order mark": '\ufeffdesign = "zip"\n' + RECORDS,
    "a roughness": RECORDS + '[heterogeneity]\nroughness = "../far/rough.csv"\n[outputs]\nrecords = false\n',
    "measured loads": STEADY + '[interface]\ncontacts = 3\nmeasured_loads = "../far/loads.csv"\n',
    "states": RECORDS.replace("[0.25, 0.5]", "[0.5]")
    + "[outputs]\ntractions = true\ntractions_at = [0, 30]\nsubsurface = true\n",
    "members": SMALL.replace("members = 1", "members = 3").replace("[0.25, 0.5]", "[0.5]")
    + "[heterogeneity]\nspread = 0.1\n",
    "a target": SMALL.replace(
        "ensemble.members = 1", "target = {within = 0.04, of = ['static_friction'], most = 6}"
    ).replace("[50.0, 100.0]", "[50.0]"),
    "scalars alone": SMALL + "records = false\ntrajectory = false\n",
    "contact alone": RECORDS.replace(', "slip"', ""),
    "refused cases": RECORDS.replace("n_x = 17", "n_x = 17\nrows = 4\nscheme = 'biquadratic'\n").replace(
        "radius = [50.0, 100.0]", "initial_contact = ['stick', 'gradual']\npoisson = [0.3, 0.499]"
    ),
}


def test_other_software_is_named(altered):
    with file.reading(altered(lambda _: None)) as found:
        assert verification.other_software(found) == ""
    with file.reading(altered(lambda opened: opened.setncattr("numpy_version", "1.0"))) as found:
        said = verification.other_software(found)
    assert "numpy 1.0" in said
    assert said.endswith(f"recomputed by {computing_origin()}")


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return computed(tmp_path_factory.mktemp("kept"), SMALL)


@pytest.fixture
def altered(kept: Path, tmp_path: Path) -> Callable[[Change], Path]:
    """A copy of the small campaign's dataset after a change."""
    return lambda change: changed_file(shutil.copy(kept, tmp_path / "altered.nc"), change)


def changed_file(path: Path, change: Change) -> Path:
    with netCDF4.Dataset(path, "a") as opened:
        opened.set_auto_mask(False)
        change(opened)
    return path


def test_changed_values_are_different_and_named_with_their_case(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        for name, place, change, _ in CHANGES:
            opened[name][place] = opened[name][place] + change

    findings = verified(altered(alter), tmp_path)
    assert [each is Verdict.DIFFERENT for each in verdicts(findings)] == [True, False, True, True, True]
    for name, *_, row in CHANGES:
        assert name.rpartition("/")[2] in findings[row].remark, name


def test_a_column_along_another_dimension_is_different(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened["record"].renameVariable("event_force_after", "event_force")
        opened["record"].createVariable("event_force_after", "f8", ("record",))[:] = 0.0

    shared, *findings = verified(altered(alter), tmp_path)
    assert "dimensions of record/event_force_after" in shared.remark
    assert [each.verdict for each in findings] == len(findings) * [Verdict.DIFFERENT]
    assert all("event_force_after" in each.remark for each in findings)


def test_changed_words_and_names_are_different_but_last_digits_are_rounding(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened["outcome"][0, 0, 0, 0] = opened["outcome"].flag_meanings.split().index("no_slip")
        opened["record/case_id"][1] = "ffffffffffff"
        opened["message"][1, 0, 0, 0] = 0xFFFFFFFFFFFF
        opened["surface_stiffness"][1, 1, 0, 0] = np.nextafter(opened["surface_stiffness"][1, 1, 0, 0], 1.0)
        opened["mean_step"].units = "m"
        opened.slab_width = 2e-3
        opened.renameVariable("peak_friction", "greatest_friction")

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [*4 * [Verdict.DIFFERENT], Verdict.ROUNDING]
    said = ("units of mean_step", "attribute slab_width", "peak_friction: is missing", "greatest_friction")
    assert all(each in findings[0].remark for each in said)
    assert "outcome: 'no_slip' kept" in findings[1].remark
    assert "case_id: 'ffffffffffff' kept" in findings[2].remark
    assert "message" in findings[3].remark
    assert findings[4].remark.startswith("surface_stiffness by ")


def test_with_another_arithmetic_a_record_is_held_to_what_states_an_uncertainty(tmp_path):
    """A friction of 1e-5 more turns some decisions and moves no mean by much; a fifth more moves the contact, too."""

    def nudged(by: float) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            if task.case is None:
                return run_task(task, inputs)
            case = replace(task.case, intrinsic_friction=task.case.intrinsic_friction * (1.0 + by))
            return run_task(replace(task, case=case), inputs)

        return run

    path = computed(tmp_path / "steady", STEADY)
    assert verdicts(verified(path, tmp_path / "here", run=nudged(1e-5))) == [0, Verdict.DIFFERENT, Verdict.DIFFERENT]
    elsewhere = changed_file(path, _with_another_kernel)
    little, much = (verified(elsewhere, tmp_path / f"{by}", run=nudged(by)) for by in (1e-5, 0.2))
    assert verdicts(little) == [0, Verdict.WITHIN, Verdict.WITHIN]
    assert all("not judged: " in each.remark for each in little[1:])
    assert verdicts(much) == [0, Verdict.DIFFERENT, Verdict.DIFFERENT]
    assert "initial_slips" in much[1].remark  # which precedes sliding
    assert "contact_half_width" in much[2].remark  # friction pulls at its edges


def _with_another_kernel(opened: netCDF4.Dataset) -> None:
    opened.blas = "openblas 0.3.30 SkylakeX"


@pytest.mark.slow
def test_a_drive_may_take_another_path_only_with_another_arithmetic(tmp_path):
    """A step more, and the friction of one sample on the other side of a tooth; μ_k is held."""

    def touched(digits: float, kinetic: float = 1.0) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            result = once(task, inputs)
            if task.kind == "compliance":
                return result
            scalars = {
                name: [value * (1.0 + digits) if isinstance(value, float) else value for value in each]
                for name, each in result.scalars.items()
            }
            arrays = {name: v * (1 + digits) if v.dtype == float else v for name, v in result.arrays.items()}
            if task.kind == "drive":
                scalars["steps"] = [steps + 1 for steps in result.scalars["steps"]]
                scalars["kinetic_friction"] = [kinetic * value for value in scalars["kinetic_friction"]]
                force = arrays["friction_force"]
                arrays["friction_force"] = force * np.where(np.arange(len(force)) == 30, 1.03, 1.0)
            return replace(result, scalars=scalars, arrays=arrays)

        return run

    here = computed(tmp_path / "steady", DRIVEN)
    elsewhere = changed_file(shutil.copy(here, tmp_path / "elsewhere.nc"), _with_another_kernel)
    for number, (path, run, verdict, said) in enumerate(
        (
            (elsewhere, touched(1e-13), Verdict.WITHIN, ["not judged: ", "steps", "the trajectory"]),
            (elsewhere, touched(1e-13, kinetic=1.5), Verdict.DIFFERENT, ["kinetic_friction"]),
            (here, touched(0.0), Verdict.DIFFERENT, ["sample_friction", "steps"]),
        )
    ):
        shared, case = verified(path, tmp_path / f"{number}", run=run)
        assert (shared.verdict, case.verdict) == (Verdict.IDENTICAL, verdict)
        assert all(each in case.remark for each in said)


def test_a_manifest_whose_hash_was_changed_with_it_has_other_cases(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened.manifest = opened.manifest.replace("n_x = 17", "n_x = 33")
        opened.manifest_sha256 = hashlib.sha256(opened.manifest.encode()).hexdigest()

    (found,) = verified(altered(alter), tmp_path, count=1)
    assert found.verdict is Verdict.DIFFERENT
    assert "case_id" in found.remark


def test_a_sample_is_spread_evenly_and_is_the_same_every_time(kept, tmp_path):
    assert [verification.sample(range(10), count) for count in (1, 2, 4)] == [(0,), (0, 9), (0, 3, 6, 9)]
    assert verification.sample(range(3), 3) == verification.sample(range(3), 7) == verification.sample(range(3), None)
    findings = verified(kept, tmp_path, count=2)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]
    assert [each.label.split(", r")[0] for each in findings[1:]] == [f"intrinsic_friction = {mu}" for mu in (0.25, 0.5)]
    assert len(Store(tmp_path / "again").finished()) == 1 + 2 + 4


UNTOLD = {
    "records": (SMALL, "record", {1: Ending.TIMED_OUT, 3: Ending.OUT_OF_MEMORY}, 2),
    "a drive": (SMALL, "drive", {3: Ending.CRASHED}, 4),
    "with a target": (
        RECORDS.replace("ensemble.members = 1", "target.within = 0.02"),
        "record",
        {2: Ending.CRASHED},
        3,
    ),
}


@pytest.mark.parametrize(("text", "kind", "endings", "cases"), UNTOLD.values(), ids=UNTOLD)
def test_a_failure_that_says_nothing_of_its_case_is_no_disagreement(tmp_path, text, kind, endings, cases):
    """Nobody knows whether a task in more time or memory, or killed by nobody, would end otherwise; nor what waits for it."""
    number = itertools.count(1)

    def fails(task: Task) -> Ending | None:
        return endings.get(next(number)) if task.kind == kind else None

    path = computed(tmp_path / "kept", text, fails=fails)
    with file.reading(path) as found:
        words = (found["outcome"].values, found.get("drive_outcome", found["outcome"]).values)
        assert {each.value for each in endings.values()} <= {word for each in words for word in each.ravel()}
    findings = verified(path, tmp_path / "again")
    assert [each.remark for each in findings] == [""] * len(findings)
    assert verdicts(findings) == (1 + cases) * [Verdict.IDENTICAL]


@pytest.mark.everyday(6)
@pytest.mark.parametrize("text", DESIGNS.values(), ids=DESIGNS)
def test_all_that_a_campaign_is_made_of_is_in_its_dataset(tmp_path, text):
    far = tmp_path / "far"
    far.mkdir()
    for name, content in (("cases.csv", TABLE), ("rough.csv", ROUGH), ("loads.csv", LOADS)):
        (far / name).write_bytes(content.encode())
    path = computed(tmp_path / "campaign", text)
    shutil.rmtree(far)
    findings = verified(path, tmp_path)
    assert len(findings) > 2
    assert verdicts(findings) == len(findings) * [Verdict.IDENTICAL]


ONE_CASE = SMALL.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]") + (
    "[drive_axes]\nspring_stiffness = [1e5, 2e5]\ndamping_ratio = [0.1, 0.3]\n"
)


def test_drives_on_axes_are_recomputed_one_by_one_but_for_those_that_are_pending(tmp_path):
    path = computed(tmp_path / "kept", ONE_CASE, lambda task: bool(task.drive and task.drive.spring_stiffness > 1.5e-3))
    drives = []

    def run(task, inputs):
        drives.append(task.drive is not None)
        return run_task(task, inputs)

    assert verdicts(verified(path, tmp_path / "again", run=run)) == 2 * [Verdict.IDENTICAL]
    assert sum(drives) == 4
