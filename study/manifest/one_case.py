"""The campaign of a single case, from its parameters in the words of a manifest."""

from collections.abc import Mapping
from typing import Any, Final

from solver.drive import Scales
from study.manifest.columns import number_or_text
from study.manifest.drives import drive_parameters
from study.manifest.manifest import STAGES, EnsembleTable, Outputs, TargetTable, field_names
from study.manifest.parameters import TABLES, Value, words, words_of
from study.manifest.problems import ManifestError, key_shown, shown, unknown
from study.manifest.reader import KEYS_OF_FILES

NAME: Final = "try"
"""Of the campaign's drive."""
_DRIVES: Final = "drives"


def tables() -> dict[str, tuple[str, ...]]:
    """Table of a manifest -> the keys of it that a single case can be given."""
    return {
        **{table: words_of(table) for table in TABLES},
        "scales": field_names(Scales),
        "ensemble": field_names(EnsembleTable),
        "target": field_names(TargetTable),
        "outputs": field_names(Outputs),
        _DRIVES: tuple(name for name in drive_parameters() if name not in words()),
    }


def campaign_of(given: Mapping[str, str], contact: bool = False, drive: bool = False) -> dict[str, Any]:
    """The content of a campaign file with one case and at most one drive. Values are checked where it is read.

    given: key -> value as text. contact: stop after initial contact. drive: pull the pin by the default drive; any key of a
    drive asks for one too. Raises ManifestError with every key that is unknown, or of a drive where the contact is all.
    """
    places = {key: table for table, keys in tables().items() for key in keys}
    advice = {key: _advice(key, places, contact) for key in given}
    if any(advice.values()):
        raise ManifestError(
            f"{key_shown(key)} = {shown(number_or_text(given[key]))}: {wrong}" for key, wrong in advice.items() if wrong
        )
    content: dict[str, dict[str, Value]] = {_DRIVES: {"name": NAME}} if drive else {}
    for key, text in given.items():
        content.setdefault(places[key], {})[key] = number_or_text(text)
    driven = {"name": NAME, **content.pop(_DRIVES)} if _DRIVES in content else None
    stages = STAGES[: 1 if contact else 3 if driven else 2]
    drives = {_DRIVES: [driven]} if driven else {}
    return {"title": "One case", "stages": list(stages), **content, **drives}


def _advice(key: str, places: Mapping[str, str], contact: bool) -> str:
    """What is wrong with a key; empty where nothing is."""
    if key not in places:
        return "a key of campaign files, not of one case" if key in KEYS_OF_FILES else unknown(key, places)
    return "needs a drive, which initial contact alone has not" if contact and places[key] == _DRIVES else ""
