"""`python -m study`: the same as the command `nanoslip`."""

from nanoslip import main

main()
