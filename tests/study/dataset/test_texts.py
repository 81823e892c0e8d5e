"""Texts come back from their characters as they were, and equal ones take the place of one."""

import numpy as np
import pytest
import xarray as xr

from nanoslip.study.dataset.file import are_texts, blocks, characters, longest, read_texts


@pytest.mark.parametrize("shape", [(1,), (7,), (3, 4, 5)])
@pytest.mark.parametrize("chunk", [None, 2])
def test_what_is_read_is_what_was_written_chunk_by_chunk(tmp_path, shape, chunk):
    texts = np.array([("", "μ_i", "0123456789")[number % 3] for number in range(np.prod(shape))], object).reshape(shape)
    dims = [f"d{number}" for number in range(len(shape))]
    chunks = {"chunksizes": [min(chunk, size) for size in (*shape, longest(texts))]} if chunk else {}
    xr.Dataset({"word": (dims, texts)}).to_netcdf(tmp_path / "texts.nc", encoding={"word": {"dtype": "S1", **chunks}})
    with xr.open_dataset(tmp_path / "texts.nc") as found:
        assert read_texts(found["word"].variable).tolist() == texts.tolist()


def test_a_single_text_is_an_array_too():
    assert read_texts(xr.Variable((), np.array("parabola", object))).tolist() == "parabola"


def test_characters_are_the_bytes_of_texts_filled_up():
    texts = np.array([["", "μ_i"], ["abcdef", "xyz"]], object)
    assert characters(texts, slice(0, 6)).tobytes() == "\0\0\0\0\0\0μ_i\0\0abcdefxyz\0\0\0".encode()
    assert characters(texts, slice(1, 3)).shape == (2, 2, 2)
    assert characters(texts, slice(1, 3))[1].tolist() == [[b"b", b"c"], [b"y", b"z"]]


@pytest.mark.parametrize("shape", [(), (0,), (1,), (7,), (3, 4, 5)])
@pytest.mark.parametrize("chunk", [1, 2, 100])
def test_blocks_cover_every_place_once(shape, chunk):
    seen = np.zeros(shape, int)
    for block in blocks(shape, [chunk] * len(shape)):
        assert all(cut.stop - cut.start <= chunk for cut in block)
        seen[block] += 1
    assert np.all(seen == 1)


def test_equal_texts_that_are_read_are_one_object():
    made = np.array(["a message " * 3 for _ in range(100)])  # its items are made anew each time
    assert len(set(map(id, read_texts(xr.Variable("case", made.astype(object))).tolist()))) == 1


@pytest.mark.parametrize(
    ("texts", "length"), [([], 1), ([""], 1), (["a", "abc"], 3), (["μ"], 2)], ids=["none", "empty", "letters", "bytes"]
)
def test_the_longest_text_is_told_in_bytes(texts, length):
    assert longest(np.array(texts, object)) == length


def test_texts_are_told_from_numbers():
    assert are_texts(xr.Variable("case", np.array(["a", "b"], object)))
    assert are_texts(xr.Variable((), "a"))
    assert not are_texts(xr.Variable("case", [1.0, 2.0]))
