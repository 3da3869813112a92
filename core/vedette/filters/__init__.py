"""Building blocks for the author of an estimator.

An estimator derives from `vedette.Estimator`, or from one of the bases here that leave less to define:

- `OverMotion`: one motion model, whose axes and frame are the estimator's.
- `GaussianFilter`: the belief is a mean and a covariance; `predict` and `evaluate` are left to define.

Predicting: `predict_linearised` by the motion's derivative; `predicted` for loops outside the tracker, which also calls
`reframe` where that is due. Evaluating: `evaluate_linearised` and `evaluate_frame` do all of it; `prepare` gives
residuals and noises that already account for each detection's own noise and missing components, from which
`evaluate_each` and `make_innovation` continue. `Hypotheses` is the detail that `GaussianFilter.update` reads.
`mixed` and `merged` replace mixtures by their moments. `fading` says how much a filter that forgets widens over a gap.
`Memo` keeps the matrices of linear models. Sigma points and particles are in `vedette_standard.points` and `.particles`.
"""

from vedette.filters.declared import contradiction, unforwarded
from vedette.filters.detections import Prepared, make_innovation, prepare, present_noise
from vedette.filters.frames import evaluate_frame
from vedette.filters.gaussian import GaussianFilter, fading, has_gaussian_belief, marginal, without_variance
from vedette.filters.linear import (
    evaluate_each,
    evaluate_linearised,
    expected_return,
    extent_linearised,
    gate_box,
    noise_over,
    predict_linearised,
    scan_step_linearised,
)
from vedette.filters.memo import Memo, SensorConstants, as_slice, embedded, keep, own_twin
from vedette.filters.mixing import merged, mixed
from vedette.filters.motion import OverMotion, predicted
from vedette.types import Hypotheses
