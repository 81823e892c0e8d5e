"""The command `nanoslip`, which its commands are declared on."""

import click


class Group(click.Group):
    """A group that lists its commands as they are declared: in the order of a campaign's life."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


def _say_version(context: click.Context, _option: click.Parameter, asked: bool) -> None:
    """The version of what computes, as datasets name it: of a source tree its own, whatever was installed from it once."""
    if asked and not context.resilient_parsing:
        from nanoslip.study.provenance import version  # noqa: PLC0415  no command waits for it

        click.echo(f"nanoslip, version {version()}")
        context.exit()


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_say_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""
