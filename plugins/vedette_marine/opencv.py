"""OpenCV, if it is installed."""

from __future__ import annotations

from typing import Any

from vedette import InputError


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    try:
        import cv2
    except ImportError:
        raise InputError("radar pictures need OpenCV: pip install 'vedette[marine]'") from None
    return cv2
