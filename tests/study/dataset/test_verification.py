"""A dataset is computed again from itself alone: the same bits after a fresh run, and whatever was changed is named."""

import hashlib
import shutil
from dataclasses import replace

import netCDF4
import pytest

from nanoslip.solver.outcome import UNDONE, Ending
from nanoslip.solver.slab import Slab
from nanoslip.study.dataset import file
from nanoslip.study.dataset import verify as verification
from nanoslip.study.dataset.compare import Verdict
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.origin import computing
from nanoslip.study.plan.grids import Measured, as_text
from nanoslip.study.plan.task import Task
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.compute import run_task
from tests.conftest import SMALL
from tests.study.dataset.verifying import RECORDS, computed, verdicts, verified


def test_a_fresh_run_is_bit_identical_case_by_case(kept, tmp_path):
    findings = verified(kept, tmp_path, run=run_task)
    assert verdicts(findings) == 5 * [Verdict.IDENTICAL]
    assert [each.remark for each in findings] == 5 * [""]
    assert findings[1].label == "intrinsic_friction = 0.25, radius = 50.0, aspect_ratio = 1.0, n_x = 17"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda opened: opened.setncattr("manifest", opened.manifest.replace("0.25", "0.26")), "manifest: not what"),
        (lambda opened: opened.setncattr("manifest_sha256", "00"), "changed after it was written"),
        (lambda opened: opened.delncattr("manifest"), "no dataset of nanoslip"),
        (lambda opened: opened.renameVariable("case_id", "other"), "no dataset of nanoslip"),
        (lambda opened: opened.renameVariable("drive_outcome", "other"), "drive_outcome: missing"),
        (lambda opened: opened.delncattr("nanoslip_format"), "no dataset of nanoslip: it has no attribute"),
        (lambda opened: opened.setncattr("nanoslip_format", 99), "has format 99, of a newer nanoslip"),
    ],
)
def test_what_cannot_be_computed_again_is_one_clear_message(altered, tmp_path, change, said):
    path = altered(change)
    with pytest.raises(StoreError, match=said) as refused:
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


def test_a_dataset_that_lost_bytes_is_refused_by_name(kept, tmp_path):
    path = tmp_path / "short.nc"
    path.write_bytes(kept.read_bytes()[:-20_000])
    with pytest.raises(StoreError, match=r"short\.nc"):
        verified(path, tmp_path)


def test_a_sample_is_spread_evenly_and_is_the_same_every_time(kept, tmp_path):
    assert [verification.sample(range(10), count) for count in (1, 2, 4)] == [(0,), (0, 9), (0, 3, 6, 9)]
    assert verification.sample(range(3), 3) == verification.sample(range(3), 7) == verification.sample(range(3), None)
    findings = verified(kept, tmp_path, count=2)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]
    assert [each.label.split(",")[0] for each in findings[1:]] == [
        "intrinsic_friction = 0.25",
        "intrinsic_friction = 0.5",
    ]
    assert len(Store(tmp_path / "again").finished()) == 1 + 2 + 4


def test_what_is_pending_is_not_computed(tmp_path):
    def late(task: Task) -> bool:
        case = task.case
        return case is not None and (case.radius, task.kind) in ((100.0, "record"), (100.0, "drive"), (50.0, "drive"))

    findings = verified(computed(tmp_path / "part", SMALL, late), tmp_path)
    assert verdicts(findings) == 3 * [Verdict.IDENTICAL]  # all share; two cases of radius 50, without their drives
    assert len(Store(tmp_path / "again").finished()) == 1 + 2


UNTIL_KNOWN = RECORDS.replace("ensemble.members = 1", "target.within = 0.02")


@pytest.mark.parametrize("ending", UNDONE)
@pytest.mark.parametrize(
    ("text", "kind", "number", "cases"),
    [(SMALL, "record", 1, 3), (SMALL, "drive", 3, 4), (UNTIL_KNOWN, "record", 2, 3)],
    ids=["a record", "a drive", "records with a target"],
)
def test_a_failure_that_says_nothing_of_its_case_is_no_disagreement(tmp_path, ending, text, kind, number, cases):
    """Nobody knows whether a task in more time or memory, or killed by nobody, would end otherwise; nor what waits for it."""
    left = [number]

    def fails(task: Task) -> Ending | None:
        if task.kind != kind:
            return None
        left[0] -= 1
        return ending if left[0] == -1 else None

    path = computed(tmp_path / "kept", text, fails=fails)
    with file.reading(path) as found:
        assert ending.value in {
            *found["outcome"].values.ravel(),
            *(found.get("drive_outcome", found.outcome).values.ravel()),
        }
    findings = verified(path, tmp_path / "again")
    assert [each.remark for each in findings] == [""] * len(findings)
    assert verdicts(findings) == (1 + cases) * [Verdict.IDENTICAL]


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
    "members": SMALL.replace("members = 1", "members = 3") + "[heterogeneity]\nspread = 0.1\n",
    "a target": SMALL.replace("ensemble.members = 1", "target = {within = 0.04, of = ['static_friction'], most = 6}"),
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
    for name, content in (
        ("cases.csv", TABLE),
        ("rough.csv", ROUGH),
        ("front.json", FRONT),
    ):
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
    from nanoslip.study.plan import grids as front

    load = front.load_front
    (tmp_path / "new.json").write_text(FRONT)
    anew = replace(load(tmp_path / "new.json"), name="front.json")
    monkeypatch.setattr("nanoslip.study.dataset.collect.load_front", lambda *_: anew)
    monkeypatch.setattr("nanoslip.study.plan.grids.load_front", lambda *_: anew)
    assert verdicts(verified(path, tmp_path)) == 5 * [Verdict.IDENTICAL]


def test_other_software_is_named(altered):
    with file.reading(altered(lambda _: None)) as found:
        assert verification.other_software(found) == ""
    with file.reading(altered(lambda opened: opened.setncattr("numpy_version", "1.0"))) as found:
        said = verification.other_software(found)
    assert "numpy 1.0" in said
    assert said.endswith(f"recomputed by {computing()}")


AXES = "[drive_axes]\nspring_stiffness = [1e5, 2e5]\ndamping_ratio = [0.1, 0.3]\n[outputs]\nfit = false\n"


def test_drives_on_axes_are_recomputed_one_by_one_but_for_those_that_are_pending(tmp_path):
    text = SMALL.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]") + AXES

    def stiff(task: Task) -> bool:
        return task.drive is not None and task.drive.spring_stiffness > 1.5e-3

    for name, leave_out in (("whole", lambda _: False), ("part", stiff)):
        path = computed(tmp_path / name, text, leave_out)
        ran = []

        def run(task, inputs, ran=ran):
            ran.append(task)
            return run_task(task, inputs)

        assert verdicts(verified(path, tmp_path / f"{name} again", run=run)) == 2 * [Verdict.IDENTICAL]
        assert sum(task.drive is not None for task in ran) == (8 if name == "whole" else 4)


def test_another_drive_of_the_axes_is_told(tmp_path):
    """One number of one drive is changed: its case is different, and says in what."""
    text = SMALL.replace("[0.25, 0.5]", "[0.5]").replace("[50.0, 100.0]", "[50.0]") + AXES
    path = computed(tmp_path / "kept", text)
    with netCDF4.Dataset(path, "a") as opened:
        opened["micro_slips"][..., 1, 0, 1] += 1
    findings = verified(path, tmp_path / "again")
    assert verdicts(findings) == [Verdict.IDENTICAL, Verdict.DIFFERENT]
    assert "micro_slips" in findings[1].remark
