"""Progress of a campaign, from the files of its results and the outline of its plan.

A run writes the outline of a large plan beside the results, so that `nanoslip status` need not plan again.
"""

import zipfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from study.commands.shared.plans import planned, scaled
from study.execution.failures import given_up
from study.execution.journal import measured_in
from study.manifest.manifest import Manifest
from study.manifest.reader import load_manifest
from study.origin import Origins, foreign_among
from study.plan.plan import Plan
from study.plan.standing.outline import Look, Outline, asked, outline_of
from study.results.attempts import Attempt
from study.results.shard import folders
from study.results.store import FOLDER, OUTLINE, Store
from study.results.whole_file import written_whole

LARGE: Final = 5000
"""Tasks from which a run leaves it: fewer are planned in no time."""
Said = TypeVar("Said")
_ASKED: Final = "asked"


@dataclass(frozen=True, slots=True)
class Glance:
    """A campaign and its progress: what is finished, failed and left."""

    campaign: Path
    title: str
    outline: Outline
    stores: tuple[Store, ...]
    """The campaign's own, and those of shards that are not merged."""
    look: Look
    foreign: Mapping[str, Origins]
    """Finished results of other software."""

    def again(self) -> "Glance":
        """How far it is by now; what has not changed is not looked at again."""
        return _glance(self.campaign, self.title, self.outline, self.stores)


def glance(campaign: Path, out: Path) -> Glance:
    """How far a campaign is. Raises ManifestError."""
    manifest, store = load_manifest(campaign), Store(out, whole=False)
    return at_hand(campaign, manifest, store) or _glance(
        campaign, manifest.title, outline_of(planned(campaign)), (store,)
    )


def at_hand(campaign: Path, manifest: Manifest, store: Store) -> Glance | None:
    """The same where a run has left the outline of the plan; None where none has, or that of another plan."""
    found = _outline(store.folder / OUTLINE, asked(manifest))
    return _glance(campaign, manifest.title, found, (store,)) if found else None


def _glance(campaign: Path, title: str, outline: Outline, known: tuple[Store, ...]) -> Glance:
    have = {store.folder.parent: store for store in known}
    out = known[0].folder.parent
    stores = tuple(have.get(each) or Store(each, whole=False) for each in (out, *folders(out)))
    failures: dict[str, Attempt] = {key: attempt for store in stores for key, attempt in store.failures().items()}
    look = outline.look(
        _together([store.outcomes() for store in stores]),
        {key: attempt.outcome for key, attempt in failures.items()},
        given_up(failures),
    )
    look = replace(look, kinds=scaled(look.kinds, measured_in(*(store.folder.parent for store in stores))))
    foreign = foreign_among(_together([store.inventory() for store in stores]))
    mine = foreign.keys() & outline.names if foreign else set()
    return Glance(campaign, title, outline, stores, look, {key: foreign[key] for key in sorted(mine)})


def _together(found: Sequence[dict[str, Said]]) -> dict[str, Said]:
    """What is known of all results, of the campaign itself and of its shards; of a single folder nothing is copied."""
    return found[0] if len(found) == 1 else {key: said for each in found for key, said in each.items()}


def leave(plan: Plan, out: Path) -> None:
    """Leave the outline of a large plan among its results, for whoever looks how far it is."""
    if len(plan.tasks) < LARGE:
        return
    found = outline_of(plan)
    columns: dict[str, Any] = {item.name: getattr(found, item.name) for item in fields(Outline)}
    columns[_ASKED] = np.array(asked(plan.manifest))
    # Without it, looking takes longer: that is all.
    with suppress(OSError), written_whole(out / FOLDER / OUTLINE) as scratch, scratch.open("wb") as file:
        np.savez(file, **columns)


def outlined(out: Path) -> bool:
    """Whether a run has left an outline among these results, of whatever plan."""
    return (out / FOLDER / OUTLINE).is_file()


def _outline(path: Path, expected: str) -> Outline | None:
    """The outline that a run has left there; None where it has not, or another one."""
    # Damaged, it may ask for a password or an unknown compression, which are RuntimeErrors.
    with suppress(OSError, ValueError, KeyError, EOFError, RuntimeError, zipfile.BadZipFile):
        if path.is_file():
            with path.open("rb") as file, np.load(file, allow_pickle=False) as found:
                if str(found[_ASKED]) == expected:
                    return Outline(**{item.name: found[item.name] for item in fields(Outline)})
    return None
