"""What converting polar returns to positions costs at long range: bias and NEES of each conversion beside its formula.

At 100 km, a bearing error of 1.5 deg bends the cloud of positions so far that its mean lies short of the target by
r (1 - exp(-s/2)), s the bearing's variance. That is judged in the two ways that a conversion can be meant: given where the
target is (as a filter meets it), and given the return. NEES is 1 where the stated covariance is that of the error.

    python examples/long_range.py
"""

import numpy as np

import vedette
from vedette_standard import (
    DebiasedConversion,
    ModifiedUnbiasedConversion,
    NaiveConversion,
    RangeBearing,
    UnbiasedConversion,
)

R, SIGMA_RANGE, SIGMA_BEARING, DRAWS = 100e3, 50.0, np.deg2rad(1.5), 400_000
S = SIGMA_BEARING**2
FACTORS = {
    NaiveConversion: 1.0,
    DebiasedConversion: 1 - np.exp(-S) + np.exp(-S / 2),
    UnbiasedConversion: np.exp(S / 2),
    ModifiedUnbiasedConversion: np.exp(-S / 2),
}
"""What each conversion multiplies the naive position with, whose mean is exp(-S/2) of the true one."""


def figures(kind: type[vedette.Preprocessor], z: np.ndarray, truth: np.ndarray) -> tuple[float, float, float]:
    """Mean error along the line of sight in m, its standard error, and NEES over the number of axes."""
    radar = RangeBearing(SIGMA_RANGE, SIGMA_BEARING)
    seen = kind({"raw": radar}).process({"raw": vedette.Scan(0.0, "raw", vedette.Detections.of(z))})
    error = seen.z - truth
    nees = np.mean(np.sum(error * np.linalg.solve(seen.noise, error[..., None])[..., 0], axis=-1)) / 2
    return error[:, 0].mean(), error[:, 0].std() / np.sqrt(DRAWS), nees


def study(seed: int = 1) -> list[tuple[str, float, float, float, float, float]]:
    """Per conversion: bias given the target, its formula and standard error, NEES given the target and given the return."""
    errors = np.random.default_rng(seed).standard_normal((DRAWS, 2)) * [SIGMA_RANGE, SIGMA_BEARING]
    there = np.array([R, 0.0])
    true = there - errors
    places = true[:, :1] * np.stack([np.cos(true[:, 1]), np.sin(true[:, 1])], axis=-1)
    rows = []
    for kind, factor in FACTORS.items():
        bias, doubt, nees = figures(kind, there + errors, there)
        given_return = figures(kind, np.broadcast_to(there, (DRAWS, 2)), places)[2]
        rows.append((kind.kind, bias, R * (factor * np.exp(-S / 2) - 1), doubt, nees, given_return))
    return rows


if __name__ == "__main__":
    print(f"{'':30}{'bias m':>10}{'formula':>10}{'+-':>7}{'NEES given target':>20}{'given return':>14}")
    for kind, bias, formula, doubt, nees, other in study():
        print(f"{kind:30}{bias:10.2f}{formula:10.2f}{doubt:7.2f}{nees:20.3f}{other:14.3f}")
