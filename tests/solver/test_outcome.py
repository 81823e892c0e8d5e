"""Whatever text an outcome is made of, its message is one line that can be shown and written."""

import pytest

from nanoslip.solver.outcome import LONGEST_MESSAGE, Ending, Outcome, printable


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain  μ_i = 0.5; needs 1", "plain  μ_i = 0.5; needs 1"),
        ("two\nlines\t", "two lines"),
        ("half \ud800", r"half \ud800"),
        ("\x1b[2J\x07", r"\x1b[2J\x07"),
        ("turned \u202e round", r"turned \u202e round"),
    ],
)
def test_a_message_is_one_line_that_can_be_shown(text: str, shown: str) -> None:
    assert Outcome(Ending.CRASHED, text).message == shown


@pytest.mark.parametrize("letter", ["x", "\ud800", "μ"])
def test_a_long_message_keeps_its_beginning_and_its_end(letter: str) -> None:
    """Advice stands at the end."""
    message = Outcome(Ending.CRASHED, "why: " + 2_000_000 * letter).adding("try again").message
    assert len(message) <= LONGEST_MESSAGE
    assert message.isprintable()
    assert (message[:5], message[-9:]) == ("why: ", "try again")


def test_lines_of_a_longer_text_stay() -> None:
    assert printable("first\n  \x1b second", 100) == "first\n  \\x1b second"


@pytest.mark.parametrize("most", [20, 21, 1000])
def test_a_text_too_long_keeps_as_much_of_its_beginning_as_of_its_end(most: int) -> None:
    text = "".join(chr(ord("a") + number % 26) for number in range(most + 1))
    assert printable(text[:most], most) == text[:most]
    first, last = printable(text, most).split(" ... ")
    assert text.startswith(first)
    assert text.endswith(last)
    assert len(first) + len(last) == most - 5
    assert abs(len(first) - len(last)) <= 1
