"""A result as bytes says the same as the value it was, always in the same bytes, none of which can change unseen."""

import io
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.study.origin import here
from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results.entry import ALIGNED, CorruptResultError, TornError, check, packed, read_head, result_of
from tests.study.results.results import ALL, RECORD, forged, same


def unpacked(content: bytes) -> TaskResult:
    file = io.BytesIO(content)
    head = read_head(file)
    numbers = file.read(head.numbers)
    check(head, numbers)
    assert head.length == len(content)
    return result_of(head, numbers)


@pytest.mark.parametrize("result", ALL, ids=lambda result: result.kind)
def test_what_is_packed_is_unpacked(result):
    known = replace(result, origins=(here(),))
    assert same(unpacked(packed(known)), known)


def test_the_same_result_is_the_same_bytes():
    backwards = replace(RECORD, scalars=dict(reversed(list(RECORD.scalars.items()))))
    assert packed(backwards) == packed(RECORD)


def test_arrays_lie_as_kernels_want_them_and_cannot_be_changed():
    content = packed(RECORD)
    assert len(content) % ALIGNED == 0
    for array in unpacked(content).arrays.values():
        assert array.flags.aligned
        assert not array.flags.writeable


def test_no_bit_of_an_entry_changes_without_being_found():
    content = packed(RECORD)
    for bit in range(8 * len(content)):
        changed = bytearray(content)
        changed[bit // 8] ^= 1 << bit % 8
        with pytest.raises(CorruptResultError):
            unpacked(bytes(changed))


def test_an_entry_cut_short_anywhere_is_torn():
    content = packed(RECORD)
    for length in range(len(content)):
        with pytest.raises(TornError):
            unpacked(content[:length])


META = b'{"kind": "record", "ending": "completed", "message": "", "origins": []}'


@pytest.mark.parametrize(
    ("meta", "table"),
    [
        (b"", b""),
        (b"[]", b""),
        (b"{}", b""),
        (b"[" * 100_000, b""),
        (META.replace(b"completed", b"done"), b""),
        (META, b""),
        (META, b"[]"),
        (META, b"[" * 100_000),
        (META, b'{"scalars": {}, "arrays": [["x", "<f8", [-5], false]]}'),
        (META, b'{"scalars": {}, "arrays": [["x", "<f8", [1000], false]]}'),
        (META, b'{"scalars": {}, "arrays": [["x", "<f8", [4611686018427387904, 4], false]]}'),
        (META, b'{"scalars": {}, "arrays": [["x", "<f8", [1e300], false]]}'),
        (META, b'{"scalars": {}, "arrays": [["x", "|O", [1], false]]}'),
        (META, b'{"scalars": {}, "arrays": [["x", "no type", [1], false]]}'),
        (META, b'{"scalars": {}, "arrays": [5]}'),
    ],
)
def test_what_is_no_result_in_spite_of_its_checksums_is_corrupt(meta: bytes, table: bytes) -> None:
    with pytest.raises(CorruptResultError, match="its content is no result's"):
        unpacked(forged(meta, table, table=len(table)))
    with pytest.raises(CorruptResultError):
        unpacked(forged(META, key=b"\xff" * 20))


def test_what_no_result_holds_is_refused():
    with pytest.raises(ValueError, match="no key of a result"):
        packed(replace(RECORD, key="short"))
    with pytest.raises(ValueError, match="objects"):
        packed(replace(RECORD, arrays={"words": np.array(["a", None], dtype=object)}))
