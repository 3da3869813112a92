"""The inner loops of every Gaussian filter, behind one set of signatures: batch-leading, double precision, pure.

They trust their input. Covariances stay symmetric positive semi-definite by construction, not by repair.
"""

from vedette.kernels.backward import retrace, unroot
from vedette.kernels.derivative import numerical_jacobian
from vedette.kernels.reference import (
    imm_mix,
    innovate,
    innovate_points,
    log_sum,
    mixture,
    moments,
    propagate,
    root,
    safe_log,
    sigma_points,
    symmetric,
)

__all__ = [
    "imm_mix",
    "innovate",
    "innovate_points",
    "log_sum",
    "mixture",
    "moments",
    "numerical_jacobian",
    "propagate",
    "retrace",
    "root",
    "safe_log",
    "sigma_points",
    "symmetric",
    "unroot",
]
