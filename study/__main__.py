"""`python -m study`: the same as the command `nanoslip`."""

from study.commands.cli import main

main()
