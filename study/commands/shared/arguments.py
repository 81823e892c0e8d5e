"""The arguments that most commands take: a campaign, and the folder of its results."""

import os
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from nanoslip.study import shipped
from nanoslip.study.commands.shared.exits import Refusal


class CampaignPath(click.Path):
    """A campaign file, or the name of a campaign that comes with nanoslip."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file."""
        return shipped.campaign_file(Path(os.fsdecode(super().convert(value, param, ctx))))

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Files, and the campaigns that come with nanoslip."""
        names = [CompletionItem(name) for name in shipped.campaigns() if name.startswith(incomplete)]
        return [*super().shell_complete(ctx, param, incomplete), *names]


class NewFile(click.Path):
    """A file that is to be written, into a folder that is there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file. Raises Refusal."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if not path.parent.is_dir():
            raise Refusal(f"{path}: cannot be written: there is no folder {path.parent}")
        return path


CAMPAIGN = click.argument("campaign", type=CampaignPath(path_type=Path))
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON for scripts (keys: study/commands/README.md).")
OUT = click.option("--out", type=click.Path(path_type=Path), help="Folder of the results [default: results/<campaign>]")


def folder(campaign: Path, out: Path | None) -> Path:
    """The folder of a campaign's results."""
    return out or Path("results") / campaign.stem
