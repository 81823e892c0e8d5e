"""Tables that commands write into a page by hand: each stands between two marks, and what is around them stays."""

from pathlib import Path


def put(page: Path, name: str, lines: list[str]) -> None:
    """Write these lines between the marks of that name. Raises ValueError where the page has none."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->\n"
    before, found, rest = page.read_text("utf-8").partition(begin)
    _, also, after = rest.partition(end)
    if not (found and also):
        raise ValueError(f"{page}: no marks for a table, {begin!r} and {end!r}")
    page.write_text("".join((before, begin, *(f"{line}\n" for line in lines), end, after)), "utf-8")
