"""Arguments and help of the commands before a campaign is computed; the code of each is in the file of its name."""

from pathlib import Path

import click

from nanoslip.study.commands.shared.arguments import CAMPAIGN, JSON, OUT, CampaignPath
from nanoslip.study.commands.shared.group import cli
from nanoslip.study.commands.shared.lazy import work


@cli.command()
@JSON
def campaigns(**given: object) -> None:
    """List the campaigns that come with nanoslip.

    Run them by name, or copy them.
    """
    work("preparing.campaigns", **given)


@cli.command()
@click.argument("starter", required=False)
@click.argument("file", type=click.Path(path_type=Path), required=False)
def new(**given: object) -> None:
    """Write a commented campaign to start from.

    STARTER is its name; without a name the starters are listed. It is written to FILE [default: STARTER.toml], which must not
    exist yet. Files that it needs are written beside it.

    Example: nanoslip new sweep campaigns/mine.toml
    """
    work("preparing.new", **given)


@cli.command()
@click.argument("campaigns", metavar="CAMPAIGN...", nargs=-1, required=True, type=CampaignPath(path_type=Path))
def check(**given: object) -> None:
    """Find every problem of campaign files, without computing.

    Each CAMPAIGN is a file, or the name of one that comes with nanoslip. Of a correct one a line tells its cases and tasks. Of
    the others every problem is a line: file, key, value and what is allowed.

    Exit codes: 0 all are correct; 2 some are not.

    Example: nanoslip check campaigns/*.toml
    """
    work("preparing.check", **given)


@cli.command()
@CAMPAIGN
@OUT
@click.option(
    "--ranks", type=click.IntRange(min=1), help="Number of ranks to estimate the time for [default: cores here]"
)
@click.option("--measure", is_flag=True, help="Measure a few tasks on this machine first; no result is kept.")
@click.option("--effects", "show_effects", is_flag=True, help="Show which effects are on, and what is left out.")
@JSON
def plan(**given: object) -> None:
    """Show the tasks of CAMPAIGN, their time, memory and disk space.

    The time is that of the tasks that are not finished. It is predicted to a factor of three until the first tasks of the
    campaign have ended, or are measured here (--measure): what they took scales it then, kind by kind.
    """
    work("preparing.plan", **given)


@cli.command()
@CAMPAIGN
@click.argument("parameters", metavar="[KEY=VALUE]...", nargs=-1)
@click.option(
    "--effects", "show_effects", is_flag=True, help="Measure what each of its effects changes and costs, too."
)
def explain(**given: object) -> None:
    """Explain one case of CAMPAIGN before it is computed.

    KEY=VALUE select the case, as in `nanoslip show`. Shown are its estimated time, the error of its grid where that
    was measured, and what half of it would cost; with --effects what `nanoslip effects` shows, of this case.

    Example: nanoslip explain campaigns/mine.toml intrinsic_friction=0.5 --effects
    """
    work("preparing.explain", **given)


@cli.command()
@CAMPAIGN
@click.option(
    "--cases", type=click.IntRange(min=1), default=3, show_default=True, help="Number of cases, and of drives."
)
@click.option("--members", type=click.IntRange(min=2), help="Members of each case [default: the campaign's, at most 8]")
def effects(**given: object) -> None:
    """Measure what each effect of CAMPAIGN changes and costs.

    Its first, middle and last case are computed with everything, then without one effect at a time, by the same members.
    So are its first, middle and last drive. The change of each number asked for ([target] of, or those of the last stage) is
    relative, and that of the case in which it is largest. Effects without which no task of the number differs are not shown.
    Times are those of contact, record and drives without the effect, over those with everything. No result is kept.

    Example: nanoslip effects campaigns/mine.toml --members 16
    """
    work("preparing.effects", **given)
