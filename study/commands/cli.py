"""The command line: its table of commands. Files of commands are imported one at a time (see `LazyGroup`)."""

import atexit
import gc
import sys
from typing import Final

import click

from study.commands.shared.exits import ABORTED, show
from study.commands.shared.lazy import LazyGroup

COMMANDS: Final = {
    "campaigns": "List the campaigns that come with nanoslip, to run by name or to copy.",
    "plan": "Show what CAMPAIGN would compute, less what is finished.",
    "run": "Compute what is not finished of CAMPAIGN, then collect it.",
    "status": "Show how much of CAMPAIGN is finished.",
    "collect": "Write the dataset of CAMPAIGN from the results that are there.",
    "report": "Draw figures and write the HTML page of a collected CAMPAIGN.",
    "figure": "Draw figures of shipped campaigns, with what the paper says beside them.",
    "verify": "Compute DATASET again from itself alone, and compare.",
    "describe": "Explain the variables of a dataset (results.nc), or one of them.",
    "accuracy": "Measure error against time for every numerical setting.",
    "submit": "Write the batch script that runs CAMPAIGN as one MPI job.",
}
"""Command -> its one-line help, in the order of a campaign's life. The file `study/commands/<command>.py` has the rest."""


@click.group(
    cls=LazyGroup,
    package=__package__,
    summaries=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"]},
)
@click.version_option(package_name="nanoslip")
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""


def main() -> None:
    """Run the command line and exit."""
    atexit.register(gc.freeze)  # searching all modules for cycles before the process ends anyway takes 0.3 s
    try:
        code = cli.main(prog_name="nanoslip", standalone_mode=False)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    except click.Abort:
        code = ABORTED
    sys.exit(code or 0)
