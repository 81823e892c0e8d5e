"""The command `nanoslip`, which its commands are declared on."""

import click


class Group(click.Group):
    """A group that lists its commands as they are declared: in the order of a campaign's life."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="nanoslip")
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""
