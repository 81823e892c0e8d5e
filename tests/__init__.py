"""Tests compute with one thread and one arithmetic, pinned before numpy is loaded, however they are started."""

import os

from nanoslip.study.run.launch import pin_arithmetic

UNPINNED = dict(os.environ)
"""Environment of whoever started them."""
pin_arithmetic()
