"""OpenCV, if it is installed."""

from __future__ import annotations

from typing import Any

from vedette_files.libraries import needed


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    return needed("cv2", "radar pictures need OpenCV", "marine")
