"""What scripts read is JSON, whatever the numbers, with the keys that its README names."""

import json
import math
import re

import numpy as np

from nanoslip.study.commands.plans import print_json
from tests.conftest import ROOT


def test_numbers_that_json_has_not_are_null(capsys):
    print_json({"nan": math.nan, "list": [math.inf, 1.5, np.float64(2.0), np.int64(3)], 4: ("µ", None)})
    found = json.loads(capsys.readouterr().out)
    assert found == {"nan": None, "list": [None, 1.5, 2.0, 3], "4": ["µ", None]}


def named(command: str) -> set[str]:
    """The keys that the README says a command's document has, at its top."""
    text = (ROOT / "study" / "commands" / "README.md").read_text("utf-8")
    (row,) = (line for line in text.splitlines() if line.startswith(f"| `nanoslip {command}"))
    return set(re.findall(r"`(\w+)`", re.sub(r"\([^)]*\)", "", row.split("|")[2])))


def test_documents_have_the_keys_of_the_readme(main, campaign, finished):
    out = finished
    for command in ("plan", "status"):
        code, said, _ = main(command, campaign, "--out", out, "--json")
        assert (code, set(json.loads(said))) == (0, named(command))
    code, said, _ = main("verify", out / "results.nc", "--json")
    found = json.loads(said)
    assert (code, set(found)) == (0, named("verify"))
    assert found["counts"] == {
        "bit-identical": 4, "within tolerance": 0, "different": 0, "pending": 0, "failed": 0,
        "not_in_sample": 0,
    }  # fmt: skip
    assert [each["verdict"] for each in found["cases"]] == ["bit-identical"] * 4
    for command in ("campaigns", "describe"):
        code, said, _ = main(command, "--json")
        assert (code, set(json.loads(said)[0])) == (0, named(command))
    code, said, _ = main("describe", "mean_step", "--json")
    assert [each["name"] for each in json.loads(said)] == ["mean_step"]
