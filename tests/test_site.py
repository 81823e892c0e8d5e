"""The site: every key, variable and name is on its page; strict warnings hold its links; nothing is loaded from elsewhere."""

import os
import re
import runpy
import subprocess
import sys
import tomllib
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from textwrap import dedent, indent

import pytest

import nanoslip
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.study.dataset.variables import rows
from nanoslip.study.manifest.manifest import MORE_KEYS, Outputs, drive_parameters
from nanoslip.study.manifest.parameters import TABLES, table_words
from tests.conftest import ROOT

REFERENCE = runpy.run_path(str(ROOT / "docs" / "reference.py"))
LOADED = re.compile(
    r"""<(?:script|img|source|iframe)[^>]*\ssrc=["']?(?:https?:)?//|"""
    r"""<link[^>]*rel=["']?(?:stylesheet|preload|icon)[^>]*//"""
)


def first_column(text: str) -> set[str]:
    return set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE))


def test_every_key_is_on_its_page() -> None:
    tables = {name: first_column(text) for name, text in REFERENCE["tables_of_keys"]()}
    more = {name: {word for table, word in MORE_KEYS if table == name} for name in TABLES}
    assert {name: tables[name] for name in TABLES} == {name: more[name].union(table_words(name)) for name in TABLES}
    assert tables["drives"] == drive_parameters().keys()
    assert tables["outputs"] == {each.name for each in fields(Outputs)}


def test_every_variable_is_on_its_page_by_itself_or_with_those_that_differ_by_the_size_of_an_event() -> None:
    text = REFERENCE["variables"]()
    listed = {name.replace("SIZE", size, 1) for name in first_column(text) for size in SIZES}
    assert listed == {row.name for row in rows()}
    assert {line.replace("\\|", "").count("|") for line in text.splitlines() if line.startswith("|")} == {6}


def test_tables_in_pages_are_those_of_today() -> None:
    """Else `python docs/reference.py` writes them."""
    pages = dict(REFERENCE["filled_pages"]())
    assert {page.name for page in pages} == {"keys.md", "numbers.md", "dataset.md"}
    for page, text in pages.items():
        assert page.read_text("utf-8") == text, page


def test_every_public_name_is_on_its_page() -> None:
    assert set(re.findall(r":: nanoslip\.(\w+)", REFERENCE["names"]())) == set(nanoslip.__all__)


def test_a_page_of_the_gallery_shows_campaign_files_and_commands_and_keeps_all_other_code() -> None:
    """A block of each page, as Sphinx has it; what is neither file nor command stays Python."""
    shown = runpy.run_path(str(ROOT / "docs" / "shown.py"))["shown"]
    for path in (ROOT / "docs" / "gallery").glob("*.py"):
        _, _, code = path.read_text("utf-8").partition("# %%\n")
        blocks = re.split(
            r"^\.\. code-block:: ", shown(f".. code-block:: Python\n\n{indent(code, '    ')}"), flags=re.MULTILINE
        )
        kinds = [(block.partition("\n")[0], dedent(block.partition("\n\n")[2])) for block in blocks[1:]]
        files = [tomllib.loads(text) for kind, text in kinds if kind == "toml"]
        assert len(files) == code.count(".write_text(MANIFEST)")
        assert all("title" in each for each in files)
        commands = "".join(text for kind, text in kinds if kind == "sh")
        assert commands.count("nanoslip ") >= code.count("check_output(") > 0
        python = "".join(text for kind, text in kinds if kind == "Python")
        assert python.count(" = nanoslip.") == code.count(" = nanoslip.")


@pytest.mark.parametrize("tag", ['<script src="https://a.b/c.js">', '<link rel="stylesheet" href="//a.b/c.css">'])
def test_what_is_loaded_from_elsewhere_is_seen(tag: str) -> None:
    assert LOADED.search(tag)
    assert not LOADED.search(
        '<a href="https://a.b"><script src="_static/c.js"></script><link rel="stylesheet" href="c.css">'
    )


def test_one_version_is_everywhere() -> None:
    found = {
        name: re.search(r'^ *version: "(.+)"', (ROOT / name).read_text("utf-8"), re.MULTILINE)[1]  # type: ignore[index]
        for name in ("CITATION.cff", "docs/release/recipe.yaml")
    }
    assert set(found.values()) == {nanoslip.__version__}
    assert f"\n## {nanoslip.__version__} - " in (ROOT / "CHANGELOG.md").read_text("utf-8")


def test_the_recipe_needs_what_the_package_needs() -> None:
    names = {"matplotlib": "matplotlib-base", "netCDF4": "netcdf4"}  # of conda
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    given = (re.match(r"(\w+)(.+)", each) for each in project["dependencies"])
    needs = {f"{names.get(each[1], each[1])} {each[2]}" for each in given if each}
    run = (
        (ROOT / "docs" / "release" / "recipe.yaml").read_text("utf-8").partition("  run:\n")[2].partition("  run_c")[0]
    )
    assert set(re.findall(r"- (.+)", run)) == {*needs, f"python {project['requires-python']}"}


def test_the_paper_cites_what_its_bibliography_has() -> None:
    text, entries = ((ROOT / "docs" / "paper" / name).read_text("utf-8") for name in ("paper.md", "paper.bib"))
    assert set(re.findall(r"@(\w+)", text.partition("# Summary")[2])) == set(
        re.findall(r"^@\w+\{(\w+),", entries, re.MULTILINE)
    )


@pytest.mark.slow
def test_front_pages_show_what_their_command_answers() -> None:
    words = ["-m", "nanoslip", "try", "radius=50", "--drive"]
    answer = subprocess.run([sys.executable, *words], cwd=ROOT, capture_output=True, text=True, check=True)
    for page in ("README.md", "docs/index.md"):
        shown = (ROOT / page).read_text("utf-8").partition("$ nanoslip try radius=50 --drive\n")[2].partition("```")[0]
        assert " ".join(answer.stdout.split()).endswith(" ".join(shown.split())), page


PAGES = sorted((ROOT / "docs" / "gallery").glob("*.py"))
BUILT = "15_stroke_and_loop"
"""The page that a build of the site executes; the test of that build counts its pictures."""
EXECUTED = """
import sys
from pathlib import Path
page = Path(sys.argv[1])
exec(compile(page.read_text("utf-8").replace(" -j 2", " -j 1"), page, "exec"))
import matplotlib.pyplot as plt
print(len(plt.get_fignums()) + len([*Path().rglob("*.png")]), "pictures")
"""
"""Executes a page with one process in place of two, as several pages are executed at once."""


@pytest.mark.slow
@pytest.mark.parametrize("page", [page for page in PAGES if page.stem != BUILT], ids=lambda page: page.stem)
def test_a_page_of_the_gallery_can_be_executed_and_shows_a_picture(
    page: Path, environment: dict[str, str], tmp_path: Path
) -> None:
    """Each in a folder of its own, several at once: the site executes them in turn."""
    path = f"{environment['PATH']}{os.pathsep}{os.environ['PATH']}"
    more = {"PATH": path, "COLUMNS": "80", "MPLBACKEND": "agg"}
    words = [sys.executable, "-c", EXECUTED, str(page)]
    done = subprocess.run(words, cwd=tmp_path, env=environment | more, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *_, count, word = done.stdout.split()
    assert word == "pictures"
    assert int(count) > 0


@pytest.mark.slow
def test_the_site_builds_without_warnings_and_loads_nothing_from_elsewhere(tmp_path: Path) -> None:
    """Without a network: warnings, broken links among them, are errors. Of the gallery one page is executed."""
    site = tmp_path / "site"
    words = ["-W", "--keep-going", "-q", "-j", "2", "-c", "docs", "-d", tmp_path / "trees", ".", site]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", *map(str, words)],
        cwd=ROOT,
        env=os.environ | {"NANOSLIP_GALLERY": "one"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    pages = sorted(site.rglob("*.html"))
    assert not [page for page in pages if LOADED.search(page.read_text("utf-8"))]
    questions = {page.stem for page in PAGES}
    assert {path.stem for path in site.rglob("*.ipynb")} >= questions
    examples = site / "docs" / "examples"
    assert {path.stem for path in examples.glob("*.html")} >= questions
    images = {name: (examples / f"{name}.html").read_text("utf-8").count("<img") for name in questions}
    most = max(images, key=images.__getitem__)
    assert most == BUILT
    assert images[most] >= min(images.values()) + 2  # a command's picture and matplotlib's


def test_the_way_of_one_case_leads_through_functions_that_are_there() -> None:
    text = (ROOT / "docs" / "developers.md").read_text("utf-8")
    stops = re.findall(r"^\| .* \| `((?:solver|study)/[\w/]+)\.py` \| `(\w+)` \|$", text, re.MULTILINE)
    assert len(stops) == 12
    for file, name in stops:
        assert callable(getattr(import_module("nanoslip." + file.replace("/", ".")), name))
