"""Problems of a campaign, as tests look at them."""

from nanoslip.study.manifest.problems import ManifestError


def lines_of(error: ManifestError) -> tuple[str, ...]:
    """All problems of an error, a line each."""
    return tuple(map(str, error.problems))
