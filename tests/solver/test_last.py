"""A function that remembers its last answer gives the one that it would give."""

from nanoslip.solver.last import of_the_last


def test_the_very_same_value_is_answered_once_and_an_equal_one_again() -> None:
    asked = []

    @of_the_last
    def total(numbers: tuple[float, ...]) -> float:
        asked.append(numbers)
        return sum(numbers)

    first, other = (1.0, 2.0), (4.0,)
    equal = first[:1] + first[1:]
    assert [total(each) for each in (first, first, equal, other, other, first)] == [3.0, 3.0, 3.0, 4.0, 4.0, 3.0]
    assert asked == [first, equal, other, first]
