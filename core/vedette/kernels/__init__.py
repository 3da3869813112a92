"""The inner loops of every Gaussian filter, behind one set of signatures: batch-leading, double precision, pure.

They trust their input. Covariances stay symmetric positive semi-definite by construction, not by repair. The kernels that
every scan goes through have a compiled twin, which takes the calls where it was built; `RUNNING` says what runs and why.
"""

from vedette.kernels import association, modes, reference, streams
from vedette.kernels.backward import smooth_step, unroot
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.modes import stacked
from vedette.kernels.reference import (
    evaluate,
    log_sum,
    mixture,
    moments,
    root,
    safe_log,
    symmetric,
)
from vedette.kernels.selection import Selection

_fastest = Selection.now()
RUNNING = _fastest.why

weighted_update = _fastest(reference.weighted_update)
filter_step = _fastest(reference.filter_step)
evaluate_points = _fastest(reference.evaluate_points)
evaluate_returns = _fastest(reference.evaluate_returns)
pda_update = _fastest(reference.pda_update)
predict = _fastest(reference.predict)
propagate = _fastest(reference.propagate)
sigma_points = _fastest(reference.sigma_points)
update = _fastest(reference.update)
whiten = _fastest(reference.whiten)

imm_combine = _fastest(reference.imm_combine)
imm_mix = _fastest(reference.imm_mix)
interact = _fastest(modes.interact)
split_weights = _fastest(modes.split_weights)
together = _fastest(modes.together)
weigh_modes = _fastest(modes.weigh_modes)

existence = _fastest(association.existence)
gate_scores = _fastest(association.gate_scores)
given_existence = _fastest(association.given_existence)
is_plain = _fastest(association.is_plain)
one_hot = _fastest(association.one_hot)
sample_density = _fastest(association.sample_density)
softmax = _fastest(association.softmax)

normals = _fastest(streams.normals)
uniforms = _fastest(streams.uniforms)

__all__ = [
    "RUNNING",
    "evaluate",
    "evaluate_points",
    "evaluate_returns",
    "existence",
    "filter_step",
    "gate_scores",
    "given_existence",
    "imm_combine",
    "imm_mix",
    "interact",
    "is_plain",
    "log_sum",
    "mixture",
    "moments",
    "normals",
    "numerical_jacobian",
    "one_hot",
    "pda_update",
    "predict",
    "propagate",
    "root",
    "safe_log",
    "sample_density",
    "sigma_points",
    "smooth_step",
    "softmax",
    "split_weights",
    "stacked",
    "symmetric",
    "together",
    "uniforms",
    "unroot",
    "update",
    "weigh_modes",
    "weighted_update",
    "whiten",
]
