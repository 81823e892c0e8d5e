"""One folder for all processes of a test run: results of shipped campaigns made small are computed once."""

import pytest

from tests.study.figures.shipped_small import Shared


@pytest.fixture(autouse=True, scope="session")
def shared_results(tmp_path_factory: pytest.TempPathFactory, testrun_uid: str) -> None:
    Shared.folder = tmp_path_factory.getbasetemp().parent / f"small-{testrun_uid}"
    Shared.folder.mkdir(exist_ok=True)
