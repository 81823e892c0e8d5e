"""All sorts of views: importing this file registers them, in the order of a page."""

from nanoslip.study.figures.views import answer, contacts, drives, sizes, interiors, records  # noqa: I001  the order of a page
from nanoslip.study.figures.views.view import SORTS

__all__ = ["SORTS", "answer", "contacts", "drives", "interiors", "records", "sizes"]
