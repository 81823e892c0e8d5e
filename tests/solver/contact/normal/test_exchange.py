"""Exchanging wrong nodes: all of them while that helps, else one, and a set that comes back is known."""

import numpy as np

from nanoslip.solver.contact.normal import PATIENCE, Exchange

X = np.linspace(-0.5, 0.5, 9)
MIDDLE = np.abs(X) < 0.2
ENDS = np.abs(X) > 0.4


def test_all_wrong_nodes_change_sides_while_they_get_fewer() -> None:
    exchange = Exchange(X)
    for count in (9, 5, 2, 1):
        wrong = np.arange(9) < count
        following = exchange.exchanged(MIDDLE, wrong)
        np.testing.assert_array_equal(following.contact, MIDDLE ^ wrong)
        assert following.all_at_once


def test_only_the_one_furthest_right_does_where_they_have_not_got_fewer() -> None:
    exchange = Exchange(X)
    found = [exchange.exchanged(MIDDLE, ENDS) for _ in range(PATIENCE + 1)]
    assert [one.all_at_once for one in found] == [True] * PATIENCE + [False]
    np.testing.assert_array_equal(np.flatnonzero(found[-1].contact ^ MIDDLE), [8])
    fewer = ENDS & (X < 0.0)
    np.testing.assert_array_equal(exchange.exchanged(MIDDLE, fewer).contact, MIDDLE ^ fewer)


def test_a_set_that_comes_back_one_node_at_a_time_is_known_until_fewer_are_wrong() -> None:
    exchange = Exchange(X)
    for _ in range(PATIENCE):
        assert not exchange.exchanged(MIDDLE, ENDS).again
    other = exchange.exchanged(MIDDLE, ENDS)
    assert not other.again
    assert not exchange.exchanged(other.contact, ENDS).again
    assert exchange.exchanged(MIDDLE, ENDS).again
    exchange.exchanged(MIDDLE, ENDS & (X < 0.0))
    assert not exchange.exchanged(MIDDLE, ENDS).again


def test_the_lowest_node_stays_where_all_would_go() -> None:
    following = Exchange(X).exchanged(MIDDLE, MIDDLE)
    np.testing.assert_array_equal(X[following.contact], [0.0])


def test_the_sets_given_are_left_as_they_are() -> None:
    exchange, contact, wrong = Exchange(X), MIDDLE.copy(), MIDDLE.copy()
    for _ in range(PATIENCE + 1):
        exchange.exchanged(contact, wrong)
    np.testing.assert_array_equal(contact, MIDDLE)
    np.testing.assert_array_equal(wrong, MIDDLE)
