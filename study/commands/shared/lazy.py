"""Import the code of a command when the command is called, so that help, completion and usage errors are instant."""

from importlib import import_module

from nanoslip.study.garbage import all_kept, keep_for_good
from nanoslip.study.run.launch import pin_threads


def work(command: str, /, **given: object) -> None:
    """Call `work` of `nanoslip.study.commands.<command>` with the arguments of the command line."""
    pin_threads()  # what is imported now imports numpy, whose libraries read the number of threads once
    with all_kept():
        doing = import_module(f"nanoslip.study.commands.{command}").work
        keep_for_good()  # modules stay to the end
    doing(**given)
