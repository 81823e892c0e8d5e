"""`nanoslip submit`: the batch script that runs a campaign as one MPI job under Slurm."""

import subprocess
import sys
from pathlib import Path

from study import shipped
from study.commands.shared.arguments import folder
from study.commands.shared.exits import Refusal
from study.commands.shared.plans import planned
from study.commands.shared.refusals import refusals
from study.execution.batch import submission
from study.execution.batch.submission import SiteError
from study.figures.shared.files import write_files
from study.report.console import say, whole


def work(campaign: Path, out: Path | None, site: Path | None, submit: bool) -> None:
    """Write the batch script of a campaign; with `submit` hand it to sbatch and end the process."""
    used = site or shipped.folder("slurm") / "site.toml"
    with refusals(SiteError):
        planned(campaign)  # what is wrong with it is better known before the queue than after
        settings, template = submission.load_site(used)
        into = folder(campaign, out).absolute()
        text = submission.script(campaign.stem, campaign.absolute(), into, settings, template)
        path = into / "job.sh"
        write_files({path: text.encode()})  # the scheduler opens its log in that folder before anything runs
    if site is None:
        say(f"settings: {whole(used)}; copy the file, change it and give it by --site")
    if submit:
        sys.exit(_submit(path))
    say(f"{whole(path)}: sbatch it, or use --submit")


def _submit(path: Path) -> int:
    try:
        return subprocess.run(["sbatch", str(path)], check=False).returncode
    except FileNotFoundError:
        raise Refusal("sbatch: not found; is this a machine of the cluster?") from None
