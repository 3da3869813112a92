"""Where the repository's examples and pages are, and recordings that are not part of it."""

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
DOCS = ROOT / "docs"


def recording(*names):
    """Return the path of a recording in the folder that VEDETTE_DATA names; the test is skipped where it is not there."""
    path = Path(os.environ.get("VEDETTE_DATA", "")).joinpath(*names)
    if "VEDETTE_DATA" not in os.environ or not path.exists():
        pytest.skip(f"the recording {'/'.join(names)!r} is not in the folder that VEDETTE_DATA names")
    return path
