"""A field says once what its number is; names, twins in SI and dimensions follow from that."""

from dataclasses import dataclass, field

import pytest

from nanoslip.solver.parameter import SCALED, Quantity, companion, quantities, quantity


@dataclass(frozen=True)
class Made:
    plain: float = field(metadata=quantity("a number"))
    called: float = field(metadata=quantity("another", "its_own_name", "m", per="length", ensemble=True))
    with_twin: float = field(metadata=quantity("a length, in L_x", si=companion("a length", "m", "length")))
    undeclared: float


def test_a_quantity_is_called_after_its_field_unless_it_has_a_name() -> None:
    assert {key: each.name for key, each in quantities(Made).items()} == {
        "plain": "plain", "called": "its_own_name", "with_twin": "with_twin",
    }  # fmt: skip
    assert {key: each.name for key, each in quantities(Made, "part_").items()} == {
        "part_plain": "part_plain", "part_called": "its_own_name", "part_with_twin": "part_with_twin",
    }  # fmt: skip


def test_all_that_was_declared_is_there() -> None:
    assert quantities(Made)["called"] == Quantity("its_own_name", "another", "m", "length", ensemble=True)
    assert quantities(Made, "part_")["part_with_twin"].si == Quantity("part_with_twin_si", "a length", "m", "length")
    assert quantities(Made)["plain"].si is None


def test_what_has_an_uncertainty_has_it_and_a_count_of_members_beside_it() -> None:
    called = quantities(Made)["called"]
    assert [each.name for each in called.beside] == ["its_own_name_uncertainty", "its_own_name_members"]
    assert called.beside[0].per == "length"  # ± is scaled as its number is
    assert quantities(Made)["plain"].beside == ()


def test_a_scale_that_no_dataset_knows_is_refused_where_it_is_declared() -> None:
    with pytest.raises(ValueError, match=r"per = 'load' of force: needs one of \('', 'normal_load'"):
        quantity("a force", "force", per="load")
    assert all(quantity("a number", per=scale) for scale in SCALED)
