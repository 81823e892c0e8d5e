"""Exit codes of the commands. 0: done, also where the physics refused cases."""

from typing import Final

CRASHED: Final = 1
"""A defect, or a recomputed value differs."""
WRONG_INPUT: Final = 2
"""The input is wrong, or nothing can be written."""
FAILURES: Final = 3
"""Complete but for tasks that failed."""
INTERRUPTED: Final = 99
"""Exit code if stopped before all was done: a batch script can distinguish it from an error and run again."""
ABORTED: Final = 130
"""Ended by Ctrl-C."""
