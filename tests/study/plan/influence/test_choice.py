"""Every set of effects within the tolerance is an option, once; the cheapest choice is that of all that are tried one by one."""

import itertools
import math

import numpy as np
import pytest

from study.plan.influence.choice import BEATEN, LEAST_SAVING, Asked, Choice, Found, Option, Part, cheapest
from study.plan.influence.length import errors_within

CHANGES = {"one": 0.004, "two": 0.005, "three": 0.002}
SAVES = {"one": 5.0, "two": 2.0, "three": 1.0}


def choice(name: str, reason: str = "") -> Choice:
    return Choice(name, False, np.array([CHANGES[name], math.nan]), SAVES[name], reason)


PART = Part(10.0, tuple(map(choice, CHANGES)), {0.005: 0.2, 0.002: 0.5}, "")


@pytest.mark.parametrize("within", [0.001, 0.004, 0.0065, 0.0095, 0.012])
def test_every_set_that_stays_within_is_an_option(within: float) -> None:
    """By the sum of its changes, and the product of what is left of the time; what is not asked for may be unknown."""
    found = PART.options([0], within)
    sets = itertools.chain.from_iterable(itertools.combinations(CHANGES, size) for size in range(4))
    assert {each.effects for each in found} == {each for each in sets if sum(CHANGES[name] for name in each) <= within}
    assert [each.seconds for each in found] == sorted(each.seconds for each in found)
    for each in found:
        assert each.changes[0] == pytest.approx(sum(CHANGES[name] for name in each.effects))
        assert each.seconds == pytest.approx(10.0 * math.prod(1.0 - SAVES[name] / 10.0 for name in each.effects))


def test_what_has_a_reason_to_stay_is_no_option() -> None:
    part = PART._replace(choices=(choice("one", "matters"), choice("two")))
    assert {each.effects for each in part.options([0], 1.0)} == {(), ("two",)}
    taken = {each.effect: (each.left_out, each.reason) for each in part.taken(("two",))}
    assert taken == {"one": (False, "matters"), "two": (True, "")}
    assert {each.reason for each in part.taken(())} == {"matters", BEATEN}


def test_a_length_says_what_it_saves_or_why_it_is_whole() -> None:
    assert PART.length(0.002) == (0.002, 5.0, "")
    assert PART.length(None) == (None, 8.0, BEATEN)
    assert PART._replace(shorter={}).length(None) == (None, 0.0, "saves nothing")
    assert PART._replace(shorter={}, stays="kept by the file").length(None) == (None, 0.0, "kept by the file")


WITHIN = 0.01
ASKED = Asked(WITHIN, [0, 1], [True, True], [False, True])
"""The plateau, and kinetic friction, which the length of a drive is an error of too."""


def part(draw: np.random.Generator, effects: int, of_drive: bool) -> Part:
    seconds = float(draw.uniform(0.5, 2.0))
    choices = []
    for number in range(effects):
        change = float(10.0 ** draw.uniform(-3.5, -1.9))
        influence = np.array([0.0 if of_drive else change, change])
        choices.append(Choice(f"effect {number}", False, influence, seconds * float(draw.uniform(0.05, 0.9)), ""))
    shares = np.sort(draw.uniform(0.1, 0.9, len(errors_within(WITHIN))))
    if of_drive:
        shares[:] = shares[0]
    return Part(seconds, tuple(choices), dict(zip(errors_within(WITHIN), shares.tolist(), strict=True)), "")


def lengths(of: Part) -> list[tuple[float | None, float]]:
    return [(None, 1.0), *of.shorter.items()]


def worth_it(of: Part, option: Option) -> bool:
    return option.seconds * (1.0 - min(of.shorter.values())) > LEAST_SAVING * of.seconds


def fits(changes: tuple[float, ...], of_record: float, of_drive: float) -> bool:
    """Changes add up, twice the errors are added as squares."""
    plateau = math.sqrt(changes[0] ** 2 + 4.0 * of_record**2)
    kinetic = math.sqrt(changes[1] ** 2 + 4.0 * of_record**2 + 4.0 * of_drive**2)
    return max(plateau, kinetic) <= WITHIN * (1.0 + 1e-12)


def tried_one_by_one(record: Part, drives: list[Part]) -> float:
    best = math.inf
    everything = 1.0  # a tolerance that lets every set be an option
    for option, (error, share) in itertools.product(record.options(ASKED.columns, everything), lengths(record)):
        if not fits(option.changes, error or 0.0, 0.0):
            continue
        total = option.seconds * share
        for drive in drives:
            total += min(
                (
                    mine.seconds * part_of_it
                    for mine, (own, part_of_it) in itertools.product(
                        drive.options(ASKED.columns, everything), lengths(drive)
                    )
                    if fits(tuple(np.add(option.changes, mine.changes)), error or 0.0, own or 0.0)
                    and (own is None or worth_it(drive, mine))
                ),
                default=math.inf,
            )
        best = min(best, total)
    return best


def chosen(seed: int) -> tuple[Part, dict[str, Part], Found]:
    draw = np.random.default_rng(seed)
    record = part(draw, 2, of_drive=False)
    drives = {label: part(draw, 2, of_drive=True) for label in ("a", "b")}
    return record, drives, cheapest(record, drives, ASKED)


@pytest.mark.parametrize("seed", range(40))
def test_nothing_is_cheaper(seed: int) -> None:
    record, drives, found = chosen(seed)
    assert found.seconds == pytest.approx(tried_one_by_one(record, list(drives.values())), rel=1e-12)


@pytest.mark.parametrize("seed", range(40))
def test_what_is_chosen_stays_within_the_tolerance_and_takes_what_it_says(seed: int) -> None:
    record, drives, found = chosen(seed)
    options = {option.effects: option for option in record.options(ASKED.columns, WITHIN)}
    error, total = found.errors[""], 0.0
    total += options[found.of_case].seconds * dict(lengths(record))[error]
    assert fits(options[found.of_case].changes, error or 0.0, 0.0)
    for label, drive in drives.items():
        mine = {option.effects: option for option in drive.options(ASKED.columns, WITHIN)}[found.of_drives[label]]
        assert fits(
            tuple(np.add(options[found.of_case].changes, mine.changes)), error or 0.0, found.errors[label] or 0.0
        )
        total += mine.seconds * dict(lengths(drive))[found.errors[label]]
    assert found.seconds == pytest.approx(total, rel=1e-12)


def test_where_lengths_are_whole_only_effects_are_chosen() -> None:
    record, drives, _ = chosen(1)
    found = cheapest(
        record._replace(shorter={}), {label: each._replace(shorter={}) for label, each in drives.items()}, ASKED
    )
    assert set(found.errors.values()) == {None}
