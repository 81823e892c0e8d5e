"""`nanoslip submit`: the batch scripts that run a campaign under Slurm, as one MPI job or as an array of small jobs."""

import os
import subprocess
import sys
from pathlib import Path

from nanoslip.study import shipped
from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.plans import planned
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.figures.shared.files import write_files
from nanoslip.study.report.console import say, whole
from nanoslip.study.run.batch import Job, SiteError, array_script, load_site, merge_script, script


def work(campaign: Path, out: Path | None, site: Path | None, shards: int | None, submit: bool) -> None:
    """Write the batch scripts of a campaign; with `submit` hand them to sbatch and end the process."""
    used = site or shipped.folder("slurm") / "site.toml"
    with refusals(SiteError):
        planned(campaign)  # what is wrong with it is better known before the queue than after
        settings, template = load_site(used)
        into = folder(campaign, out).absolute()
        job = Job(campaign.absolute(), into)
        if shards is None:
            texts = {into / "job.sh": script(job, settings, template)}
        else:
            array = array_script(job, shards, settings, template)
            texts = {into / "array.sh": array, into / "merge.sh": merge_script(job, settings, template)}
        write_files(
            {path: os.fsencode(text) for path, text in texts.items()}
        )  # logs are opened there before anything runs
    if site is None:
        say(f"settings: {whole(used)}; copy the file, change it and give it by --site")
    if submit:
        sys.exit(_submit(list(texts)))
    first, *then = map(str, texts)
    said = f"{whole(first)}: sbatch it, or use --submit"
    say(f"{said}; {whole(then[0])} behind it: sbatch --dependency=afterany:NUMBER" if then else said)


def _submit(scripts: list[Path]) -> int:
    """Hand over the scripts, each to start when the one before it has ended, however that ended."""
    before: list[str] = []
    for path in scripts:
        try:
            done = subprocess.run(["sbatch", *before, str(path)], check=False, stdout=subprocess.PIPE, text=True)
        except FileNotFoundError:
            raise Refusal("sbatch: not found; is this a machine of the cluster?") from None
        sys.stdout.write(done.stdout)
        if done.returncode:
            return done.returncode
        before = [f"--dependency=afterany:{_number(done.stdout)}"]
    return 0


def _number(said: str) -> str:
    """The number of the job: `Submitted batch job 12`, or `… 12 on cluster …`."""
    return next(word for word in said.split() if word.isdigit())
