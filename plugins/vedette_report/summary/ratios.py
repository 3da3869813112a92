"""What a summary says of covariances: ratios of errors and innovations, each in words."""

from __future__ import annotations

from vedette import Experiment, ImagingSensor
from vedette.metrics import Score, chi_square_band
from vedette_report.columns import aligned, percent, rows
from vedette_report.figures import length_unit
from vedette_report.series.traces import BAND, Bands, Inside, mode_names

FACTOR = 2.0
"""A mean NEES of one run that is off by less than this factor is no evidence against the covariance: see docs/metrics.md."""

CUT = 0.5
"""Errors are judged within the pairing radius. If a filter expects more than this part of it, a right one's NEES falls short
by 8 % and more in the plane: there is no verdict. Errors of less than half this part are cut by no radius: of a filter
that expects larger ones they show that it is wrong.
"""

RATIO = "Are the covariances right? Squared errors (NEES) and innovations (NIS) over what the filter states: 1 is right"

_EXACT = 0.01
"""A ratio below this is of errors a tenth of those stated: data drawn without noise, of which no filter can be right."""

_NOTHING = "nothing to judge by: no confirmed track"


def ratios(experiment: Experiment, score: Score, bands: Bands, *, brief: bool) -> list[str]:
    """Return the table of ratios, what each says below it, and the modes."""
    table = [("", "ratio", f"single values in their {percent(1 - BAND)} band")]
    told: list[tuple[str, str]] = []
    if score.nees_position is not None:
        table.append(("NEES of the position", f"{score.nees_position:.3g}", _inside(bands.nees)))
        told.append(("NEES", _nees_of(experiment, score, score.nees_position)))
    if score.nees_state is not None and not brief:
        table.append((f"NEES of {', '.join(score.nees_state_axes or ())}", f"{score.nees_state:.3g}", ""))
    if score.nis is not None and bands.nis.count:
        axes = float(sum(axes * count for axes, count in bands.nis.axes.items()))
        table.append(("NIS", f"{score.nis:.3g}", _inside(bands.nis)))
        told.append(("NIS", _nis_in_words(score.nis, axes, experiment)))
    if score.nees_position is None and score.nis is None:
        return rows([("", f"{_NOTHING} took a return" if score.tracks else _NOTHING)])
    if score.mode_prob is not None and not brief:
        names = mode_names(experiment, len(score.mode_prob))
        shares = (f"{name} {share:.2f}" for name, share in zip(names, score.mode_prob, strict=True))
        told.append(("modes", ", ".join(shares)))
    return [*(f"  {line}" for line in aligned(table)), *rows(told)]


def _nees_of(experiment: Experiment, score: Score, ratio: float) -> str:
    expected, radius, unit = score.position_deviation_m or 0.0, experiment.judge.cover_radius, length_unit(experiment)
    reaching = expected > CUT * radius and (score.position_rmse_m or 0.0) > CUT / 2 * radius
    if reaching and ratio <= FACTOR:
        cut = f"not judged: the pairing radius of {radius:g} {unit} cuts the errors, which the filter expects to be"
        return f"{cut} {expected:.3g} {unit}; set judge.cover_radius to {float(f'{3 * expected:.2g}'):g} or more"
    return _nees_in_words(ratio)


def _inside(seen: Inside) -> str:
    if seen.part is None:
        return "none at a single scan"
    return f"{percent(seen.part)} of {seen.count:,}"


def _nees_in_words(ratio: float) -> str:
    """Judge one run's NEES, whose values are dependent, so that only a gross ratio means something."""
    if ratio < _EXACT:
        return "not judged: next to no error, as of a truth that the returns were made from without noise"
    if ratio > FACTOR:
        return f"the covariance is {ratio:.2g} times too small for the errors: the filter is overconfident"
    if ratio < 1 / FACTOR:
        return f"the covariance is {1 / ratio:.2g} times too large for the errors: the filter is underconfident"
    return f"the covariance fits the errors to within a factor of {FACTOR:g}, which is all that one run can tell"


def _nis_in_words(ratio: float, axes: float, experiment: Experiment) -> str:
    """Judge the NIS by the band of a correct linear filter whose returns are known to be its own."""
    if all(isinstance(sensor, ImagingSensor) or sensor.claims for sensor in experiment.tracker.sensors.values()):
        return "not judged: a frame has no innovation of its own; how well it fits is in the likelihood of its pixels"
    if ratio < _EXACT:
        return "not judged: the returns have next to no noise"
    low, high = chi_square_band(axes, BAND)
    if experiment.tracker.estimator.traits.conservative and ratio < low:
        return "less than 1, as is meant: this estimator's covariance is larger than that of its errors on purpose"
    words = f"its {percent(1 - BAND)} band is {low:.3g} to {high:.3g} where returns are known to be the target's"
    if low <= ratio <= high:
        return f"{words}: the innovations fit the models"
    factor, way = (ratio, "larger") if ratio > high else (1 / ratio, "smaller")
    size = f"{factor:.2g} times" if factor > 1.5 else f"{100 * abs(ratio - 1):.2g} %"
    return f"{words}: the squared innovations are {size} {way} than the models predict"
