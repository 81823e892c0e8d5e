"""Notices of a command or a task on standard error while it works."""

import shutil
import sys
import textwrap
from typing import Final

_INDENT: Final = "    "
_UNLIMITED: Final = (2**20, 24)
"""Columns and lines without a terminal or COLUMNS."""


def print_notice(text: str) -> None:
    """Print at once, in one piece: the first line as wide as the terminal, others (of a traceback) as they are. "": nothing."""
    first, _, others = text.partition("\n")
    width = shutil.get_terminal_size(_UNLIMITED).columns
    lines = textwrap.wrap(first, width, subsequent_indent=_INDENT, break_long_words=False, break_on_hyphens=False)
    lines += others.splitlines()
    # In one piece, as several processes may write to the same terminal.
    sys.stderr.write("".join(f"{line}\n" for line in lines))
    sys.stderr.flush()
