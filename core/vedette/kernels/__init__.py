"""The inner loops of every Gaussian filter, behind one set of signatures: batch axes first, double precision, pure.

They trust their input. Covariances stay symmetric positive semi-definite by construction, not by repair. The kernels
of every scan have a compiled twin, which is called if it was built; `RUNNING` says which runs and why.
"""

from vedette.kernels import assignment as _assignment
from vedette.kernels import association as _association
from vedette.kernels import boxes as _boxes
from vedette.kernels import hypotheses as _hypotheses
from vedette.kernels import joint as _joint
from vedette.kernels import modes as _modes
from vedette.kernels import reference as _reference
from vedette.kernels import streams as _streams
from vedette.kernels.backward import smooth_step, solve_by_root
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.hypotheses import best_marginals
from vedette.kernels.modes import stacked
from vedette.kernels.reference import evaluate, log_sum, mixture, moments, root, safe_log, symmetric
from vedette.kernels.selection import Selection as _Selection

_fastest = _Selection.now()
RUNNING = _fastest.why

evaluate_points = _fastest(_reference.evaluate_points)
evaluate_returns = _fastest(_reference.evaluate_returns)
filter_step = _fastest(_reference.filter_step)
imm_combine = _fastest(_modes.imm_combine)
imm_mix = _fastest(_modes.imm_mix)
pda_update = _fastest(_reference.pda_update)
predict = _fastest(_reference.predict)
propagate = _fastest(_reference.propagate)
sigma_points = _fastest(_reference.sigma_points)
update = _fastest(_reference.update)
weighted_update = _fastest(_reference.weighted_update)
whiten = _fastest(_reference.whiten)

mix_modes = _fastest(_modes.mix_modes)
mixture_moments = _fastest(_modes.mixture_moments)
split_weights = _fastest(_modes.split_weights)
weigh_modes = _fastest(_modes.weigh_modes)

existence = _fastest(_association.existence)
gate_scores = _fastest(_association.gate_scores)
given_existence = _fastest(_association.given_existence)
is_plain = _fastest(_association.is_plain)
one_hot = _fastest(_association.one_hot)
sample_density = _fastest(_association.sample_density)
softmax = _fastest(_association.softmax)

best_joint = _fastest(_hypotheses.best_joint)
k_best = _fastest(_assignment.k_best)
joint_weights = _fastest(_joint.joint_weights)
linked_clusters = _fastest(_boxes.linked_clusters)
pairs_in_boxes = _fastest(_boxes.pairs_in_boxes)
wide_clusters = _fastest(_joint.wide_clusters)

normals = _fastest(_streams.normals)
uniforms = _fastest(_streams.uniforms)
