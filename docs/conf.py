"""How the site is built (`make docs`). Its pages are Markdown here and beside the code; the rest is written by `reference.py`.

NANOSLIP_GALLERY=full executes the gallery with the values behind `# full:` instead of the small ones before it;
NANOSLIP_GALLERY=one executes one page, whose pictures are a command's and matplotlib's.
"""

import os
import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
# Commands of this environment, output as wide as a page.
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
os.environ |= {"COLUMNS": "80", "MPLBACKEND": "agg"}

import reference  # noqa: E402
import shown  # noqa: E402

from nanoslip.study import provenance  # noqa: E402
from nanoslip.study.run.launch import pin_arithmetic  # noqa: E402

pin_arithmetic()  # of the gallery, which imports numpy later

project, author, release = "nanoslip", "nanoslip developers", provenance.version()
project_copyright = "nanoslip developers, MIT licence"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_click", "sphinx_gallery.gen_gallery"]
root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "CHANGELOG.md",
    *(f"campaigns/{pages}*.md" for pages in ("", "figures/", "maps/", "interface/", "paths/", "findings/")),
    *(f"tests/{folder}/*.md" for folder in ("verification", "hard_cases", "benchmarks", "mpi", "slurm", "study/*")),
    "study/accuracy/*.md",
]
exclude_patterns = [
    ".*",
    "build",
    "results",
    "nanoslip",
    "docs/generated",
    "docs/gallery",
    "docs/paper",
    "docs/release",
]
nitpicky = True
suppress_warnings = ["config.cache"]

# Markdown, with GitHub's anchors of headings.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence"]
default_role = "code"
smartquotes = False  # options keep their two hyphens, examples their quotes
autodoc_member_order = "bysource"
autodoc_typehints = "none"

ITEM = re.compile(r"(\w+, )*\w+( \w+)?: ")
UNQUOTED = re.compile(r"`[^`]*`|[|*]")


def plain_text(_app, *given):  # type: ignore[no-untyped-def]
    """Docstrings and help are plain text: `name: meaning` is an item of a list, | and * are letters."""
    lines, inside = given[-1], False
    found = []
    for line in lines:
        text = UNQUOTED.sub(lambda sign: sign[0] if sign[0][0] == "`" else "\\" + sign[0], line.strip())
        begins = bool(ITEM.match(text))
        inside = bool(text) and (inside or begins)
        found += ["", f"- {text}"] if begins else [f"  {text}" if inside else text]
    lines[:] = found


def as_on_the_site(_app, docname, source):  # type: ignore[no-untyped-def]
    """Links to the gallery's sources lead to its pages, which show files and commands; a table alone has the name of its file."""
    source[0] = re.sub(r"\(gallery/(\w+)\.py\)", r"(project:examples/\1.rst)", source[0])
    if docname.startswith("docs/examples/"):
        source[0] = shown.shown(source[0])
    if docname.startswith(("tests/", "study/")) and not source[0].startswith("# "):
        folder, name = docname.split("/")[-2:]
        source[0] = f"# {folder.replace('_', ' ').capitalize()}: {name.replace('_', ' ')}\n\n{source[0]}"


def setup(app):  # type: ignore[no-untyped-def]
    """Sphinx calls it."""
    app.connect("source-read", as_on_the_site)
    app.connect("autodoc-process-docstring", plain_text)
    for part in ("description", "epilog"):
        app.connect(f"sphinx-click-process-{part}", plain_text)


# Fonts and scripts are files of the site.
html_theme = "furo"
html_title = f"nanoslip {release}"
html_show_sphinx = False
html_copy_source = False
html_additional_pages = {"index": "to_first_page.html"}
templates_path = ["templates"]
html_static_path = ["static"]
html_css_files = ["site.css"]

# The gallery: copies of docs/gallery, executed in a folder of their own.
GALLERY = os.environ.get("NANOSLIP_GALLERY")
EXECUTED = HERE.parent / "build" / "gallery"


def pictures(block, block_vars, gallery_conf):  # type: ignore[no-untyped-def]
    """Show what a command of a page has drawn, and what matplotlib has."""
    from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper  # noqa: PLC0415

    paths = block_vars["image_path_iterator"]
    drawn = [(path, next(paths)) for path in sorted(EXECUTED.rglob("*.png"))]
    for path, target in drawn:
        path.replace(target)
    own = figure_rst([target for _, target in drawn], gallery_conf["src_dir"])
    return own + matplotlib_scraper(block, block_vars, gallery_conf)


def prepare_gallery() -> None:
    """Copy the pages that are executed, with small values or with full ones."""
    EXECUTED.mkdir(parents=True, exist_ok=True)
    for path in (path for path in (HERE / "gallery").rglob("*") if path.is_file()):
        text = path.read_text("utf-8")
        if GALLERY == "full":
            text = re.sub(r"^(\s*\w+ = ).*?  # full: (.*)$", r"\1\2", text, flags=re.MULTILINE)
        copy = EXECUTED / path.relative_to(HERE / "gallery")
        copy.parent.mkdir(exist_ok=True)
        if not copy.exists() or copy.read_text("utf-8") != text:
            copy.write_text(text, "utf-8")


sphinx_gallery_conf = {
    "examples_dirs": str(EXECUTED),
    "gallery_dirs": "docs/examples",
    "filename_pattern": r"/15_" if GALLERY == "one" else r"\.py",
    "image_scrapers": (pictures,),
    "within_subsection_order": "FileNameSortKey",
    "remove_config_comments": True,
    "abort_on_example_error": True,
    "min_reported_time": 1e9,  # of the building machine, with start-up: pages state what a run costs
    "download_all_examples": False,
    "show_signature": False,
    "capture_repr": (),
    "write_computation_times": False,
}

prepare_gallery()
reference.write(HERE / "generated")
