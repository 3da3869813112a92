"""Building blocks for the author of an estimator.

An estimator derives from `vedette.Estimator`, or from one of the bases here that leave less to define:

- `OverMotion`: one motion model, whose axes and frame are the estimator's.
- `GaussianFilter`: the belief is a mean and a covariance; `predict` and `evaluate` are left to define.
- `PointFilter`: a Gaussian filter by sigma points, of which only `kappa` is left to define.

Predicting: `predict_linearised` by the motion's derivative; `predicted` for loops outside the tracker, which also calls
`reframe` where that is due. Evaluating: `evaluate_linearised` and `evaluate_frame` do all of it; `prepare` gives
residuals and noises that already account for each detection's own noise and missing components, from which
`evaluate_each` and `make_innovation` continue. `Hypotheses` is the detail that `GaussianFilter.update` reads.
`mixed` and `merged` replace mixtures by their moments.
`Memo` keeps the matrices of linear models. Particles: `Particles` and the functions on them.
"""

from vedette.filters.declared import contradiction as contradiction
from vedette.filters.declared import unforwarded as unforwarded
from vedette.filters.detections import Prepared as Prepared
from vedette.filters.detections import make_innovation as make_innovation
from vedette.filters.detections import prepare as prepare
from vedette.filters.detections import present_noise as present_noise
from vedette.filters.frames import evaluate_frame as evaluate_frame
from vedette.filters.gaussian import GaussianFilter as GaussianFilter
from vedette.filters.gaussian import Hypotheses as Hypotheses
from vedette.filters.gaussian import has_gaussian_belief as has_gaussian_belief
from vedette.filters.gaussian import marginal as marginal
from vedette.filters.gaussian import without_variance as without_variance
from vedette.filters.linear import evaluate_each as evaluate_each
from vedette.filters.linear import evaluate_linearised as evaluate_linearised
from vedette.filters.linear import expected_return as expected_return
from vedette.filters.linear import extent_linearised as extent_linearised
from vedette.filters.linear import predict_linearised as predict_linearised
from vedette.filters.memo import Memo as Memo
from vedette.filters.memo import SensorConstants as SensorConstants
from vedette.filters.memo import embedded as embedded
from vedette.filters.memo import keep as keep
from vedette.filters.mixing import merged as merged
from vedette.filters.mixing import mixed as mixed
from vedette.filters.motion import OverMotion as OverMotion
from vedette.filters.motion import predicted as predicted
from vedette.filters.particles import Particles as Particles
from vedette.filters.particles import check_particle_motion as check_particle_motion
from vedette.filters.particles import draw_particles as draw_particles
from vedette.filters.particles import log_association as log_association
from vedette.filters.particles import normalised as normalised
from vedette.filters.particles import particle_innovation as particle_innovation
from vedette.filters.particles import particle_moments as particle_moments
from vedette.filters.particles import point_likelihoods as point_likelihoods
from vedette.filters.particles import points_at as points_at
from vedette.filters.particles import resample as resample
from vedette.filters.particles import too_few as too_few
from vedette.filters.sigma_points import PointFilter as PointFilter
