"""The cases of slab and chains have names, and their events are those that the dataset's statistics count."""

from chain import names, numbers_of, plain, steady_sizes

from tests.study.figures.shipped_small import small


def test_cases_are_called_by_what_they_are() -> None:
    found = [plain(name) for name in names(small("figures/chain")).values()]
    assert found == ["slab", *(f"chain, k_c/k_l = {ratio}" for ratio in (1, 10, 100, 1000))]


def test_events_are_those_of_the_statistics() -> None:
    dataset = small("figures/chain")
    for number in names(dataset):
        assert len(steady_sizes(dataset, number).slips) == int(numbers_of(dataset, number)["sized_events"]) > 100
