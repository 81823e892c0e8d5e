"""The dataset as a file: its name, seal and format, its groups; written whole, read, up to date."""

import errno
import hashlib
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Final

import netCDF4
import numpy as np
import xarray as xr

from nanoslip.solver.outcome import NanoslipError
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset import texts
from nanoslip.study.dataset.texts import TEXTS, TextsByName, are_stored, are_texts
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.origin import all_sources_hash
from nanoslip.study.results import files
from nanoslip.study.results.files import NO_FILE, free_name, is_no_file, open_regular, write_fully, writing_whole
from nanoslip.study.results.store import Store, StoreError

# The last line of a dataset's file: a checksum of all before it. netCDF ignores it; whoever changes the file removes it.

_LINE: Final = re.compile(rb"\nsha256 ([0-9a-f]{64})\n")
_LENGTH: Final = len("\nsha256 \n") + 64
_CHUNK: Final = 2**20


def seal(path: Path) -> None:
    """Append the checksum line to a file."""
    digest = _digest(path, path.stat().st_size)
    write_fully(path, [f"\nsha256 {digest}\n".encode("ascii")], os.O_APPEND)


def read_seal(path: Path) -> str | None:
    """The checksum that a file ends with, None if it has none. Raises OSError."""
    length = path.stat().st_size - _LENGTH
    if length < 0:
        return None
    with path.open("rb") as file:
        file.seek(length)
        line = _LINE.fullmatch(file.read())
    return line[1].decode("ascii") if line else None


def _digest(path: Path, length: int) -> str:
    """Checksum of the first bytes of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while length > 0 and (chunk := file.read(min(_CHUNK, length))):
            digest.update(chunk)
            length -= len(chunk)
    return digest.hexdigest()


def has_its_bytes(path: Path) -> bool:
    """True if no byte of a file has changed since it was collected, or if it is edited."""
    try:
        check_seal(path)
    except (StoreError, OSError):
        return False
    return True


def is_edited(path: Path) -> bool:
    """True if somebody has changed a dataset since it was collected: a library that writes to it removes its last line.

    False for a damaged or foreign file.
    """
    try:
        # Where only the line is damaged there is more behind what HDF5 takes for the end.
        if is_no_file(path) or read_seal(path) is not None or _end_of_hdf5(path) != path.stat().st_size:
            return False
        with netCDF4.Dataset(path) as dataset:
            return FORMAT in dataset.ncattrs()
    except _REFUSALS:
        return False


def _end_of_hdf5(path: Path) -> int:
    """Bytes of a file as its superblock states them (HDF5 File Format Specification, II.A); 0 of another file."""
    with path.open("rb") as file:
        begin = file.read(_SUPERBLOCK)
    # The format's signature; the version of the superblock is the byte after it.
    if len(begin) < _SUPERBLOCK or not begin.startswith(b"\x89HDF\r\n\x1a\n"):
        return 0
    at = _END_AT.get(begin[8], 0)
    return int.from_bytes(begin[at : at + 8], "little") if at else 0


_SUPERBLOCK: Final = 64
_END_AT: Final = {0: 40, 1: 44, 2: 28, 3: 28}
"""Version of a superblock -> place of its end-of-file address, with addresses of eight bytes."""


def keep_edited(path: Path) -> Path | None:
    """Give an edited dataset another name before it is written anew, so that no edit is lost. Raises OSError."""
    if not is_edited(path):
        return None
    kept = free_name(path)
    path.rename(kept)
    return kept


def require_closed(path: Path) -> None:
    """Raise StoreError if another program has a file open for writing: HDF5 locks it. No lock is asked of other systems."""
    # A link is replaced, not the file that it leads to.
    if is_no_file(path):
        return
    with suppress(ImportError, FileNotFoundError):
        import fcntl  # noqa: PLC0415  not everywhere

        with os.fdopen(open_regular(path), "rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                raise StoreError(
                    f"{path}: open for writing in another program, a notebook perhaps: close it there"
                ) from None
            # A file system without locks.
            except OSError:
                return


# The groups of a dataset beside its root: records, event sizes, trajectories, contacts, the inside of the slab, the software.
#
# In a file they are groups of netCDF-4. In Python the root is an `xr.Dataset` of scalars over the cases that carries the groups
# with it, in its encoding and in that of `case_id`: selections keep the one, `where` the other.

_KEY: Final = "nanoslip_groups"
_LABEL: Final = "case_id"
"""The coordinate that every dataset of nanoslip has."""
ROOT: Final = "/"


class LostGroupsError(NanoslipError, ValueError):
    """A dataset that lost the link to its records and trajectories."""


class Groups(dict[str, xr.Dataset]):
    """Name -> group. Never changed once it is carried by a dataset: copies of the dataset share it."""

    def __copy__(self) -> "Groups":
        return self

    def __deepcopy__(self, _memo: Any) -> "Groups":
        return self


def carrying(root: xr.Dataset, groups: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Let a root carry its groups, which `read_groups` finds again; returns the root."""
    carried = Groups(groups)
    root.encoding = {**root.encoding, _KEY: carried}
    if _LABEL in root.variables:
        root[_LABEL].encoding[_KEY] = carried
    return root


def read_groups(root: xr.Dataset) -> Groups:
    """The groups of a dataset, of its selections, or of a file that xarray itself opened. Raises LostGroupsError."""
    places = [root.encoding]
    if _LABEL in root.variables:
        places.append(root[_LABEL].encoding)
    for encoding in places:
        if _KEY in encoding:
            carried: Groups = encoding[_KEY]
            return carried
    for encoding in places:
        if Path(str(encoding.get("source", ""))).is_file():
            return Groups(open_groups(Path(encoding["source"]))[1])
    raise LostGroupsError(
        "this dataset has lost its records and trajectories: ask the dataset that nanoslip.open, nanoslip.run or "
        "nanoslip.concat returned, or a selection of it, before computing with it"
    )


def open_groups(path: Path) -> tuple[xr.Dataset, dict[str, xr.Dataset]]:
    """Root and groups of a file; numbers are read when they are used, texts at once. Raises OSError, ValueError, KeyError."""
    groups = xr.open_groups(path, engine="netcdf4")
    opened = {name.strip("/"): group for name, group in groups.items()}
    closing = [group._close for group in opened.values() if group._close]
    try:
        table = texts.text_table(opened.pop(TEXTS, None))
        for group in opened.values():
            _decode(group, table)
    except Exception:
        _close_all(closing)
        raise
    root = opened.pop("")
    root.set_close(partial(_close_all, closing))
    return root, opened


def _decode(group: xr.Dataset, table: TextsByName) -> None:
    """Put its texts into a root or group, in place: a copy would take an eighth of the time of opening."""
    for variable in group.variables.values():
        if are_stored(variable):
            decoded = texts.decode_texts(variable, table)
            variable.data, variable.attrs, variable.encoding = decoded.data, decoded.attrs, decoded.encoding
        elif are_texts(variable):
            variable.load()


def with_texts(root: xr.Dataset) -> xr.Dataset:
    """The dataset, with its texts also where xarray itself has opened the file, which has numbers for them."""
    if not any(are_stored(variable) for variable in root.variables.values()):
        return root
    decoded = root.copy()
    source = Path(str(root.encoding.get("source", "")))
    if source.is_file():
        with xr.open_dataset(source, group=TEXTS, engine="netcdf4") as group:
            _decode(decoded, texts.text_table(group))
    else:
        _decode(decoded, {})
    return decoded


def _close_all(closing: Sequence[Callable[[], None]]) -> None:
    """No inner function: datasets are pickled with the function that closes them."""
    for close in closing:
        close()


def make_tree(root: xr.Dataset) -> xr.DataTree:
    """Root and groups as one tree."""
    return xr.DataTree.from_dict({ROOT: root, **read_groups(root)})


def load_dataset(root: xr.Dataset) -> xr.Dataset:
    """The dataset with all values in memory, its groups' too."""
    loaded = root.load()
    groups = read_groups(root)
    return carrying(loaded, {name: groups[name].load() for name in groups})


def flatten_variables(root: xr.Dataset) -> dict[str, xr.DataArray]:
    """Every variable by its path: `plateau_mean`, `record/event_slips`."""
    variables = {str(name): root[name] for name in root.variables}
    for group, values in read_groups(root).items():
        variables |= {f"{group}/{name}": values[name] for name in values.variables}
    return variables


SMALLEST_COMPRESSED: Final = 512
"""Values from which a variable is compressed: below, the chunks that it then has take more than they save."""
_COMPRESSED: Final = {"zlib": True, "complevel": 1, "shuffle": True}
"""Level 9 saves 1 % more than level 1 (measured in docs/dataset.md)."""


def write_tree(tree: xr.DataTree, path: Path) -> None:
    """Write the file. Raises OSError, RuntimeError if the disk refuses."""
    # Values are written last, as netCDF writes all definitions anew for each one that follows a value.
    pairs: list[tuple[Any, xr.Variable]] = []
    usual = netCDF4.get_chunk_cache()
    # Else all chunks of all variables stay in memory until the file is closed.
    netCDF4.set_chunk_cache(0)
    try:
        with netCDF4.Dataset(path, "w") as opened:
            for place, group in _file_content(tree):
                pairs += _define_group(opened.createGroup(place), group)
            for target, variable in pairs:
                target[...] = variable.values
    finally:
        netCDF4.set_chunk_cache(*usual)


def _file_content(tree: xr.DataTree) -> Iterator[tuple[str, xr.Dataset]]:
    """Place and content of root and groups as the file has them, without encoding; then the texts of the root by name."""
    root, table = tree.to_dataset(inherit=False).drop_encoding(), TextsByName()
    root_names = {_LABEL, *root.data_vars}
    words = {name: variable for name, variable in root.variables.items() if are_texts(variable)}
    # Characters remain: texts without a dimension, and labels, along the one dimension that they label.
    over = [name for name, variable in words.items() if variable.ndim > (name not in root_names)]
    codes = {name: texts.encode_texts(words[name], table) for name in over}
    yield ROOT, root.assign(codes)
    for node in tree.descendants:
        yield node.path, node.to_dataset(inherit=False).drop_encoding()
    # Last: encoding the texts of the root has filled the table.
    if over:
        yield TEXTS, texts.as_group(table)


# A group as xarray itself writes it (`to_netcdf`), in a fifth less time: a small dataset is mostly definitions.


def _define_group(target: netCDF4.Group, group: xr.Dataset) -> Iterator[tuple[Any, xr.Variable]]:
    """Define attributes, dimensions and variables of a group; each variable with what its values are written from."""
    coordinates = set(map(str, group.coords))
    lists = _coordinate_lists(group)
    apart = sorted(coordinates.difference(group.dims, *lists.values()))
    target.setncatts(group.attrs | ({"coordinates": " ".join(apart)} if apart else {}))
    encoded = {}
    for name, variable in group.variables.items():
        beside = lists.get(str(name))
        encoded[str(name)] = _encode(variable, {"coordinates": " ".join(beside)} if beside else {})
    sizes = [size for variable in encoded.values() for size in variable.sizes.items()]
    for dim, size in dict.fromkeys(sizes):
        _define_dimension(target, str(dim), size)
    for name, variable in encoded.items():
        settings: dict[str, Any] = _COMPRESSED if group.variables[name].size >= SMALLEST_COMPRESSED else {}
        # Coordinates have no missing values (CF 2.5.1).
        fill = np.nan if variable.dtype.kind == "f" and name not in coordinates else None
        defined: Any = target.createVariable(name, variable.dtype, map(str, variable.dims), fill_value=fill, **settings)
        defined.setncatts(variable.attrs)
        defined.set_auto_maskandscale(False)
        defined.set_auto_chartostring(False)
        yield defined, variable


def _coordinate_lists(group: xr.Dataset) -> dict[str, list[str]]:
    """Variable -> its coordinates, without labels of dimensions (CF 5)."""
    labels = sorted(str(name) for name in group.coords if name not in group.dims)
    places = {name: set(group.variables[name].dims) for name in labels}
    lists = {}
    for name in map(str, group.data_vars):
        dims = set(group.variables[name].dims)
        lists[name] = [label for label, place in places.items() if place <= dims]
    return lists


def _define_dimension(target: netCDF4.Group, name: str, size: int) -> None:
    """Define a dimension of a group, unless it or its parent has it."""
    for group in filter(None, (target, target.parent)):
        if name in group.dimensions and len(group.dimensions[name]) == size:
            return
    target.createDimension(name, size)


def _encode(variable: xr.Variable, further: Mapping[str, str]) -> xr.Variable:
    """A variable in a type of netCDF, with further attributes: characters for texts, as strings of variable length crash it
    (nanoslip.study.dataset.texts), small numbers for switches."""
    attributes = {**variable.attrs, **further}
    if variable.dtype.kind == "b":
        return xr.Variable(variable.dims, variable.values.astype(np.int8), {**attributes, "dtype": "bool"})
    if not are_texts(variable):
        return xr.Variable(variable.dims, variable.data, attributes)
    texts_in_bytes = [str(text).encode() for text in variable.values.ravel().tolist()]
    length = max(map(len, texts_in_bytes), default=0) or 1
    characters = np.array(texts_in_bytes, f"S{length}").view("S1").reshape(*variable.shape, length)
    return xr.Variable((*variable.dims, f"string{length}"), characters, {**attributes, "_Encoding": "utf-8"})


ROOM: Final = 1 << 20
"""Bytes that a disk takes that is not full."""
FILE: Final = "results.nc"
FORMAT: Final = "nanoslip_format"
VERSION: Final = 5
"""Attribute of a dataset, and its value: to be raised whenever a variable is added, renamed or given another meaning."""
MIXED: Final = "mixed_software"
"""Attribute of a dataset with results of several software versions: names all of them, with counts."""

MOST_CHECKED: Final = 2**30
"""Bytes of a file that are checked when it is opened, in about a second; `nanoslip verify` checks any."""

_REFUSALS: Final = (OSError, RuntimeError)
"""Errors that netCDF raises if bytes are missing or wrong, or the disk is full."""
_UNREADABLE: Final = (*_REFUSALS, ArithmeticError, AttributeError, LookupError, MemoryError, TypeError, ValueError)
"""Errors that xarray raises of attributes, encodings and sizes in files of others."""


class DatasetFormatError(StoreError):
    """A dataset by a nanoslip that writes another format."""


def write_netcdf(dataset: xr.Dataset, path: Path) -> None:
    """Write the dataset and its groups as netCDF-4, whole or not at all. Raises StoreError, LostGroupsError."""
    tree = make_tree(dataset)
    try:
        if path.is_file():
            require_closed(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with writing_whole(path) as scratch:
            try:
                write_tree(tree, scratch)
            except RuntimeError:
                # netCDF does not say that the disk is full; this write does.
                write_fully(scratch, [bytes(ROOM)], os.O_APPEND)
                raise
            # Sealed under the scratch name: nobody sees a dataset without its checksum.
            seal(scratch)
    except _REFUSALS as error:
        raise StoreError(f"{path}: cannot be written: {_reason(error)}") from None


def open_dataset(path: Path) -> xr.Dataset:
    """Open a dataset with its groups; values are read when they are used, so close it (or use `with`). Raises StoreError.

    A file of up to MOST_CHECKED bytes is refused where any of them has changed since it was collected.
    """
    try:
        # To read a pipe would never end.
        if os.path.lexists(path) and not path.is_file():
            raise OSError(errno.EINVAL, NO_FILE)
        if path.is_file() and not path.is_symlink():
            require_closed(path)
        if path.stat().st_size <= MOST_CHECKED:
            check_seal(path)
        root, groups = open_groups(path)
    except _UNREADABLE as error:
        raise StoreError(f"{path}: no dataset ({_reason(error)}); run or collect the campaign first") from None
    # The format before the content: a newer one has names that this version would call foreign.
    if problem := _other_format(root.attrs):
        root.close()
        raise DatasetFormatError(f"{path}: {problem}")
    from nanoslip.study.dataset.content import find_problem  # noqa: PLC0415  a run writes its file and reads none

    if problem := find_problem({"": root, **groups}):
        root.close()
        raise StoreError(f"{path}: {problem}")
    return carrying(root, groups)


def _other_format(said: Mapping[str, Any]) -> str:
    """Reason why this version cannot read a file with these attributes, and the version that can; empty if it can."""
    form = said.get(FORMAT)
    if not isinstance(form, int | np.integer):
        return f"no dataset of nanoslip: it has no attribute {FORMAT}"
    if form == VERSION:
        return ""
    maker = f" (its results are by {said['nanoslip_version']})" if "nanoslip_version" in said else ""
    age, way = ("a newer", "read it with that one") if form > VERSION else ("an older", "nanoslip run writes it anew")
    return f"has format {form}, of {age} nanoslip{maker}; this one reads format {VERSION}: {way}"


def check_seal(path: Path) -> None:
    """Raises StoreError if a byte of the file has changed since it was collected, OSError."""
    # A file without a seal has nothing to break.
    written = read_seal(path)
    if written is not None and written != _digest(path, path.stat().st_size - _LENGTH):
        said = "its bytes are not those that were collected: damaged? nanoslip collect writes it anew"
        raise StoreError(f"{path}: {said}")


@contextmanager
def reading(path: Path) -> Iterator[xr.Dataset]:
    """Open a dataset in a `with`; values found lost or damaged inside raise StoreError, too."""
    with open_dataset(path) as dataset:
        try:
            yield dataset
        except _REFUSALS as error:
            if getattr(error, "errno", None) in (errno.EPIPE, errno.ENOSPC):
                # An error of the medium, not of a value.
                raise
            raise StoreError(f"{path}: cannot be read: {error}: damaged? nanoslip collect writes it anew") from error


def _reason(error: Exception) -> object:
    return getattr(error, "strerror", None) or error


# A dataset's file that is up to date with the results on disk is not collected again.

NOTE: Final = "dataset.json"
"""File among the results that records the inputs of the dataset beside them."""


def dataset_hash(manifest: Manifest, store: Store) -> str:
    """A hash of all that decides a dataset: the campaign, its results and failures, and the code that collects them."""
    identities = [number.identity for number in manifest.observables]
    texts = (manifest.text, *manifest.files.items(), *identities)
    inputs = content_hash(all_sources_hash(), manifest.path.name, *texts)
    digest = hashlib.sha256(inputs.encode())
    for key, checksum in store.seals():
        digest.update(f"{key} {checksum}\n".encode())
    # Sorted, as the order in which tasks failed is chance.
    for key, attempt in sorted(store.failures().items()):
        digest.update(f"{key} {attempt.outcome}\n".encode())
    return digest.hexdigest()


def is_current_dataset(path: Path, store: Store, expected: str) -> bool:
    """True if the file is the last one written, from exactly these results, whether somebody has edited it since or not.

    Its bytes are checked when it is opened.
    """
    try:
        said = json.loads(files.read_bytes(store.folder / NOTE))
        if said == _file_state(path, expected):
            return True
        # An edit has replaced the seal: the results that the file was made of have to be enough.
        return bool(said["made_of"] == expected and is_edited(path))
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        return False


def write_state(path: Path, store: Store, made: str) -> None:
    """Record the results that the file was made of; without the record it is collected again next time."""
    with suppress(OSError):
        state = json.dumps(_file_state(path, made))
        files.write_whole(store.folder / NOTE, [state.encode()])


def _file_state(path: Path, made: str) -> dict[str, object]:
    return {"made_of": made, "seal": read_seal(path), "bytes": path.stat().st_size}
