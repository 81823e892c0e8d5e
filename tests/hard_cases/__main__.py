"""Run every family's table of hard cases and write what was seen: tests/hard_cases/table.md."""

from tests.hard_cases.table import FOLDER, all_rows, as_markdown

text = as_markdown(all_rows())
print(text)
(FOLDER / "table.md").write_text(text)
