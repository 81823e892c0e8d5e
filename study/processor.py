"""Description of the processor by Linux, without loading anything; empty elsewhere."""

from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

DESCRIPTION = Path("/proc/cpuinfo")


@lru_cache(maxsize=1)
def description() -> Mapping[str, str]:
    """Property of the first processor, in lower case -> its value."""
    properties: dict[str, str] = {}
    with suppress(OSError), DESCRIPTION.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            # What follows describes the other processors.
            if not line.strip():
                break
            name, _, value = line.partition(":")
            properties[name.strip().lower()] = value.strip()
    return MappingProxyType(properties)


def model() -> str:
    """Model of the processor; empty if unknown."""
    return description().get("model name", "")


def instructions() -> tuple[str, ...]:
    """Names of its instructions, as Linux gives them for x86 (`flags`) and ARM (`features`)."""
    properties = description()
    return tuple(properties.get("flags", properties.get("features", "")).split())
