"""Advice can be typed as it stands: with the folder of the results where it is not the campaign's own, and quoted."""

from pathlib import Path

import pytest

from nanoslip.study.commands.plans import advised


@pytest.mark.parametrize(
    ("into", "options", "said"),
    [
        ("results/mine", (), "nanoslip merge mine.toml"),
        ("far", (), "nanoslip merge mine.toml --out far"),
        ("far", ("--retry",), "nanoslip merge mine.toml --out far --retry"),
        ("far away", (), "nanoslip merge mine.toml --out 'far away'"),
    ],
)
def test_advice_names_the_folder_of_the_results(into: str, options: tuple[str, ...], said: str) -> None:
    assert advised("merge", Path("mine.toml"), Path(into), *options).replace("\xa0", " ") == said
