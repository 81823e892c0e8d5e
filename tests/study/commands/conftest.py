"""What tests of commands share: the folder of a campaign's results, and commands on the small campaign with it."""

import pytest


@pytest.fixture
def out(campaign):
    """Where the results of `campaign` go."""
    return campaign.parent / "out"


@pytest.fixture
def finished(finished, out):
    """The same folder, with results."""
    return finished.rename(out)


@pytest.fixture
def ask(main, campaign, out):
    """Call a command on the campaign and its results; returns exit code, standard output and standard error."""
    return lambda command, *words: main(command, campaign, "--out", out, *words)


@pytest.fixture
def run(ask):
    """Call `run` so, in this process."""
    return lambda *words: ask("run", "--serial", *words)
