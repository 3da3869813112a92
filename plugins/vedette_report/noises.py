"""What the size of innovations and their correlation say of process and measurement noise, in words."""

from __future__ import annotations

import math

from vedette.metrics import chi_square_band

SURE = 4.0
"""A variance is told as wrong that is off by so many of its deviations: by hand."""
NONE = 1e-9
"""A variance that is so small a share of what is stated is none."""


def at_fault(size: float, whiteness: float, dof: float, pairs: float) -> str:
    """Return which of Q and R is likely wrong, or "" if neither stands out.

    `size`: squared innovations over what is expected, of `dof` numbers; `whiteness`: how each correlates with the next, of
    `pairs` products. Beyond chance in a thousand, and by a tenth at least. Innovations that go on in the next follow too
    slowly, those that are taken back too fast; their size tells Q's fault from R's, and where it is right both are named.
    White ones of a wrong size follow rightly, so Q and R are wrong alike.
    Mehra, On the Identification of Variances and Adaptive Kalman Filtering, IEEE Trans. Automatic Control 15, 1970.
    """
    if dof <= 0 or pairs <= 0:
        return ""
    low, high = chi_square_band(dof, 1e-3)
    reach = 3.3 / math.sqrt(pairs)
    large, small = size > max(high, 1.1), size < min(low, 0.9)
    lags, leaps = whiteness > max(reach, 0.1), whiteness < -max(reach, 0.1)
    if lags or leaps:
        slow = "successive innovations are correlated" if lags else "successive innovations are anticorrelated"
        if large or small:
            which = (
                ("Q is too small" if large else "R is too large")
                if lags
                else "R is too small"
                if large
                else "Q is too large"
            )
        else:
            which = "Q is too small, or R too large" if lags else "Q is too large, or R too small"
        return f"{slow}: likely {which}"
    if large or small:
        factor = size if large else 1.0 / max(size, 1e-300)
        said, way = ("large", "small") if large else ("small", "large")
        return f"innovations are white but too {said}: likely R, or R and Q alike, {factor:.2g} times too {way}"
    return ""


def sized(name: str, share: float, error: float, least: float) -> str:
    """Say how what is stated is off whose variance is `share` times as large, "" if not beyond chance and by `least`."""
    share = max(share, NONE)
    if abs(share - 1.0) <= max(SURE * error / share, least):
        return ""
    factor, off, way = (share, error, "small") if share > 1 else (1.0 / share, error / share**2, "large")
    also = " (process noise, sigma squared)" if name.startswith("Q") else ""
    size = "far" if off > factor / 3 or share == NONE else f"{float(f'{factor:.2g}'):g} +- {float(f'{off:.1g}'):g} times"
    return f"{name} is {size} too {way}{also}"
