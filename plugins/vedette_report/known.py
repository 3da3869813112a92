"""What returns tell, without what stands where they lack a component."""

from __future__ import annotations

import numpy as np

from vedette import Array, Detections


def known(seen: Detections) -> Array:
    """Return what was measured (k, m), NaN where a return lacks the component."""
    return seen.z if seen.missing is None else np.where(seen.missing, np.nan, seen.z)
