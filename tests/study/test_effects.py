"""What a manifest does not ask for is not computed."""

from pathlib import Path

import pytest

from study.effects import task_kinds
from study.manifest import load_manifest

DRIVE = '[[drives]]\nname = "a"'


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ('stages = ["contact"]', {"compliance", "contact"}),
        ('stages = ["contact", "slip"]', {"compliance", "friction"}),
        ("outputs.tractions = true", {"compliance", "contact", "friction"}),
        (DRIVE, {"compliance", "friction", "drive"}),
    ],
)
def test_stages_and_outputs_decide_the_kinds_of_task(tmp_path: Path, text: str, kinds: set[str]) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f'title = "x"\n{text}')
    assert task_kinds(load_manifest(path)) == kinds
