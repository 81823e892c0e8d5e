"""How a page of the gallery shows its code: campaign files as TOML and commands as shell, the rest as Python."""

import ast
import re
from collections.abc import Iterator
from itertools import groupby
from textwrap import dedent, indent

BLOCK = re.compile(r"^\.\. code-block:: Python\n\n((?:    .*\n|\n)+)", re.MULTILINE)
LETTERS = 60
"""Of a command in one line."""


def shown(page: str) -> str:
    """A page of the gallery, as reStructuredText, with each block of Python as a reader would type it."""
    return BLOCK.sub(lambda found: "\n".join(_blocks(dedent(found[1]))), page)


def _blocks(code: str) -> Iterator[str]:
    for (language, caption), parts in groupby(_parts(code), key=lambda part: part[:2]):
        text = "\n".join(text for *_, text in parts).strip("\n")
        options = f"    :caption: {caption}\n" if caption else ""
        yield f".. code-block:: {language}\n{options}\n{indent(text, '    ')}\n\n"


def _parts(code: str) -> Iterator[tuple[str, str, str]]:
    """Language, caption and text of each statement; a text that is only written or executed stands where that is done."""
    texts: dict[str, str] = {}
    lines = code.splitlines()
    for statement in ast.parse(code).body:
        source = "\n".join(lines[statement.lineno - 1 : statement.end_lineno])
        match statement:
            case ast.ImportFrom(module="pathlib" | "subprocess"):
                continue
            case ast.Assign(targets=[ast.Name(id=name)], value=ast.Constant(value=str(text))):
                texts[name] = text
                continue
        called = re.match(
            r'Path\("([\w.]+)"\)\.write_text\((\w+)\)$|print\(\*?check_output\((.*?), shell=True', source, re.DOTALL
        )
        if called and called[1]:
            yield "toml", called[1], texts[called[2]]
        elif called:
            yield "sh", "", _broken(texts[called[3]] if called[3] in texts else ast.literal_eval(called[3]))
        else:
            yield "Python", "", source


def _broken(command: str) -> str:
    """A long command with its options in lines of their own."""
    return command if len(command) <= LETTERS else re.sub(r" (?=--?\w)", " \\\\\n    ", command)
