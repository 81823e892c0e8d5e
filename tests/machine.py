"""Processor and arithmetic that tests compute with: `python -m tests.machine`."""

from nanoslip.study.origin import arithmetic, model

if __name__ == "__main__":
    print(model(), *arithmetic().values(), sep="; ")
