"""Who made a campaign and how others may use it: the table [about], for attributes of the dataset. It decides no result."""

import re
from dataclasses import dataclass
from typing import Any, Final

from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import require

_ORCID: Final = re.compile(r"(?:https?://orcid\.org/)?([0-9]{4}-[0-9]{4}-[0-9]{4}-[0-9]{3}[0-9X])")
_DOI: Final = re.compile(r"(?:https?://(?:dx\.)?doi\.org/|doi:)?(10\.[0-9]{4,9}(?:\.[0-9]+)*/[!-~]+)")
_LICENCE: Final = re.compile(r"https?://[!-~]+|[A-Za-z0-9]+(?:[-.+][A-Za-z0-9]+)*\+?")


@dataclass(frozen=True, slots=True)
class About:
    """Authors, licence and DOI, for attributes of the dataset.

    author: a name, or a list of names
    orcid: ORCID of each author
    licence: an identifier of SPDX, as CC-BY-4.0, or a URL
    doi: DOI of the dataset, as reserved by an archive
    """

    author: tuple[str, ...] = ()
    orcid: tuple[str, ...] = ()
    licence: str = ""
    doi: str = ""

    def __post_init__(self) -> None:
        self._keep("author", tuple(map(_author, _listed(self.author))))
        self._keep("orcid", tuple(map(_orcid, _listed(self.orcid))))
        fit = not (self.author and self.orcid) or len(self.orcid) == len(self.author)
        require("orcid", list(self.orcid), fit, f"as many as there are authors, {len(self.author)}")
        if self.licence != "":
            needed = "an identifier of SPDX, as CC-BY-4.0, or a URL"
            _match("licence", self.licence, _LICENCE, needed)
        if self.doi != "":
            self._keep("doi", _match("doi", self.doi, _DOI, "a DOI, as 10.5281/zenodo.1234567")[1])

    def _keep(self, name: str, value: object) -> None:
        object.__setattr__(self, name, value)

    @property
    def orcid_urls(self) -> tuple[str, ...]:
        """Of the authors, in their order; none where they have none."""
        return tuple(f"https://orcid.org/{each}" for each in self.orcid)

    @property
    def licence_url(self) -> str:
        """Where the licence can be read; empty where none is given."""
        known = not self.licence or self.licence.startswith("http")
        return self.licence if known else f"https://spdx.org/licenses/{self.licence}"

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of a dataset, in the words of ACDD 1.3 (Attribute Convention for Data Discovery)."""
        found = {
            "creator_name": "; ".join(self.author),
            "creator_url": "; ".join(self.orcid_urls),
            "license": self.licence_url,
            "id": self.doi,
            "naming_authority": "org.doi" if self.doi else "",
        }
        return {name: text for name, text in found.items() if text}


def _listed(given: Any) -> list[Any]:
    """One text, or a list of some."""
    return list(given) if isinstance(given, list | tuple) else [given]


def _author(name: Any) -> str:
    require(
        "author",
        name,
        isinstance(name, str) and name.strip().isprintable() and bool(name.strip()),
        "a name, or a list of names",
    )
    return str(name).strip()


def _orcid(given: Any) -> str:
    """An ORCID, whose last digit is the checksum of the others by ISO 7064, mod 11-2; X stands for 10."""
    needed = "an ORCID, as 0000-0002-1825-0097"
    text = _match("orcid", given, _ORCID, needed)[1]
    total = 0
    for digit in text.replace("-", "")[:-1]:
        total = 2 * (total + int(digit))
    check = "0123456789X"[(12 - total % 11) % 11]
    require("orcid", given, text[-1] == check, f"{needed}: of these digits the last one would be {check}")
    return text


def _match(name: str, given: Any, pattern: re.Pattern[str], needed: str) -> re.Match[str]:
    found = pattern.fullmatch(given) if isinstance(given, str) else None
    if found is None:
        raise InvalidInput(f"{name} = {given!r}: needs {needed}")
    return found
