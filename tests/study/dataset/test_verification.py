"""A dataset is computed again from itself alone: the same bits after a fresh run, and whatever was changed is named."""

import hashlib
import shutil
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest
import xarray as xr

from solver.slab import Slab
from study.dataset import file, verification
from study.dataset.collect import collect
from study.dataset.comparison import Verdict
from study.dataset.pair import Finding
from study.dataset.store import Store, StoreError
from study.dataset.verification import NotVerifiableError
from study.discretization.front import Measured, as_text
from study.manifest.problems import ManifestError
from study.manifest.reader import load_manifest
from study.origin import here
from study.plan.plan import make_plan
from study.plan.tasks import Task, TaskResult, run_task
from tests.conftest import SMALL

Change = Callable[[netCDF4.Dataset], None]
Run = Callable[[Task, Mapping[str, TaskResult]], TaskResult]
RECORDS = SMALL.split("[[drives]]")[0].replace(', "dynamics"', "")
STEADY = RECORDS.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[100.0, 200.0]")
STEADY = STEADY.replace("n_x = 17", "n_x = 65").replace("events = 60", "events = 1500")

DRIVEN = STEADY.replace('"slip"]', '"slip", "dynamics"]').replace("[100.0, 200.0]", "[200.0]")
DRIVEN += '[[drives]]\nname = "a"\nsamples = 200\n'

KNOWN: dict[str, TaskResult] = {}


def once(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
    """Compute a task, in this file's tests together once: what is tested is what is made of the results."""
    if task.key not in KNOWN:
        KNOWN[task.key] = run_task(task, inputs)
    return KNOWN[task.key]


def computed(folder: Path, text: str, leave_out: Callable[[Task], bool] = lambda _: False) -> Path:
    """The dataset of a campaign; what stands beside it is gone."""
    folder.mkdir(exist_ok=True)
    (folder / "campaign.toml").write_bytes(text.encode())
    plan, store = make_plan(load_manifest(folder / "campaign.toml")), Store(folder)
    store.prepare()
    for task in plan.tasks:
        if not leave_out(task):
            store.write(once(task, {key: store.read(key) for key in task.needs}))
    file.write(collect(plan, store), folder / file.FILE)
    shutil.rmtree(folder / "results")
    for path in folder.iterdir():
        if path.name != file.FILE:
            path.unlink()
    return folder / file.FILE


def verified(path: Path, folder: Path, count: int | None = None, run: Run = once) -> list[Finding]:
    folder.mkdir(exist_ok=True)
    store = Store(folder / "again")
    store.prepare()
    with verification.opened(path) as found:
        plan = verification.rebuilt(found, path)
        cases = verification.sample(verification.computed(plan, found), count)
        for task in verification.tasks_of(plan, cases, found):
            store.write(run(task, {key: store.read(key) for key in task.needs}))
        return list(verification.compare(found, plan, cases, store))


def verdicts(findings: list[Finding]) -> list[Verdict]:
    return [each.verdict for each in findings]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return computed(tmp_path_factory.mktemp("small"), SMALL)


@pytest.fixture
def altered(small: Path, tmp_path: Path) -> Callable[[Change], Path]:
    """A copy of the small campaign's dataset after a change."""

    def alter(change: Change) -> Path:
        path = tmp_path / "altered.nc"
        shutil.copy(small, path)
        with netCDF4.Dataset(path, "a") as opened:
            opened.set_auto_mask(False)
            change(opened)
        return path

    return alter


def test_a_fresh_run_is_bit_identical_case_by_case(small, tmp_path):
    findings = verified(small, tmp_path, run=run_task)
    assert verdicts(findings) == 5 * [Verdict.IDENTICAL]
    assert [each.remark for each in findings] == 5 * [""]
    assert findings[1].label == "intrinsic_friction = 0.25, radius = 50.0, aspect_ratio = 1.0, n_x = 17"


CHANGES: dict[str, tuple[str, Any, float, list[int]]] = {
    "a scalar": ("surface_stiffness", (0, 1, 0, 0), 1e-6, [2]),
    "a count": ("events", (1, 1, 0, 0), 1, [4]),
    "an event's force": ("event_friction_after", 70, 1e-7, [2]),
    "the last event's force": ("event_friction_after", -1, 1e-7, [4]),
    "an event's node": ("event_node", 130, 1, [3]),
    "a trajectory's position": ("sample_position", 41 * 7 + 3, 1e-9, [4]),
    "where a record is": ("record_index", (0, 0, 0, 0), 1, [1]),
    "an axis": ("radius", 0, 1.0, [0]),
    "a constant": ("normal_load", (), 1e-6, [0]),
    "a drive's setting": ("stage_velocity", 0, 1e-6, [0]),
}


@pytest.mark.parametrize(("name", "place", "change", "rows"), CHANGES.values(), ids=CHANGES)
def test_a_changed_value_is_different_and_named_with_its_case(altered, tmp_path, name, place, change, rows):
    def alter(opened: netCDF4.Dataset) -> None:
        opened[name][place] = opened[name][place] + change

    findings = verified(altered(alter), tmp_path)
    assert [number for number, each in enumerate(findings) if each.verdict is Verdict.DIFFERENT] == rows
    named = "record_case_id" if name == "record_index" else name
    assert named in findings[rows[0]].remark


def test_changed_words_are_different_but_advice_is_within_tolerance(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened["outcome"][0, 0, 0, 0] = "no_plateau"
        opened["record_case_id"][1] = "ffffffffffff"
        opened["message"][1, 0, 0, 0] = "do it otherwise"
        opened["mean_step"].units = "m"
        opened.slab_width = 2e-3

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [2, 2, 2, 1, 0]
    assert "units of mean_step" in findings[0].remark
    assert "attribute slab_width" in findings[0].remark
    assert "outcome: 'no_plateau' kept, 'completed' recomputed" in findings[1].remark
    assert "record_case_id" in findings[2].remark
    assert "message" in findings[3].remark


def test_a_last_digit_is_within_tolerance_and_named(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        at = (0, 1, 0, 0)
        opened["surface_stiffness"][at] = np.nextafter(opened["surface_stiffness"][at], 1.0)

    findings = verified(altered(alter), tmp_path)
    assert verdicts(findings) == [0, 0, 1, 0, 0]
    assert findings[2].remark.startswith("surface_stiffness by ")


def test_a_variable_that_is_missing_or_added_is_named(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened.renameVariable("peak_friction", "greatest_friction")

    shared, *_ = verified(altered(alter), tmp_path)
    assert shared.verdict is Verdict.DIFFERENT
    assert "peak_friction: is missing" in shared.remark
    assert "greatest_friction" in shared.remark


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda opened: opened.setncattr("manifest", opened.manifest.replace("0.25", "0.26")), "manifest: not what"),
        (lambda opened: opened.setncattr("manifest_sha256", "00"), "changed after it was written"),
        (lambda opened: opened.delncattr("manifest"), "no dataset of nanoslip"),
        (lambda opened: opened.renameVariable("case_id", "other"), "no dataset of nanoslip"),
        (lambda opened: opened.renameVariable("drive_outcome", "other"), "drive_outcome: missing"),
        (lambda opened: opened.delncattr("nanoslip_format"), "has no format, being older"),
        (lambda opened: opened.setncattr("nanoslip_format", 99), "has format 99: this nanoslip verifies format 2"),
    ],
)
def test_what_cannot_be_computed_again_is_one_clear_message(altered, tmp_path, change, said):
    path = altered(change)
    with pytest.raises(NotVerifiableError, match=said) as refused:
        verified(path, tmp_path)
    assert str(refused.value).startswith(f"{path}: ")


def test_a_manifest_whose_hash_was_changed_with_it_has_other_cases(altered, tmp_path):
    def alter(opened: netCDF4.Dataset) -> None:
        opened.manifest = opened.manifest.replace("n_x = 17", "n_x = 33")
        opened.manifest_sha256 = hashlib.sha256(opened.manifest.encode()).hexdigest()

    findings = verified(altered(alter), tmp_path, count=1)
    assert verdicts(findings) == [Verdict.DIFFERENT]
    assert "case_id" in findings[0].remark


@pytest.mark.parametrize(
    "content", [b"", b"nonsense", b"\x89HDF\r\n\x1a\n" + bytes(200)], ids=["empty", "text", "stub"]
)
def test_another_file_is_refused_by_name(tmp_path, content):
    path = tmp_path / "other.nc"
    path.write_bytes(content)
    with pytest.raises(StoreError, match=r"other\.nc"):
        verified(path, tmp_path)


def test_a_dataset_that_lost_bytes_is_refused_by_name(small, tmp_path):
    path = tmp_path / "short.nc"
    path.write_bytes(small.read_bytes()[:-20_000])
    with pytest.raises(StoreError, match=r"short\.nc"):
        verified(path, tmp_path)


def test_a_sample_is_spread_evenly_and_is_the_same_every_time(small, tmp_path):
    assert [verification.sample(range(10), count) for count in (1, 2, 4)] == [(0,), (0, 9), (0, 3, 6, 9)]
    assert verification.sample(range(3), 3) == verification.sample(range(3), 7) == verification.sample(range(3), None)
    findings = verified(small, tmp_path, count=2)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]
    assert [each.label.split(",")[0] for each in findings[1:]] == [
        "intrinsic_friction = 0.25",
        "intrinsic_friction = 0.5",
    ]
    assert len(Store(tmp_path / "again").finished()) == 1 + 2 + 4


def test_what_is_made_of_several_cases_is_compared_where_all_of_them_were_recomputed(tmp_path, monkeypatch):
    plain = collect

    def with_mean(*arguments: Any) -> xr.Dataset:
        found = plain(*arguments)
        return found.assign(mean_of_radii=found["mean_step"].variable.mean("radius"))

    for module in (verification, sys.modules[__name__]):
        monkeypatch.setattr(module, "collect", with_mean)
    path = computed(tmp_path / "campaign", SMALL)
    assert verdicts(verified(path, tmp_path)) == 5 * [Verdict.IDENTICAL]
    assert verdicts(verified(path, tmp_path / "one", count=1)) == 2 * [Verdict.IDENTICAL]
    with netCDF4.Dataset(path, "a") as opened:
        opened["mean_of_radii"][1, 0, 0] *= 1.001
    findings = verified(path, tmp_path)
    assert verdicts(findings) == [0, 0, 0, 2, 2]
    assert "mean_of_radii" in findings[3].remark
    assert verdicts(verified(path, tmp_path / "one", count=1)) == 2 * [Verdict.IDENTICAL]


def test_what_is_pending_is_not_computed(tmp_path):
    def late(task: Task) -> bool:
        case = task.case
        return case is not None and (case.radius, task.kind) in ((100.0, "record"), (100.0, "drive"), (50.0, "drive"))

    findings = verified(computed(tmp_path / "part", SMALL, late), tmp_path)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]  # all share; two cases of radius 50, without their drives
    assert len(Store(tmp_path / "again").finished()) == 1 + 2


TABLE = "intrinsic_friction, radius\r\n0.25, 50\r\n0.5, 100\r\n"
ROUGH = "xi, height\n-0.1, 0\n0, 1e-5\n0.1, 0\n"
CONTACTS = tuple(0.01 * 1.2**number for number in range(22))
FRONT = as_text(
    {}, CONTACTS, [Measured(Slab(n_x=n_x), n_x / 17.0, tuple(0.2 / n_x for _ in CONTACTS)) for n_x in (17, 33, 65)]
)
DESIGNS = {
    "a table": (
        'table = "../far/cases.csv"\n' + RECORDS.replace(RECORDS[RECORDS.index("[axes]") : RECORDS.index("[num")], "")
    ),
    "a zip": 'design = "zip"\n' + RECORDS,
    "a byte order mark": "\ufeff" + RECORDS,
    "a roughness": RECORDS + '[heterogeneity]\nroughness = "../far/rough.csv"\n[outputs]\nrecords = false\n',
    "a front": 'front = "../far/front.json"\n' + RECORDS,
    "an accuracy": "accuracy = 0.05\n" + RECORDS.replace("n_x = 17", ""),
    "an accuracy from a front": 'accuracy = 0.005\nfront = "../far/front.json"\n' + RECORDS.replace("n_x = 17", ""),
    "states": RECORDS + "[outputs]\ntractions = true\ntractions_at = [0, 30]\nsubsurface = true\n",
    "scalars alone": SMALL + "[outputs]\nrecords = false\ntrajectory = false\n",
    "contact alone": RECORDS.replace(', "slip"', ""),
    "refused cases": RECORDS.replace("n_x = 17", "n_x = 17\nrows = 4\nscheme = 'biquadratic'\n").replace(
        "radius = [50.0, 100.0]", "initial_contact = ['stick', 'gradual']\npoisson = [0.3, 0.499]"
    ),
}


@pytest.mark.parametrize("text", DESIGNS.values(), ids=DESIGNS)
def test_all_that_a_campaign_is_made_of_is_in_its_dataset(tmp_path, text):
    far = tmp_path / "far"
    far.mkdir()
    for name, content in (("cases.csv", TABLE), ("rough.csv", ROUGH), ("front.json", FRONT)):
        (far / name).write_bytes(content.encode())
    path = computed(tmp_path / "campaign", text)
    shutil.rmtree(far)
    findings = verified(path, tmp_path)
    assert len(findings) > 2
    assert verdicts(findings) == len(findings) * [Verdict.IDENTICAL]


def test_a_missing_text_of_a_file_is_named(tmp_path):
    (tmp_path / "front.json").write_text(FRONT)
    path = computed(tmp_path / "campaign", 'front = "../front.json"\n' + RECORDS)
    with netCDF4.Dataset(path, "a") as opened:
        opened.delncattr("manifest_front")
    with pytest.raises(ManifestError, match="front: the text of its file is missing"):
        verified(path, tmp_path)


def test_a_front_that_was_measured_anew_chooses_nothing_and_judges_nothing(tmp_path, monkeypatch):
    path = computed(tmp_path / "campaign", "accuracy = 0.05\n" + RECORDS.replace("n_x = 17", ""))
    from study.discretization import front

    load = front.load_front
    (tmp_path / "new.json").write_text(FRONT)
    anew = replace(load(tmp_path / "new.json"), name="front.json")
    monkeypatch.setattr("study.dataset.collect.load_front", lambda *_: anew)
    monkeypatch.setattr("study.discretization.targets.load_front", lambda *_: anew)
    assert verdicts(verified(path, tmp_path)) == 5 * [Verdict.IDENTICAL]


def test_a_record_on_another_path_is_held_to_what_states_an_uncertainty(tmp_path):
    """A friction of 1e-5 more turns some decisions and moves no mean by much; a fifth more moves them."""

    def nudged(by: float) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            if task.case is None:
                return run_task(task, inputs)
            case = replace(task.case, intrinsic_friction=task.case.intrinsic_friction * (1.0 + by))
            return run_task(replace(task, case=case), inputs)

        return run

    path = computed(tmp_path / "steady", STEADY)
    little = verified(path, tmp_path / "little", run=nudged(1e-5))
    assert verdicts(little) == [0, 1, 1]
    assert all("takes another path" in each.remark for each in little[1:])
    much = verified(path, tmp_path / "much", run=nudged(0.2))
    assert verdicts(much) == [0, 2, 2]
    assert "initial_friction" in much[1].remark  # which precedes sliding
    assert "plateau_mean" in much[2].remark


def test_a_drive_may_take_another_path_only_where_last_digits_moved(tmp_path):
    """As on another processor: a step more, and the friction of one sample on the other side of a tooth; μ_k is held."""
    path = computed(tmp_path / "steady", DRIVEN)

    def touched(digits: float, kinetic: float = 1.0) -> Run:
        def run(task: Task, inputs: Mapping[str, TaskResult]) -> TaskResult:
            result = once(task, inputs)
            if task.kind == "compliance":
                return result
            scalars = {name: value * (1.0 + digits) for name, value in result.scalars.items()}
            arrays = {
                name: values * (1 + digits) if values.dtype == float else values
                for name, values in result.arrays.items()
            }
            if task.kind == "drive":
                scalars["steps"] = result.scalars["steps"] + 1
                scalars["kinetic_friction"] *= kinetic
                arrays["friction_force"] = arrays["friction_force"] * np.where(
                    np.arange(len(arrays["friction_force"])) == 30, 1.03, 1.0
                )
            return replace(result, scalars=scalars, arrays=arrays)

        return run

    moved = verified(path, tmp_path / "moved", run=touched(1e-13))
    assert verdicts(moved) == [0, 1]
    assert "a drive takes another path" in moved[1].remark
    wrong = verified(path, tmp_path / "wrong", run=touched(1e-13, kinetic=1.5))
    assert verdicts(wrong) == [0, 2]
    assert "kinetic_friction" in wrong[1].remark
    still = verified(path, tmp_path / "still", run=touched(0.0))
    assert verdicts(still) == [0, 2]
    assert "sample_friction" in still[1].remark
    assert "steps" in still[1].remark


def test_other_software_is_named(altered):
    with verification.opened(altered(lambda _: None)) as found:
        assert verification.other_software(found) == ""
    with verification.opened(altered(lambda opened: opened.setncattr("numpy_version", "1.0"))) as found:
        said = verification.other_software(found)
    assert "numpy 1.0" in said
    assert said.endswith(f"recomputed by {here()}")
