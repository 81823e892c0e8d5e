"""A campaign in shards has every case once, with all that it needs; a batch script is text, and wrong settings are named."""

import math
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.files import Shard
from nanoslip.study.run.batch import (
    Job,
    Site,
    SiteError,
    array_script,
    load_site,
    merge_script,
    parse_time_limit,
    script,
)
from nanoslip.study.run.campaign import part, skippable_tasks, task_blocks
from tests.conftest import ROOT, SMALL

RECORDED = Path(__file__).with_name("job.sh")
JOB = Job(Path("/home/me/my campaigns/streator2022.toml"), Path("/scratch/out"))
SETTINGS = ROOT / "slurm" / "site.toml"


def planned(radii, n_x, members="ensemble.members = 1"):
    axes = f"[axes]\nn_x = {n_x}\nradius = {radii}\nintrinsic_friction"
    text = SMALL.replace("radius = [50.0, 100.0]", "").replace("n_x = 17", "").replace("ensemble.members = 1", members)
    return make_plan(parse_manifest(Path("many.toml"), text.replace("[axes]\nintrinsic_friction", axes), {}))


@pytest.fixture(scope="module")
def plan():
    """Forty-eight cases on two slabs, each with two drives."""
    return planned([50.0 + number for number in range(12)], [17, 33])


def parts(plan, of):
    return [part(plan, Shard(number, of)) for number in range(1, of + 1)]


@pytest.mark.parametrize("of", [1, 2, 5, 48, 60])
def test_every_case_is_in_one_shard_with_all_that_it_needs(plan, of):
    assert [case.case_id for each in parts(plan, of) for case in each.cases] == [case.case_id for case in plan.cases]
    assert {task.key for each in parts(plan, of) for task in each.tasks} == {task.key for task in plan.tasks}
    for each in parts(plan, of):
        keys = {task.key for task in each.tasks}
        assert all(keys.issuperset(task.needs) for task in each.tasks)
        assert {key for tasks in each.case_tasks.values() for key in tasks.values()} <= keys
        assert list(each.tasks) == [task for task in plan.tasks if task.key in keys]  # their order stays
        assert of > 1 or each == plan


def test_shards_cost_about_the_same_and_neighbours_share_a_slab_in_most(plan):
    costs = [sum(task.cost for task in each.tasks) for each in parts(plan, 4)]
    compliances = sum(task.cost for task in plan.tasks if task.kind == "compliance")
    assert max(costs) - min(costs) <= compliances + max(task.cost for task in plan.tasks) + 0.1 * max(costs)
    slabs = [{case.case.slab for case in each.cases if case.case} for each in parts(plan, 6)]
    assert sum(len(each) > 1 for each in slabs) <= 1


@given(weights=st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=40), count=st.integers(1, 50))
def test_no_block_is_empty_that_need_not_be_and_none_is_heavier_than_the_mean_by_more_than_one_weight(weights, count):
    blocks = task_blocks(weights, count)
    assert blocks == sorted(blocks)  # neighbours together
    assert set(blocks) == set(range(min(count, len(weights))))
    heaviest = max(sum(w for w, block in zip(weights, blocks, strict=True) if block == each) for each in set(blocks))
    # Besides it, rounding of sums of forty numbers.
    assert heaviest <= (sum(weights) / min(count, len(weights)) + max(weights)) * (1.0 + 1e-12)


def test_ensembles_of_which_one_costs_most_leave_no_shard_empty():
    """Of four ensembles two share one of three shards."""
    waiting = planned([50.0], [17, 257], "target.within = 0.02")
    assert sorted(len(each.cases) for each in parts(waiting, 3)) == [1, 1, 2]


def test_of_what_was_merged_only_what_a_task_still_reads_is_computed_again(plan):
    everything = {task.key: 0 for task in plan.tasks}
    assert skippable_tasks(plan, {}, everything) == everything
    drive = next(task for task in plan.tasks if task.kind == "drive")
    needed, needs = {drive.key}, {task.key: task.needs for task in plan.tasks}
    for _ in range(3):  # a drive, its record, its compliance
        needed |= {need for key in needed for need in needs[key]}
    without = {key: 0 for key in everything if key != drive.key}
    assert everything.keys() - skippable_tasks(plan, {}, without).keys() == needed
    own = {key: 1 for key in needed if key != drive.key}
    assert skippable_tasks(plan, own, without) == {**without, **own}


def test_the_script_is_the_recorded_one():
    site = Site(
        tasks=8,
        nodes=2,
        partition="main",
        account="friction",
        command="/opt/nanoslip/bin/nanoslip",
        options=("--exclusive",),
        setup=("module load mpich", "export OMP_PLACES=cores"),
    )
    text = script(JOB, site, (ROOT / "slurm" / "job.sh.j2").read_text("utf-8"))
    assert text == RECORDED.read_text("utf-8")
    subprocess.run(["bash", "-n"], input=text, text=True, check=True)


@pytest.mark.parametrize(
    ("site", "requested"),
    [
        (Site(), ["#SBATCH --mem-per-cpu=1300M"]),
        (Site(memory="4G"), ["#SBATCH --mem-per-cpu=4G"]),
        (Site(memory=""), []),
        (Site(options=("--mem=0",)), ["#SBATCH --mem=0"]),
    ],
    ids=["planned", "given", "none", "an option"],
)
def test_the_memory_of_a_rank_is_requested_once(site, requested):
    """1234 MB are rounded up; sbatch refuses two requests."""
    template = (ROOT / "slurm" / "job.sh.j2").read_text("utf-8")
    text = script(replace(JOB, memory=1.234e9), site, template)
    assert [line for line in text.splitlines() if "--mem" in line] == requested
    with pytest.raises(ManifestError, match="memory"):
        Site(memory="much")


def test_an_array_and_the_job_that_merges_it_differ_from_one_job_in_what_they_run_and_what_they_requeue():
    """Each shard has a log of its own; merging takes one process, and is not requeued. The settings are the defaults."""
    site, template = load_site(SETTINGS)
    assert site == Site()
    assert template.startswith("#!/bin/bash\n")
    words, one = "'/home/me/my campaigns/streator2022.toml' --out /scratch/out", script(JOB, site, template)
    for other, changes in (
        (
            array_script(JOB, 12, site, template),
            [
                "#SBATCH --output=/scratch/out/slurm-%A_%a.log",
                "#SBATCH --array=1-12",
                f'srun --mpi=pmi2 --wait=10 nanoslip run {words} --shard "$SLURM_ARRAY_TASK_ID/12"',
                '    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" && sleep 60',
            ],
        ),
        (
            merge_script(JOB, site, template),
            [
                "#SBATCH --ntasks=1",
                f"srun --mpi=pmi2 --wait=10 nanoslip merge {words}",
                '[ "$code" -gt 128 ] && most=0',
                '[ "$code" -eq 99 ] && most=0',
            ],
        ),
    ):
        assert [line for line in other.splitlines() if line not in one.splitlines()] == changes
        subprocess.run(["bash", "-n"], input=other, text=True, check=True)


@pytest.mark.parametrize(
    ("odd", "needed"),
    [
        *((odd, "one line without control characters") for odd in ("a\nrm -r .", "a\rb", "a\x1bb", "a\u2028b")),
        ("a\\b", "without backslashes"),
    ],
)
def test_no_name_is_a_line_of_the_script_or_has_a_backslash_which_sbatch_takes_out(odd, needed):
    for campaign, out in ((f"{odd}.toml", "out"), ("mine.toml", odd), (f"{odd}/mine.toml", "out")):
        with pytest.raises(SiteError, match=f"needs to be {needed}") as caught:
            Job(Path(campaign), Path(out))
        assert len(str(caught.value).splitlines()) == 1


def test_a_percent_sign_in_a_name_is_no_pattern_of_slurm_where_its_log_is_named():
    text = script(Job(Path("50%j.toml"), Path("/out/50%x")), Site(), "{{ name }} {{ log }} {{ run }}")
    assert text == "50%j /out/50%%x/slurm-%j.log nanoslip run 50%j.toml --out /out/50%x"


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("task = 4", "task: unknown; needs one of template, tasks"),
        ("tasks = 0", "tasks = 0: needs at least 1"),
        ("restarts = -1", "restarts = -1: needs at least 0"),
        ("tasks = true", "tasks = true: needs a whole number"),
        ('nodes = "two"', 'nodes = "two": needs a whole number'),
        ("time = 60", "time = 60: needs a text"),
        ('time = "1 h"', 'time = "1 h": needs a time'),
        ('mpi = "pmi9"', 'mpi = "pmi9": needs pmi2'),
        ('time = "00:01:30"', 'warning = 90: needs less than time = "00:01:30"'),
        ("setup = [1]", r"setup = \[1\]: needs a list of texts"),
        ("tasks = ", "Invalid value"),
        (r'time = "1:00\nrm -r ."', r'time = "1:00\\nrm -r .": needs to be one line without control characters'),
        (
            r'setup = ["true", "a\u0085b"]',
            r'setup = \["true", "a.*b"\]: needs to be one line without control characters',
        ),
        ('template = "none.j2"', "none.j2: cannot be read"),
        ('template = "/etc/hostname"', 'template = "/etc/hostname": needs the name of a file beside the settings'),
        ('template = "../site.toml"', 'template = "../site.toml": needs the name of a file beside the settings'),
        ('template = ".."', ": cannot be read: not a regular file"),
        (None, r"site\.toml: cannot be read: No such file"),
    ],
)
def test_wrong_or_missing_settings_are_named_with_what_is_needed(tmp_path, line, wrong):
    if line is not None:
        (tmp_path / "site.toml").write_text(line)
    with pytest.raises(SiteError, match=wrong) as caught:
        load_site(tmp_path / "site.toml")
    assert str(tmp_path) in str(caught.value)


def test_all_mistakes_of_the_settings_are_named_at_once(tmp_path):
    wrong = {"task": 4, "tasks": 0, "time": '"1 h"', "mpi": '"pmi9"', "template": '"../x"', "nodes": '"two"'}
    (tmp_path / "site.toml").write_text("".join(f"{key} = {value}\n" for key, value in wrong.items()))
    with pytest.raises(SiteError) as caught:
        load_site(tmp_path / "site.toml")
    named = [
        line.removeprefix(f"{tmp_path / 'site.toml'}: ").split(" = ")[0] for line in str(caught.value).splitlines()
    ]
    assert sorted(each.split(":")[0] for each in named) == sorted(wrong)


@pytest.mark.parametrize(
    ("time", "seconds"),
    [
        *(("90", 5400), ("90:30", 5430), ("1:00:30", 3630), ("2-3", 183600), ("1-0:30", 88200), ("1-0:0:5", 86405)),
        *((wrong, math.nan) for wrong in ("", "1 h", "1:2:3:4", "1-", "-1", "1-2-3", "1:", "1.5", "1-1:1:1:1", "²")),
    ],
)
def test_times_are_those_that_slurm_reads(time, seconds):
    assert parse_time_limit(time) == pytest.approx(seconds, nan_ok=True)


@pytest.mark.parametrize(
    "template",
    [
        *("{{ ''.__class__.__mro__ }}", "{{ run.__init__.__globals__ }}", "{{ nothing }}"),
        *("{% for %}", "{{ 1 / }}", "{{ 1 / 0 }}"),
    ],
)
def test_a_template_that_is_wrong_or_reaches_for_python_is_refused_by_name(template):
    with pytest.raises(SiteError, match=r"^job\.sh\.j2: "):
        script(Job(Path("mine.toml"), Path("out")), Site(), template)
