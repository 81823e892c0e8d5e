"""A campaign's numbers go to other programs as CSV or JSON, to standard output or as a whole file."""

import csv
import json

from tests.conftest import SMALL


def test_cases_events_and_samples_are_exported(main, campaign, tmp_path):
    campaign.write_text(SMALL.replace("[0.25, 0.5]", "[0.5]"))
    out = campaign.parent / "out"
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    code, said, errors = main("export", campaign, "--out", out)
    assert (code, errors) == (0, "")
    header, units, *rows = csv.reader(said.splitlines())
    assert (len(rows), len(units)) == (4, len(header))
    assert main("export", out, "--csv") == (0, said, "")

    target = tmp_path / "new" / "table.JSON"
    code, said, errors = main("export", out / "results.nc", "-o", target)
    assert (code, said, target.parent.exists()) == (2, "", False)
    assert f"there is no folder {target.parent}" in errors
    target.parent.mkdir()
    code, said, errors = main("export", out / "results.nc", "-o", target)
    assert (code, said, errors) == (0, "", f"written: {target} (4 rows)\n")
    assert [row["drive"] for row in json.loads(target.read_text("utf-8"))["rows"]] == ["slow", "fast"] * 2
    assert [path.name for path in target.parent.iterdir()] == ["table.JSON"]

    assert main("export", out, "--records")[1].count("\n") == 2 + 2 * 200
    assert len(json.loads(main("export", out, "--json", "--trajectories")[1])["rows"]) == 4 * 41


def test_pending_and_refused_cases_are_rows_without_numbers(main, campaign):
    out = campaign.parent / "out"
    assert main("collect", campaign, "--out", out)[0] == 0
    rows = json.loads(main("export", out, "--json")[1])["rows"]
    assert {row["outcome"] for row in rows} == {"pending"}
    assert {row["plateau_mean"] for row in rows} == {None}
    code, said, _ = main("export", out, "--records")
    assert (code, len(said.splitlines())) == (0, 2)


def test_what_cannot_be_exported_is_one_clear_message(main, campaign, tmp_path):
    contact = tmp_path / "contact.toml"
    contact.write_text('title = "Contact"\nstages = ["contact"]\n[numerics]\nn_x = 17\n')
    out = tmp_path / "out"
    assert main("run", contact, "--out", out, "--serial")[0] == 0
    for words, wanted in (
        ((out, "--records"), "this dataset has no group record"),
        ((out, "-o", campaign / "x.csv"), "cannot be written"),
        ((campaign, "--out", tmp_path / "none"), "no results of"),
        ((tmp_path / "none.nc",), "no dataset"),
    ):
        code, said, errors = main("export", *words)
        assert (code, said, len(errors.splitlines())) == (2, "", 1)
        assert wanted in errors
