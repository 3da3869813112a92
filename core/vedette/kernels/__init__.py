"""The inner loops of every Gaussian filter, behind one set of signatures: batch-leading, double precision, pure.

They trust their input. Covariances stay symmetric positive semi-definite by construction, not by repair.
"""

from vedette.kernels.association import existence, gate_scores, is_plain, one_hot, sample_density, softmax
from vedette.kernels.backward import retrace, unroot
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.modes import interact, split_weights, stacked, together, weigh_modes
from vedette.kernels.reference import (
    absorb,
    imm_mix,
    innovate,
    innovate_points,
    innovate_returns,
    log_sum,
    mixture,
    moments,
    predict,
    propagate,
    root,
    safe_log,
    sigma_points,
    symmetric,
)

__all__ = [
    "absorb",
    "existence",
    "gate_scores",
    "imm_mix",
    "innovate",
    "innovate_points",
    "innovate_returns",
    "interact",
    "is_plain",
    "log_sum",
    "mixture",
    "moments",
    "numerical_jacobian",
    "one_hot",
    "predict",
    "propagate",
    "retrace",
    "root",
    "safe_log",
    "sample_density",
    "sigma_points",
    "softmax",
    "split_weights",
    "stacked",
    "symmetric",
    "together",
    "unroot",
    "weigh_modes",
]
