"""Places of results are found as they were entered, and take little memory."""

import tracemalloc
from pathlib import Path

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.study.results.entry import Head, Meta
from nanoslip.study.results.log import Place, Places

LARGEST = 2**32 - 1
"""Of a checksum, or a table's length."""


def place(number: int, path: Path = Path("a.log"), outcome: Outcome = COMPLETED) -> Place:
    meta = Meta("record", outcome, ())
    return Place(Head(f"{number:020x}", meta, LARGEST, 2**40, LARGEST, LARGEST - number, 2**41), path, 2**50 + number)


def test_a_place_is_as_it_was_entered() -> None:
    entered = [place(0), place(1, Path("b.log")), place(2, outcome=Outcome(Ending.CRASHED, "a defect"))]
    places = Places()
    for each in entered:
        places.add(each)
    assert [places[each.head.key] for each in entered] == entered
    assert list(places.values()) == entered
    assert [places.meta(each.head.key) for each in entered] == [each.head.meta for each in entered]
    assert places.of_all(lambda meta: meta) == {each.head.key: each.head.meta for each in entered}
    assert [places.seal(each.head.key) for each in entered] == [each.head.seal for each in entered]
    assert places.path(entered[1].head.key) == Path("b.log")


def test_what_is_entered_again_or_forgotten_is_not_there_any_more() -> None:
    places = Places()
    for each in (place(0), place(1), place(2, Path("b.log")), place(3, Path("b.log"))):
        places.add(each)
    places.add(place(1, Path("b.log")))
    places.forget(place(3).head.key)
    places.forget(place(4).head.key)
    assert places.path(place(1).head.key) == Path("b.log")
    assert len(places) == 3
    places.forget_all(Path("b.log"))
    assert list(places.values()) == [place(0)]
    assert place(1).head.key not in places


def test_of_a_result_more_little_is_kept() -> None:
    """Its key, its share of the dictionary and 44 bytes of numbers: 210 bytes seen, 540 as an object of its own."""
    taken = {}
    for count in (20_000, 60_000):
        tracemalloc.start()
        try:
            places, path, meta = Places(), Path("a.log"), Meta("record", COMPLETED, ())
            for number in range(count):
                places.add(Place(Head(f"{number:020x}", meta, 500, 600 + number, number, number, 700), path, number))
            taken[count] = tracemalloc.get_traced_memory()[0]
        finally:
            tracemalloc.stop()
    assert (taken[60_000] - taken[20_000]) / 40_000 < 260
