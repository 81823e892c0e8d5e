"""No command prints a line wider than the terminal: paths and words to be typed may be, no others are here."""

import pytest
from rich.cells import cell_len

COMMANDS = (
    "new",
    "campaigns",
    "check small.toml",
    "plan small.toml --effects",
    "explain small.toml intrinsic_friction=0.5 radius=50",
    "run small.toml --serial",
    "collect small.toml",
    "status small.toml",
    "submit small.toml",
    "report small.toml",
    "figure",
    "figure small.toml --y plateau/mu_i -o a.svg",
    "show small.toml intrinsic_friction=0.5 radius=50",
    "show small.toml intrinsic_friction=0.5 radius=50 drive=fast",
    "show small.toml",
    "try n_x=17 events=60 radius=50 --drive",
    "try colour=red",
    "run small.toml --shard 0/3",
    "run small.toml --nonsense",
    "",
    "frames small.toml intrinsic_friction=0.5 radius=50 --events 0,5",
    "compare small.toml results/small",
    "verify results/small",
    "describe",
    "describe plateau_mean",
    "effects small.toml --cases 1 --members 2",
)
"""In the order of a campaign's life."""


@pytest.mark.parametrize("width", [60, 80])
def test_every_command_fits_the_terminal(main, campaign, monkeypatch, width):
    monkeypatch.chdir(campaign.parent)
    monkeypatch.setenv("COLUMNS", str(width))
    for command in COMMANDS:
        _, said, errors = main(*command.split())
        for line in (*said.splitlines(), *errors.splitlines()):
            assert cell_len(line) <= width or len(line.split()) == 1 or str(campaign.parent) in line, (command, line)
