"""A command's work is imported when it is called: help, completion and wrong command lines are instant."""

from importlib import import_module

from study.execution.launch import pin_threads


def work(command: str, *arguments: object) -> None:
    """Do what a command is for: call `work` of the file `study/commands/<command>.py` with the command's arguments."""
    pin_threads()  # what is imported now imports numpy, whose libraries read the number of threads once
    import_module(f"study.commands.{command}").work(*arguments)
