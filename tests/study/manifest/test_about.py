"""[about] names authors, licence and DOI in the words of others' standards, and enters no result."""

from pathlib import Path

import pytest

from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.api import run
from nanoslip.study.manifest.manifest import About
from nanoslip.study.manifest.problems import ManifestError, lines_of
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.plan import make_plan

BASE = 'title = "x"\nstages = ["contact"]\nnumerics.n_x = 17\nensemble.members = 1\n'
ABOUT = """\
[about]
author = ["Carberry, Josiah", "Hawking, Stephen"]
orcid = ["0000-0002-1825-0097", "https://orcid.org/0000-0002-9079-593X"]
licence = "CC-BY-4.0"
doi = "https://doi.org/10.5281/zenodo.1234567"
"""


def test_the_dataset_has_them_by_the_names_of_acdd(tmp_path):
    (tmp_path / "mine.toml").write_text(BASE + ABOUT)
    attributes = run(tmp_path / "mine.toml").attrs
    names = ("creator_name", "creator_url", "license", "id", "naming_authority")
    assert {name: attributes[name] for name in names} == {
        "creator_name": "Carberry, Josiah; Hawking, Stephen",
        "creator_url": "https://orcid.org/0000-0002-1825-0097; https://orcid.org/0000-0002-9079-593X",
        "license": "https://spdx.org/licenses/CC-BY-4.0",
        "id": "10.5281/zenodo.1234567",
        "naming_authority": "org.doi",
    }
    assert "ACDD-1.3" in attributes["Conventions"]


def test_tasks_and_cases_are_the_same_with_and_without():
    with_it, without = (make_plan(parse_manifest(Path("x.toml"), text, {})) for text in (BASE + ABOUT, BASE))
    assert [task.key for task in with_it.tasks] == [task.key for task in without.tasks]
    assert [case.case_id for case in with_it.cases] == [case.case_id for case in without.cases]
    assert without.manifest.about.attributes == {}


def test_an_orcid_is_known_by_its_checksum():
    """ISO 7064, mod 11-2: it finds every digit that is wrong, and every two neighbours in each other's place."""
    right = "0000-0002-1694-233X"
    assert About(orcid=right).orcid == (right,)
    wrong = [
        right[:place] + digit + right[place + 1 :]
        for place in range(18)
        for digit in "0123456789"
        if right[place] not in ("-", digit)
    ]
    digits = right.replace("-", "")
    swapped = [digits[:place] + digits[place + 1] + digits[place] + digits[place + 2 :] for place in range(15)]
    wrong += ["-".join(each[at : at + 4] for at in range(0, 16, 4)) for each in swapped if each != digits]
    for text in (*wrong, right.replace("0", "٠")):  # digits that addresses have not
        with pytest.raises(InvalidInput, match="needs an ORCID"):
            About(orcid=text)


def test_all_that_is_wrong_is_named_at_once():
    text = f"""{BASE}[about]
author = ["A", "B"]
orcid = ["0000-0002-1825-0098"]
licence = "CC BY 4"
doi = "11.1/x"
license = "MIT"
"""
    with pytest.raises(ManifestError) as error:
        parse_manifest(Path("x.toml"), text, {})
    assert [line.removeprefix("x.toml: about.") for line in lines_of(error.value)] == [
        'orcid = ["0000-0002-1825-0098"]: needs an ORCID, as 0000-0002-1825-0097: of these digits the last one would be 7',
        'licence = "CC BY 4": needs an identifier of SPDX, as CC-BY-4.0, or a URL',
        'doi = "11.1/x": needs a DOI, as 10.5281/zenodo.1234567',
        'license = "MIT": unknown; did you mean licence?',
    ]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"author": ["A", "B"], "orcid": "0000-0002-1825-0097"}, "needs as many as there are authors, 2"),
        ({"author": ""}, "needs a name"),
        ({"author": ["A\nB"]}, "needs a name"),
        ({"author": 3}, "needs a name"),
        ({"doi": 10.5}, "needs a DOI"),
    ],
)
def test_what_is_no_author_or_doi_is_refused(given, message):
    with pytest.raises(InvalidInput, match=message):
        About(**given)
