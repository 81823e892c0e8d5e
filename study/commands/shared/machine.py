"""Output for scripts: one JSON document instead of text. The keys are in study/commands/README.md."""

import json
import math
from typing import Any

import click


def print_json(value: Any) -> None:
    """Print a value as JSON, keys in their order; numbers that are not finite are null."""
    click.echo(json.dumps(_finite(value), ensure_ascii=False, indent=1, allow_nan=False, default=_plain))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else str(value)
