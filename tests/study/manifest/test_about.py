"""[about] names authors, licence and DOI as attributes of ACDD, as given, and enters no result."""

from pathlib import Path

import pytest

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.api import run
from nanoslip.study.manifest.manifest import About
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.plan import make_plan

BASE = 'title = "x"\nstages = ["contact"]\nnumerics.n_x = 17\nensemble.members = 1\n'
ABOUT = """\
[about]
author = ["Carberry, Josiah", "Hawking, Stephen"]
orcid = ["https://orcid.org/0000-0002-1825-0097", "https://orcid.org/0000-0002-9079-593X"]
licence = "CC-BY-4.0"
doi = "10.5281/zenodo.1234567"
"""


def test_the_dataset_has_them_by_the_names_of_acdd(tmp_path):
    (tmp_path / "mine.toml").write_text(BASE + ABOUT)
    attributes = run(tmp_path / "mine.toml").attrs
    names = ("creator_name", "creator_url", "license", "id", "naming_authority")
    assert {name: attributes[name] for name in names} == {
        "creator_name": "Carberry, Josiah; Hawking, Stephen",
        "creator_url": "https://orcid.org/0000-0002-1825-0097; https://orcid.org/0000-0002-9079-593X",
        "license": "CC-BY-4.0",
        "id": "10.5281/zenodo.1234567",
        "naming_authority": "org.doi",
    }
    assert "ACDD-1.3" in attributes["Conventions"]


def test_tasks_and_cases_are_the_same_with_and_without():
    with_it, without = (make_plan(parse_manifest(Path("x.toml"), text, {})) for text in (BASE + ABOUT, BASE))
    assert [task.key for task in with_it.tasks] == [task.key for task in without.tasks]
    assert [case.case_id for case in with_it.cases] == [case.case_id for case in without.cases]
    assert without.manifest.about.attributes == {}


def test_what_is_wrong_is_named_at_once():
    with pytest.raises(ManifestError) as error:
        parse_manifest(Path("x.toml"), BASE + '[about]\nauthor = ["A"]\ndoi = 10.5\nlicense = "MIT"\n', {})
    assert [each.key for each in error.value.problems] == ["doi", "license"]


@pytest.mark.parametrize(
    "given", [{"author": ""}, {"author": ["A\nB"]}, {"author": 3}, {"doi": 10.5}, {"licence": "A\0"}]
)
def test_what_is_no_line_of_text_is_refused(given):
    with pytest.raises(InvalidInput) as error:
        About(**given)
    assert error.value.key in given
