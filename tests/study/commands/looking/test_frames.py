"""`nanoslip frames` draws one case from its campaign file, says which, and what its record did not reach."""

from pathlib import Path

from tests.conftest import Main


def test_it_draws_the_case_that_is_singled_out(main: Main, campaign: Path, tmp_path: Path) -> None:
    words = ("radius=50", "intrinsic_friction=0.5", "--events", "0,20", "-o", tmp_path / "strip.svg")
    code, out, err = main("frames", campaign, *words)
    assert (code, err) == (0, "")
    assert f"written: {tmp_path / 'strip.svg'} (intrinsic_friction = 0.5, radius = 50.0, " in out
    assert "2 moments to event 20)" in out
    assert "<svg" in (tmp_path / "strip.svg").read_text()


def test_it_says_what_the_record_does_not_reach(main: Main, tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    path.write_text('title = "short"\nconstants.radius = 50.0\nnumerics.n_x = 17\nlimits.displacement = 1e-5\n')
    code, _, err = main("frames", path, "--events", "0,1000", "-o", tmp_path / "strip.svg")
    assert code == 0
    assert err == "no event 1000: the record ends before (completed)\n"


def test_what_is_wrong_is_one_line_and_nothing_is_written(main: Main, campaign: Path, tmp_path: Path) -> None:
    for words in (("radius=1",), ("radius=50",), ("-o", "a.jpg"), ("--events", "x")):
        code, out, err = main("frames", campaign, *words)
        assert (code, out) == (2, "")
        assert err.startswith("Error: ")
        assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["small.toml"]
