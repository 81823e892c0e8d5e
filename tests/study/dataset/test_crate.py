"""`nanoslip export --crate`: an RO-Crate as its own library reads it, whose dataset is that of the campaign, byte for byte."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rocrate.rocrate import ROCrate

from nanoslip.study.api import run
from nanoslip.study.manifest.reader import load_manifest
from tests.conftest import Main

CAMPAIGN = """\
title = "Contact"
stages = ["contact"]
table = "cases/mine.csv"
numerics.n_x = 17
ensemble.members = 1
[about]
author = ["Carberry, Josiah", "Hawking, Stephen"]
orcid = ["0000-0002-1825-0097", "0000-0002-9079-593X"]
licence = "CC-BY-4.0"
doi = "10.5281/zenodo.1234567"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign, computed into `out` beside it."""
    here = tmp_path_factory.mktemp("crate")
    (here / "cases").mkdir()
    (here / "cases" / "mine.csv").write_text("radius\n50\n60\n")
    (here / "mine.toml").write_text(CAMPAIGN)
    run(here / "mine.toml", out=here / "out").close()
    return here


def references(value: Any) -> Iterator[str]:
    """All that an entity refers to."""
    for each in value if isinstance(value, list) else [value]:
        if isinstance(each, dict):
            assert each.keys() == {"@id"}  # JSON-LD is flattened
            yield each["@id"]


@pytest.mark.parametrize("name", ["crate", "crate.zip"])
def test_a_crate_is_one(main: Main, folder: Path, tmp_path: Path, name: str) -> None:
    """What https://www.researchobject.org/ro-crate/specification demands: a descriptor, a root with name, description, date and
    licence, nothing referred to that is not described, and every file there."""
    code, _, errors = main("export", folder / "out", "--crate", "-o", tmp_path / name)
    assert (code, errors) == (0, f"written: {tmp_path / name}\n")
    crate = ROCrate(tmp_path / name)
    text = (Path(crate.source) / "ro-crate-metadata.json").read_text("utf-8")
    entities = {each["@id"]: each for each in json.loads(text)["@graph"]}
    descriptor, root = entities["ro-crate-metadata.json"], entities["./"]
    assert descriptor["about"] == {"@id": "./"}
    assert descriptor["conformsTo"]["@id"].startswith("https://w3id.org/ro/crate/1.")
    assert root.keys() >= {"name", "description", "datePublished", "license"}
    for entity in entities.values():
        for key, value in entity.items():
            found = set(references(value))
            assert found <= entities.keys() or key == "conformsTo"
    files = {each.id: Path(crate.source) / each.id for each in crate.data_entities}
    assert (
        set(files)
        == {"results.nc", "campaign.toml", "cases/mine.csv", "report.html"}
        == set(references(root["hasPart"]))
    )
    for name_of_file, path in files.items():
        assert entities[name_of_file]["contentSize"] == str(path.stat().st_size)
    assert files["results.nc"].read_bytes() == (folder / "out" / "results.nc").read_bytes()
    assert load_manifest(files["campaign.toml"]).sha256 == load_manifest(folder / "mine.toml").sha256
    people = [entities[each] for each in references(root["author"])]
    assert [person["name"] for person in people] == ["Carberry, Josiah", "Hawking, Stephen"]
    assert people[0]["@id"] == "https://orcid.org/0000-0002-1825-0097"
    assert root["license"] == {"@id": "https://spdx.org/licenses/CC-BY-4.0"}
    assert root["identifier"] == "https://doi.org/10.5281/zenodo.1234567"


def test_a_campaign_without_a_licence_is_one_message(main: Main, folder: Path) -> None:
    bare = folder / "bare.toml"
    bare.write_text(CAMPAIGN.partition("[about]")[0])
    code, _, errors = main("export", bare, "--out", folder / "out", "--crate")
    assert (code, len(errors.splitlines())) == (2, 2)  # the first one: collected anew for these words
    assert 'about.licence: missing in the manifest: needs one for an RO-Crate, as licence = "CC-BY-4.0"' in errors


def test_what_makes_no_crate_is_one_message(
    main: Main, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, _, errors = main("export", folder / "out", "--crate", "--records", "-o", tmp_path / "c")
    assert (code, "--records: needs a table, and --crate has everything" in errors) == (2, True)
    monkeypatch.setitem(sys.modules, "rocrate.rocrate", None)
    code, _, errors = main("export", folder / "out", "--crate", "-o", tmp_path / "c")
    assert (code, 'pip install "nanoslip[crate]"' in errors, (tmp_path / "c").exists()) == (2, True, False)


def test_a_crate_replaces_a_crate_and_no_other_files(main: Main, folder: Path, tmp_path: Path) -> None:
    """Results of another campaign have the same names."""
    (tmp_path / "results.nc").write_text("of another campaign")
    code, _, errors = main("export", folder / "out", "--crate", "-o", tmp_path)
    assert code == 2
    assert "files that are of no crate" in " ".join(errors.split())
    assert [path.name for path in tmp_path.iterdir()] == ["results.nc"]
    assert (tmp_path / "results.nc").read_text() == "of another campaign"
    (tmp_path / "crate").mkdir()
    (tmp_path / "crate" / "ro-crate-metadata.json").write_text("{}")
    assert main("export", folder / "out", "--crate", "-o", tmp_path / "crate")[0] == 0
