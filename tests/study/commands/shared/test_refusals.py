"""What is wrong with a campaign or a folder is one clear message and exit code 2, whatever the command."""

import pytest

from tests.conftest import SMALL

WRONG = {
    "an unknown key": ("n_x = 17", "n_y = 17", "numerics.n_y = 17", "did you mean n_x"),
    "a case twice": ("radius = [50.0, 100.0]", "radius = [50.0, 50]", "cases 1 and 2 are the same", "radius = 50.0"),
    "no TOML": ("[axes]", "[axes", "small.toml", ""),
}


@pytest.mark.parametrize("command", ["plan", "run", "status", "collect"])
@pytest.mark.parametrize(("line", "wrong", "where", "need"), WRONG.values(), ids=WRONG)
def test_a_wrong_campaign_is_one_clear_message(main, campaign, command, line, wrong, where, need):
    assert line in SMALL
    campaign.write_text(SMALL.replace(line, wrong))
    out = () if command == "plan" else ("--out", campaign.parent / "out")
    code, _, said = main(command, campaign, *out, *(("--serial",) if command == "run" else ()))
    assert code == 2
    assert said.startswith(f"Error: {campaign}")
    assert where in said
    assert need in said
    assert "Traceback" not in said
    assert not (campaign.parent / "out").exists()


@pytest.mark.parametrize("command", ["plan", "run", "status", "collect"])
def test_a_missing_campaign_is_one_clear_message(main, tmp_path, command):
    code, _, said = main(command, tmp_path / "none.toml", *(("--serial",) if command == "run" else ()))
    assert (code, said) == (2, f"Error: {tmp_path / 'none.toml'}: cannot be read: No such file or directory\n")


@pytest.mark.parametrize("command", ["run", "collect"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(main, campaign, command):
    # A path through a file: not even root can write there.
    code, _, said = main(command, campaign, "--out", campaign / "out", *(("--serial",) if command == "run" else ()))
    assert code == 2
    assert said.startswith(f"Error: {campaign / 'out'}")
    assert len(said.splitlines()) == 1
