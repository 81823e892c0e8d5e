"""Python looks for no garbage meanwhile, and as before afterwards, whatever happened."""

import gc

import pytest

from nanoslip.study.garbage import all_kept


def test_the_search_is_over_only_for_a_while() -> None:
    def meanwhile() -> None:
        with all_kept():
            assert not gc.isenabled()
            raise ValueError("meanwhile")

    assert gc.isenabled()
    with pytest.raises(ValueError, match="meanwhile"):
        meanwhile()
    assert gc.isenabled()


def test_who_has_it_off_keeps_it_off() -> None:
    gc.disable()
    try:
        with all_kept():
            pass
        assert not gc.isenabled()
    finally:
        gc.enable()
