"""A case is shown from a dataset, from a campaign's own, or from results that are not collected; else there is one message."""

import pytest

from nanoslip.study.results.store import Store
from tests.conftest import SMALL
from tests.study.commands.judging.test_compare import write_regimes

ONE = ("intrinsic_friction=0.5", "radius=50")


@pytest.fixture
def found(campaign, finished):
    """The small campaign, its folder of results, and what it takes to name them."""
    return campaign, finished


def test_a_case_is_shown_from_a_dataset_its_folder_or_its_campaign(main, found):
    campaign, out = found
    code, said, errors = main("show", campaign, *ONE, "drive=fast", "--out", out)
    assert (code, errors) == (0, "")
    assert said.startswith(
        "A small campaign\ncase μ_i = 0.5, R/L_x = 50, L_z/L_x = 1, n_x = 17, drive = fast, V_o = 0.002 m/s\n"
    )
    assert "outcome: completed" in said
    line = next(line for line in said.splitlines() if line.split()[:1] == ["static_friction"])
    assert "±" in line
    assert line.rstrip().endswith("static friction coefficient")
    assert said.count("┤") == 24
    for source in (out, out / "results.nc"):
        assert main("show", source, *ONE, "drive=fast") == (0, said, "")


def test_without_a_drive_all_drives_are_rows(main, found):
    code, said, _ = main("show", found[1], *ONE)
    assert code == 0
    assert "static_friction " not in said
    assert [line.split()[0] for line in said.splitlines() if line.split()[:1] in (["slow"], ["fast"])] == [
        "slow",
        "fast",
    ]
    assert said.count("┤") == 12


def test_words_of_members_are_short_in_the_table(main, campaign, tmp_path):
    campaign.write_text(SMALL.replace("[50.0, 100.0]", "[50.0]"))
    assert main("run", campaign, "--out", tmp_path, "--serial")[0] == 0
    write_regimes(tmp_path, "2 sticks; 1 stick_slip; 1 micro_slip")
    said = main("show", tmp_path, "intrinsic_friction=0.5", "drive=slow")[1]
    (row,) = (line for line in said.splitlines() if line.split()[:1] == ["regime"])
    assert row.split() == ["regime", "2", "sticks;", "2", "others", "what", "the", "pin", "does"]


def test_a_picture_is_written_whole_instead_of_text(main, found, tmp_path):
    (tmp_path / "new").mkdir()
    code, said, _ = main("show", found[1], *ONE, "-o", tmp_path / "new" / "case.png")
    assert (code, "┤" in said) == (0, False)
    assert (tmp_path / "new" / "case.png").read_bytes().startswith(b"\x89PNG")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["case.png"]
    code, _, errors = main("show", found[1], *ONE, "-o", tmp_path / "case.bmp")
    assert (code, errors) == (2, f"Error: {tmp_path / 'case.bmp'}: needs a name that ends in .pdf, .svg, .png\n")


def test_results_that_are_not_collected_or_of_a_campaign_that_changed_are_collected_in_memory(main, found):
    campaign, out = found
    campaign.write_text(SMALL.replace("[50.0, 100.0]", "[50.0, 100.0, 200.0]"))
    code, said, errors = main("show", campaign, *ONE, "--out", out)
    assert (code, "plateau_mean" in said) == (0, True)
    assert errors == f"{out}: no dataset of {campaign} as it is now: from the results that are finished\n"
    code, said, _ = main("show", campaign, *ONE[:1], "radius=200", "--out", out)
    assert (code, "outcome: pending" in said) == (0, True)
    assert "not known here: " in said
    assert not (out / "results.nc").with_suffix(".new").exists()
    for path in Store(out).folder.iterdir():
        path.unlink()
    code, _, errors = main("show", campaign, *ONE, "--out", out)
    assert (code, f"nanoslip run {campaign} --out {out} computes them" in errors) == (2, True)


def test_a_wrong_case_is_one_clear_message(main, found, tmp_path):
    out = found[1]
    (tmp_path / "bad.nc").write_bytes(b"no netCDF")
    for words, said in (
        ((out, "radius=50"), "needs to be one case: give also intrinsic_friction = 0.25, 0.5"),
        ((out, "radius=51"), "radius = 51: no such case; there are 50.0, 100.0"),
        ((out, "raduis=50"), "did you mean radius?"),
        ((out, "radius"), "radius: needs key=value, as radius=50"),
        ((out, "radius=50", "radius=50"), "radius is given twice"),
        ((tmp_path / "bad.nc", *ONE), "bad.nc: no dataset"),
        ((tmp_path, *ONE), "No such file"),
    ):
        code, _, errors = main("show", *words)
        assert (code, len(errors.splitlines())) == (2, 1), errors
        assert said in errors
