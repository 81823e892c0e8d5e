"""No dataset, whoever wrote it, ends a command in a traceback or speaks to the terminal."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import pytest

from nanoslip.study.dataset import file
from nanoslip.study.results.store import StoreError
from tests.conftest import Main

ESCAPE = "\x1b[31mred\x1b]0;title\x07"
TURNED = "a\u202eb"
Damage = Callable[[netCDF4.Dataset], None]


def lost(name: str) -> Damage:
    return lambda opened: opened.delncattr(name)


def stated(path: str, name: str, value: Any) -> Damage:
    """An attribute of a variable or group; of the root where the path is empty."""
    return lambda opened: (opened[path] if path else opened).setncattr(name, value)


def filled(path: str, value: Any) -> Damage:
    def damage(opened: netCDF4.Dataset) -> None:
        opened[path][...] = np.full(opened[path].shape, value, opened[path].dtype)

    return damage


def renamed(*names: str) -> Damage:
    """Variables or groups of other names, as if the known ones were lost."""

    def damage(opened: netCDF4.Dataset) -> None:
        for name in names:
            place, _, own = name.rpartition("/")
            inside = opened[place] if place else opened
            (inside.renameGroup if own in inside.groups else inside.renameVariable)(own, f"other_{own}")

    return damage


def retyped(path: str, kind: Any) -> Damage:
    """A variable of another type in its place."""

    def damage(opened: netCDF4.Dataset) -> None:
        dims = opened[path].dimensions
        renamed(path)(opened)
        place, _, own = path.rpartition("/")
        (opened[place] if place else opened).createVariable(own, kind, dims)

    return damage


def with_text(text: str) -> Damage:
    """All texts of the table."""

    def damage(opened: netCDF4.Dataset) -> None:
        held = opened["texts/text"]
        letters = np.zeros(held.shape, "S1")
        raw = text.encode()[: held.shape[1]]
        letters[:, : len(raw)] = np.frombuffer(raw, "S1")
        held[...] = letters

    return damage


def added(opened: netCDF4.Dataset) -> None:
    """Variables and attributes of somebody's own."""
    opened.createVariable("mine", "f8", ("radius",))[:] = 1.0
    opened.createVariable("of_drives", "f8", ("radius", "drive"))[:] = 1.0
    opened.setncattr("temperature", 20.0)


def noted(opened: netCDF4.Dataset) -> None:
    """A text of somebody's own in the manifest, where TOML allows any letter."""
    opened.setncattr("manifest", f'{opened.getncattr("manifest")}\n[mine]\nnote = "a\\u202eb\\u001b[31m"\n')


REFUSED: dict[str, Damage] = {
    "no title": lost("title"),
    "title NaN": stated("", "title", np.nan),
    "title a number": stated("", "title", 3),
    "title with escapes": stated("", "title", ESCAPE),
    "title that turns": stated("", "title", TURNED),
    "format a text": stated("", "nanoslip_format", "5"),
    "format NaN": stated("", "nanoslip_format", np.nan),
    "manifest no TOML": stated("", "manifest", "a = ["),
    "manifest a number": stated("", "manifest", 1.0),
    "checksum a number": stated("", "manifest_sha256", 2),
    "version with escapes": stated("", "nanoslip_version", ESCAPE),
    "version NaN": stated("", "nanoslip_version", np.nan),
    "commit a list": stated("", "source_commit", [1, 2]),
    "own attribute with escapes": stated("", "mine", ESCAPE),
    **{f"slab_width {value}": stated("", "slab_width", value) for value in (np.nan, 5e-324, 0.0, -1.0, np.inf, "wide")},
    "modulus a list": stated("", "shear_modulus", [1.0, 2.0]),
    "units with escapes": stated("plateau_mean", "units", ESCAPE),
    "units a number": stated("radius", "units", np.nan),
    "meaning with escapes": stated("plateau_mean", "long_name", ESCAPE),
    "meaning NaN": stated("plateau_mean", "long_name", np.nan),
    "meaning a number": stated("radius", "long_name", 5),
    "meaning in a group that turns": stated("record/displacement", "long_name", TURNED),
    "words a number": stated("outcome", "flag_meanings", 3),
    "no words": stated("outcome", "flag_meanings", ""),
    "negative error": filled("plateau_mean_uncertainty", -1.0),
    "no meaning": stated("plateau_mean", "long_name", ""),
    "meaning of spaces in a group": stated("record/displacement", "long_name", "  "),
    "other storage": stated("outcome", "stored_as", np.nan),
    "storage without words": stated("message", "stored_as", "flag_meanings"),
    "companion a number": stated("plateau_mean", "ancillary_variables", 1.0),
    "code beyond the words": filled("outcome", 99),
    "code below the words": filled("outcome", -5),
    "axis of one value": filled("radius", 50.0),
    "axis NaN": filled("intrinsic_friction", np.nan),
    "axis lost": renamed("radius"),
    "drive of one name": filled("drive", b"a"),
    "drive with escapes": filled("drive", b"\x1b"),
    "text with escapes": with_text(ESCAPE),
    "text that turns": with_text(TURNED),
    "texts lost": renamed("texts/text"),
    "names lost": renamed("case_id"),
    "reasons lost": renamed("message"),
    "outcomes lost": renamed("outcome"),
    "record names lost": renamed("record_id"),
    "records lost": renamed("record"),
    "records of other names": filled("record_id", 12345),
    "software lost": renamed("software"),
    "row sizes lost": renamed("record/row_size"),
    "row sizes too large": filled("record/row_size", 10**9),
    "row sizes below 0": filled("record/row_size", -1),
    "row sizes no numbers": retyped("record/row_size", "S1"),
    "members below 0": filled("members", -3.0),
    "members without end": filled("members", np.inf),
    "radius a text": retyped("radius", str),
    "plateau a text": retyped("plateau_mean", str),
    "flags with decimals": retyped("validity_flags", "f8"),
    "outcome a number": retyped("outcome", "f8"),
}
"""What `collect` never writes."""
OF_EACH_SORT = (
    *("no title", "title with escapes", "manifest no TOML", "version NaN", "slab_width wide", "units with escapes"),
    *("meaning NaN", "code beyond the words", "axis NaN", "axis lost", "drive with escapes", "text that turns"),
    *("texts lost", "records lost", "row sizes too large", "members without end", "plateau a text"),
)
"""Of `REFUSED`, one of each place and way: every command meets them in `open_dataset`, which another test gives all of them."""
ANSWERED: dict[str, Damage] = {
    "nothing": lambda _: None,
    "long title": stated("", "title", "x" * 10**5),
    "no manifest": lost("manifest"),
    "manifest that turns": noted,
    "no scales": lost("slab_width"),
    "no version": lost("nanoslip_version"),
    "other flags": stated("validity_flags", "flag_meanings", "a"),
    "no such companion": stated("plateau_mean", "ancillary_variables", "nothing"),
    "own variables": added,
    **{f"plateau {value}": filled("plateau_mean", value) for value in (np.inf, -np.inf, np.nan, 5e-324, 1.7e308)},
    "tiny parameter": filled("normal_load", 5e-324),
    "flags of all bits": filled("validity_flags", -1),
    "cases of one name": filled("case_id", 7),
    "plateau lost": renamed("plateau_mean"),
    "error lost": renamed("plateau_mean_uncertainty"),
    "flags lost": renamed("validity_flags"),
    "regime lost": renamed("regime"),
    "members lost": renamed("members"),
    "force NaN": filled("record/event_force_after", np.nan),
    "force beyond any drawing": filled("record/event_force_after", 1e308),
    "place beyond any drawing": filled("record/displacement", 1e308),
    "all groups lost": renamed(
        *("record", "trajectory", "contact", "interior", "software"),
    ),
    "other software": filled("computed_by", 12345),
}
"""What a part, a sum of several, or another program may write."""


@pytest.fixture
def hostile(request: pytest.FixtureRequest, full_folder: Path, tmp_path: Path) -> Path:
    path = shutil.copy(full_folder / file.FILE, tmp_path / "hostile.nc")
    with netCDF4.Dataset(path, "a") as opened:
        opened.set_auto_mask(False)
        request.param(opened)
    return path


def commands(path: Path, sound: Path, out: Path) -> list[list[object]]:
    one = ["intrinsic_friction=0.5", "radius=50"]
    return [
        ["show", path],
        ["show", path, *one],
        ["figure", path, "-o", out / "figure.png"],
        ["figure", path, "--y", "plateau_mean", "-o", out / "figure.png"],
        ["report", path],
        ["compare", path, sound],
        ["compare", sound, path],
        ["verify", path, "--sample", 1],
        ["explain", path],
        ["frames", path, *one, "--events", "0", "-o", out / "frames.png"],
        *(["export", path, form, "-o", out / "table"] for form in ("--csv", "--json", "--records", "--trajectories")),
        ["sensitivity", path, "--of", "plateau_mean"],
    ]


@pytest.mark.slow
@pytest.mark.parametrize("hostile", REFUSED.values(), ids=REFUSED, indirect=True)
@pytest.mark.everyday(3)
def test_what_nanoslip_never_writes_is_refused_in_one_line(hostile):
    with pytest.raises(StoreError) as refused:
        file.open_dataset(hostile).close()
    assert str(refused.value).isprintable()


@pytest.mark.slow
@pytest.mark.parametrize(
    "hostile",
    [*map(REFUSED.__getitem__, OF_EACH_SORT), *ANSWERED.values()],
    ids=[*OF_EACH_SORT, *ANSWERED],
    indirect=True,
)
def test_every_command_answers_in_printable_lines(hostile, full_folder, tmp_path, main: Main):
    for words in commands(hostile, full_folder / file.FILE, tmp_path):
        code, out, err = main(*words)
        assert code in (0, 1, 2), words
        assert all(line.isprintable() for line in (out + err).splitlines()), words


@pytest.mark.parametrize("content", [b"", b"\x89HDF\r\n\x1a\n", b"CDF\x01" + bytes(28), b"\x1b[31m" * 99])
def test_a_file_of_another_kind_is_refused(content, tmp_path, main: Main):
    (tmp_path / "hostile.nc").write_bytes(content)
    code, _, err = main("show", tmp_path / "hostile.nc")
    assert code == 2
    assert len(err.splitlines()) <= 3
    assert err.replace("\n", "").isprintable()
