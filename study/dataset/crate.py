"""A campaign's dataset as an RO-Crate (`nanoslip export --crate`): dataset, manifest with the files that it names, and page.

The metadata (https://w3id.org/ro/crate) say who made it (the manifest's [about]), under which licence, and with which software.
"""

from collections.abc import Iterator
from pathlib import Path, PurePath
from shutil import copyfile
from tempfile import TemporaryDirectory
from typing import Any, Final

import xarray as xr

from nanoslip.study.dataset import file
from nanoslip.study.manifest.manifest import About
from nanoslip.study.manifest.parameters import BETWEEN
from nanoslip.study.manifest.reader import files_named_in
from nanoslip.study.results.files import written_whole
from nanoslip.study.results.store import StoreError, failing, write_files
from nanoslip.study.toml_text import from_toml

MANIFEST: Final = "campaign.toml"
PAGE: Final = "report.html"
METADATA: Final = "ro-crate-metadata.json"
"""What makes a folder a crate."""
_FORMATS: Final = {".nc": "application/x-netcdf", ".toml": "application/toml", ".html": "text/html", ".csv": "text/csv"}


def write(dataset: xr.Dataset, page: str, out: Path) -> None:
    """Write the crate to a folder, or to a file .zip. page: the dataset's, as HTML. Raises StoreError."""
    if "manifest" not in dataset.attrs:
        raise StoreError("a dataset that was joined has no manifest: needs that of one campaign")
    document = from_toml(dataset.attrs["manifest"])
    about = About(**document.get("about", {}))
    if not about.licence:
        raise StoreError('about.licence: missing in the manifest: needs one for an RO-Crate, as licence = "CC-BY-4.0"')
    if out.is_dir() and any(out.iterdir()) and not (out / METADATA).is_file():  # may be results of another campaign
        raise StoreError(f"{out}: has files that are of no crate: needs a new folder, an empty one, or that of a crate")
    with TemporaryDirectory() as scratch:
        contents = {file.FILE: "dataset: the numbers of all cases", MANIFEST: "campaign that the dataset is of"}
        _write_dataset(dataset, Path(scratch) / file.FILE)
        for name, text in {MANIFEST: dataset.attrs["manifest"], **dict(_named(dataset, document))}.items():
            contents.setdefault(name, "file that the campaign names")
            write_files({Path(scratch) / name: text.encode()})
        write_files({Path(scratch) / PAGE: page.encode()})
        contents[PAGE] = "page of tables and figures"
        crate = _described(dataset, about, Path(scratch), contents)
        with failing(f"{out}: cannot be written"):
            if out.suffix == ".zip":
                with written_whole(out) as whole:
                    crate.write_zip(whole)
            else:
                crate.write(Path(scratch) / "crate")
                _move(Path(scratch) / "crate", out)


def _move(crate: Path, out: Path) -> None:
    """Put each file of a crate where it belongs. Raises StoreError where a link leads out of the folder, OSError."""
    for source in sorted(path for path in crate.rglob("*") if path.is_file()):
        path = out / source.relative_to(crate)
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.parent.resolve().is_relative_to(out.resolve()):
            raise StoreError(f"{path}: not written: a link leads out of {out}")
        with written_whole(path) as whole:
            copyfile(source, whole)


def _write_dataset(dataset: xr.Dataset, path: Path) -> None:
    """Byte for byte where it is of a file."""
    source = Path(str(dataset.encoding.get("source", "")))
    if source.is_file():
        copyfile(source, path)
    else:
        file.write(dataset, path)


def _named(dataset: xr.Dataset, document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Names and texts of the files that a campaign names, of those below its folder; the dataset holds all."""
    for key, names in files_named_in(document).items():
        texts = str(dataset.attrs.get(f"manifest_{key}", "")).split(BETWEEN)
        for path, text in zip(map(PurePath, names), texts, strict=False):
            if f"manifest_{key}" in dataset.attrs and not path.is_absolute() and ".." not in path.parts:
                yield path.as_posix(), text


def _described(dataset: xr.Dataset, about: About, folder: Path, contents: dict[str, str]) -> Any:
    """The crate of these files, each with what it is."""
    try:
        from rocrate.model import ContextEntity, Person  # noqa: PLC0415  who publishes needs it, who computes does not
        from rocrate.rocrate import ROCrate  # noqa: PLC0415
    except ImportError:
        raise StoreError('an RO-Crate needs the package rocrate: pip install "nanoslip[crate]"') from None
    crate = ROCrate()
    root, facts = crate.root_dataset, dataset.attrs
    crate.name = facts["title"]
    crate.description = (
        "Campaign of the friction laboratory nanoslip: its dataset, the files that decide it, and its page"
    )
    crate.license = crate.add(ContextEntity(crate, about.licence_url, {"@type": "CreativeWork", "name": about.licence}))
    ids = about.orcid_urls or tuple(f"#author-{number}" for number in range(1, len(about.author) + 1))
    people = [crate.add(Person(crate, each, {"name": name})) for each, name in zip(ids, about.author, strict=False)]
    if people:
        root["author"] = people
    if about.doi:
        root["identifier"] = f"https://doi.org/{about.doi}"
    files = {}
    for name, what in contents.items():
        path = folder / name
        size = {"name": what, "contentSize": str(path.stat().st_size)}
        files[name] = crate.add_file(
            path, name, properties={**size, "encodingFormat": _FORMATS.get(path.suffix, "text/plain")}
        )
    words = {"@type": "SoftwareApplication", "name": "nanoslip", "softwareVersion": str(facts["nanoslip_version"])}
    software = crate.add(ContextEntity(crate, "#nanoslip", {**words, "version": str(facts["source_commit"])}))
    results = [files.pop(file.FILE), files.pop(PAGE)]
    action = {"@type": "CreateAction", "name": f"nanoslip run {MANIFEST}"}
    run = crate.add(ContextEntity(crate, "#run", action))
    run["instrument"], run["object"], run["result"] = software, list(files.values()), results
    root["mentions"] = run
    crate.mainEntity = results[0]
    return crate
