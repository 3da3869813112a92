"""The inner loops of every Gaussian filter, behind one set of signatures: batch axes first, double precision, pure.

They trust their input. Covariances stay symmetric positive semi-definite by construction, not by repair. The kernels
of every scan have a compiled twin, which is called if it was built; `RUNNING` says which runs and why.
"""

from vedette.kernels import assignment as _assignment
from vedette.kernels import association as _association
from vedette.kernels import backward as _backward
from vedette.kernels import boxes as _boxes
from vedette.kernels import clusters as _clusters
from vedette.kernels import joint as _joint
from vedette.kernels import modes as _modes
from vedette.kernels import reference as _reference
from vedette.kernels import results as _results
from vedette.kernels import square_root as _square_root
from vedette.kernels import twins as _twins
from vedette.kernels.association import gate_threshold
from vedette.kernels.backward import smooth_step, solve_by_root
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.modes import stacked
from vedette.kernels.ragged import counted, places
from vedette.kernels.reference import (
    evaluate,
    gains,
    gains_of_points,
    log_sum,
    mixture,
    moments,
    normal_or_zero,
    safe_log,
    symmetric,
)
from vedette.kernels.selection import Selection as _Selection
from vedette.kernels.square_root import bounded_root
from vedette.kernels.twins import Twin
from vedette.types import Gaussian, Hypotheses, Innovation

_fastest = _Selection.now()
RUNNING = _fastest.why
BUILD = _fastest.build

evaluate_particles = _fastest(_twins.evaluate_particles, _results.Weighted)
evaluate_points = _fastest(_reference.evaluate_points, _results.Evaluated)
evaluate_returns = _fastest(_reference.evaluate_returns, Innovation, Hypotheses)
filter_step = _fastest(_reference.filter_step, _results.Updated)
imm_combine = _fastest(_modes.imm_combine, _results.Combined)
imm_mix = _fastest(_modes.imm_mix, _results.MixedMoments)
over_axes = _fastest(_reference.over_axes)
pda_update = _fastest(_reference.pda_update, _results.Updated)
predict = _fastest(_reference.predict, Gaussian)
propagate = _fastest(_reference.propagate)
reweigh_particles = _fastest(_reference.reweigh_particles)
root = _fastest(_reference.root)
smooth_linear = _fastest(_backward.smooth_linear, Gaussian)
scan_step = _fastest(_association.scan_step, _results.Passed, Gaussian)
sigma_points = _fastest(_reference.sigma_points, _results.Points)
update = _fastest(_reference.update, _results.Updated)
weighted_update = _fastest(_reference.weighted_update, Gaussian)
whiten = _fastest(_reference.whiten)

cancels = _fastest(_twins.cancels)
evaluate_points_twin = _fastest(_twins.evaluate_points_twin, Innovation, Hypotheses)
evaluate_root_twin = _fastest(_twins.evaluate_root_twin, Innovation, Hypotheses)
evaluate_twin = _fastest(_twins.evaluate_twin, Innovation, Hypotheses)
iterate_twin = _fastest(_twins.iterate_twin, Innovation, Hypotheses)
measure_twin = _fastest(_twins.measure_twin, _results.Measured)
move_twin = _fastest(_twins.move_twin, _results.Moved)
predict_points_twin = _fastest(_twins.predict_points_twin, Gaussian)
predict_root_twin = _fastest(_twins.predict_root_twin)
predict_twin = _fastest(_twins.predict_twin, Gaussian)
scan_step_twin = _fastest(_twins.scan_step_twin, _results.Passed, Gaussian)
lower_triangular = _fastest(_square_root.lower_triangular)

mix_modes = _fastest(_modes.mix_modes, _results.Mixed, Gaussian)
mixture_moments = _fastest(_modes.mixture_moments, Gaussian)
split_weights = _fastest(_modes.split_weights, _results.Split)
weigh_modes = _fastest(_modes.weigh_modes, _results.Weighed)

claimed = _fastest(_association.claimed)
existence = _fastest(_association.existence, _results.Seen)
gate_scores = _fastest(_association.gate_scores)
given_existence = _fastest(_association.given_existence)
if_existing = _fastest(_association.if_existing)
is_plain = _fastest(_association.is_plain)
one_hot = _fastest(_association.one_hot)
sample_density = _fastest(_association.sample_density)
softmax = _fastest(_association.softmax)

best_joint = _fastest(_assignment.best_joint, _results.JointBest)
grow = _fastest(_clusters.grow, _results.Grown)
shed = _fastest(_clusters.shed, _results.Shed)
target_existence = _fastest(_clusters.target_existence)
k_best = _fastest(_assignment.k_best, _results.Assignments)
joint_weights = _fastest(_joint.joint_weights, _results.JointWeights)
linked_clusters = _fastest(_boxes.linked_clusters)
pairs_in_boxes = _fastest(_boxes.pairs_in_boxes, _results.BoxPairs)
wide_clusters = _fastest(_joint.wide_clusters)

normals = _fastest(_reference.normals)
uniforms = _fastest(_reference.uniforms)
