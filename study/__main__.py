"""`python -m study`: the same as the command `nanoslip`."""

from study.cli import main

main()
