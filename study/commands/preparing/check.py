"""`nanoslip check`: every problem of campaign files, or what each would compute in a line."""

from pathlib import Path

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.plans import counted, idle_lines, planned
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.plan.plan import Plan
from nanoslip.study.report.console import print_sentences, say, whole


def work(campaigns: tuple[Path, ...]) -> None:
    """Print a line for each campaign that is fine, and what in it changes nothing; then refuse the others, problem by problem."""
    problems: list[str] = []
    for campaign in campaigns:
        try:
            plan = planned(campaign)
            say(_counted(campaign, plan))
            print_sentences(idle_lines(plan))
        except ManifestError as error:
            problems += error.lines
    if problems:
        raise Refusal("\n".join(problems))


def _counted(campaign: Path, plan: Plan) -> str:
    """How many cases, drives of each case and tasks a campaign has."""
    refused = sum(not case.outcome.ok for case in plan.cases)
    impossible = sum(drive.drive is None for drive in plan.manifest.drives)
    said = (
        f"{counted(len(plan.cases), 'case')}{_of_them(refused)}",
        f"{counted(len(plan.manifest.drives), 'drive')}{_of_them(impossible)}",
        counted(len(plan.tasks), "task"),
    )
    return f"{whole(campaign)}: fine: {', '.join(said)}"


def _of_them(refused: int) -> str:
    return f" ({refused} of them refused, {whole('nanoslip plan')} says why)" if refused else ""
