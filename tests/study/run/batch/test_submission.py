"""A batch script is text: the same settings give the recorded file, and settings that are wrong are named."""

import subprocess
from pathlib import Path

import pytest

from nanoslip.study.run.batch import Job, Site, SiteError, array_script, load_site, merge_script, script
from tests.conftest import ROOT

RECORDED = Path(__file__).with_name("job.sh")
JOB = Job(Path("/home/me/my campaigns/streator2022.toml"), Path("/scratch/out"))


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
    template = (ROOT / "slurm" / "job.sh.j2").read_text("utf-8")
    text = script(JOB, site, template)
    assert text == RECORDED.read_text("utf-8")


def test_an_array_differs_from_the_job_in_what_each_computes_where_it_logs_and_what_it_requeues():
    _, template = load_site(ROOT / "slurm" / "site.toml")
    one, array = script(JOB, Site(), template), array_script(JOB, 12, Site(), template)
    run = "nanoslip run '/home/me/my campaigns/streator2022.toml' --out /scratch/out"
    assert changes(one, array) == [
        "#SBATCH --output=/scratch/out/slurm-%A_%a.log",
        "#SBATCH --array=1-12",
        f'srun --mpi=pmi2 --wait=10 {run} --shard "$SLURM_ARRAY_TASK_ID/12"',
        '    scontrol requeue "${SLURM_ARRAY_JOB_ID}_$SLURM_ARRAY_TASK_ID" && sleep 60',
    ]
    subprocess.run(["bash", "-n"], input=array, text=True, check=True)


def test_the_job_behind_it_merges_in_one_process_and_is_not_requeued():
    site, template = load_site(ROOT / "slurm" / "site.toml")
    found = changes(script(JOB, site, template), merge_script(JOB, site, template))
    assert found == [
        "#SBATCH --ntasks=1",
        "srun --mpi=pmi2 --wait=10 nanoslip merge '/home/me/my campaigns/streator2022.toml' --out /scratch/out",
        '[ "$code" -gt 128 ] && most=0',
        '[ "$code" -eq 99 ] && most=0',
    ]


def changes(one: str, other: str) -> list[str]:
    """Lines of another text that the one does not have."""
    return [line for line in other.splitlines() if line not in one.splitlines()]


@pytest.mark.parametrize("odd", ["a\nrm -r .", "a\rb", "a\x1bb", "a\u2028b"])
def test_no_name_is_a_line_of_the_script(odd):
    for campaign, out in ((f"{odd}.toml", "out"), ("mine.toml", odd), (f"{odd}/mine.toml", "out")):
        with pytest.raises(SiteError, match="needs to be one line without control characters") as caught:
            Job(Path(campaign), Path(out))
        assert len(str(caught.value).splitlines()) == 1


def test_a_name_with_a_backslash_which_sbatch_takes_out_is_refused():
    with pytest.raises(SiteError, match="needs to be without backslashes"):
        Job(Path("mine.toml"), Path("a\\b"))


def test_a_percent_sign_in_a_name_is_no_pattern_of_slurm_where_its_log_is_named():
    text = script(Job(Path("50%j.toml"), Path("/out/50%x")), Site(), "{{ name }} {{ log }} {{ run }}")
    assert text == "50%j /out/50%%x/slurm-%j.log nanoslip run 50%j.toml --out /out/50%x"


def test_the_script_is_a_shell_script():
    subprocess.run(["bash", "-n", str(RECORDED)], check=True)


def test_the_settings_in_the_repository_are_the_defaults_and_load():
    site, template = load_site(ROOT / "slurm" / "site.toml")
    assert site == Site()
    assert template.startswith("#!/bin/bash\n")


@pytest.mark.parametrize(
    ("line", "wrong"),
    [
        ("task = 4", "task: unknown; needs one of template, tasks"),
        ("tasks = 0", "tasks = 0: needs at least 1"),
        ("restarts = -1", "restarts = -1: needs at least 0"),
        ("tasks = true", "tasks = True: needs a whole number"),
        ('nodes = "two"', "nodes = 'two': needs a whole number"),
        ("time = 60", "time = 60: needs a text"),
        ("setup = [1]", r"setup = \(1,\): needs a list of texts"),
        ("tasks = ", "Invalid value"),
        (r'time = "1:00\nrm -r ."', r'time = "1:00\\nrm -r .": needs to be one line without control characters'),
        (r'setup = ["true", "a\u0085b"]', r'setup = "a.*b": needs to be one line without control characters'),
        ('template = "none.j2"', "none.j2: cannot be read"),
        ('template = "/etc/hostname"', 'template = "/etc/hostname": needs the name of a file beside the settings'),
        ('template = "../site.toml"', 'template = "../site.toml": needs the name of a file beside the settings'),
        ('template = ".."', ": cannot be read: not a regular file"),
    ],
)
def test_wrong_settings_are_named_with_what_is_needed(tmp_path, line, wrong):
    path = tmp_path / "site.toml"
    path.write_text(line)
    with pytest.raises(SiteError, match=wrong) as caught:
        load_site(path)
    assert str(tmp_path) in str(caught.value)


def test_missing_settings_are_named(tmp_path):
    with pytest.raises(SiteError, match=r"site\.toml: cannot be read: No such file"):
        load_site(tmp_path / "site.toml")


@pytest.mark.parametrize(
    "template",
    [
        "{{ ''.__class__.__mro__ }}",
        "{{ run.__init__.__globals__ }}",
        "{{ nothing }}",
        "{% for %}",
        "{{ 1 / }}",
        "{{ 1 / 0 }}",
    ],
)
def test_a_template_that_is_wrong_or_reaches_for_python_is_refused_by_name(template):
    with pytest.raises(SiteError, match=r"^job\.sh\.j2: "):
        script(Job(Path("mine.toml"), Path("out")), Site(), template)
