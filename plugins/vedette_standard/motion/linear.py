"""A linear motion model from its matrices."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.matrices import covariance_fault, named_space


def _state(model: Linear) -> Space:
    return named_space(model.axes, model.units)


@final
@frozen
class Linear(MotionModel):
    """x' = F x + B u + w, w ~ N(0, Q), over each step of length `step`, with a constant control u.

    The matrices hold for that step: n of them make F^n and Q + F Q F' + .., and of a part r of one, F is (1 - r) I + r F, Q
    r Q and B u r B u, which is right to first order alone: let scans come at whole steps. With a control it is affine, not
    linear: `ekf` is then exact, and `kalman` refuses it.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 4.3.

    >>> F, Q, B, u = np.array([[1.0, 0.5], [0.0, 0.9]]), np.array([[0.2, 0.1], [0.1, 0.3]]), np.array([[2.0], [1.0]]), [3.0]
    >>> model, x = Linear(("p", "q"), F, Q, step=2.0, B=B, control=u), np.array([10.0, 4.0])
    >>> push, r = np.array([6.0, 3.0]), 0.25  # B u
    >>> np.allclose(model.move(x, 4.0), F @ (F @ x + push) + push), np.allclose(model.noise(x, 4.0), Q + F @ Q @ F.T)
    (True, True)
    >>> part = 0.75 * np.eye(2) + 0.25 * F  # of a quarter of a step
    >>> np.allclose(model.move(x, 0.5), part @ x + 0.25 * push), np.allclose(model.noise(x, 0.5), 0.25 * Q)
    (True, True)
    >>> np.allclose(model.move(x, 2.5), part @ (F @ x + push) + 0.25 * push)
    True
    >>> np.allclose(model.jacobian(x, 2.5), part @ F), np.allclose(model.noise(x, 2.5), part @ Q @ part.T + 0.25 * Q)
    (True, True)
    >>> model.linear, Linear(("p", "vx"), F, Q).linear, str(Linear(("p", "vx"), F, Q, units={"p": "K"}).state)
    (False, True, '(p [K], vx [m/s])')
    """

    kind: ClassVar[str] = "linear"

    axes: tuple[str, ...] = fields.words("the axes of the state")
    F: Array = fields.array("1", "transition over a step, a row an axis", ndim=2)
    Q: Array = fields.array("1", "covariance of the noise of a step", ndim=2)
    step: float = fields.quantity("s", "time that F, Q and B are for", default=1.0, above=0)
    B: Array = fields.array("1", "effect of the control in a step; default: there is none", ndim=2, default=np.zeros((0, 0)))
    control: Array = fields.array("1", "u, the constant control", ndim=1, default=np.zeros(0))
    units: dict[str, str] = fields.names("axis to its unit where the name does not say it: x m, vx m/s, ax m/s^2, others 1")
    state: Space = field(init=False, repr=False, eq=False, default=Factory(_state, takes_self=True))

    def __attrs_post_init__(self) -> None:
        n = len(self.axes)
        for name, matrix in (("F", self.F), ("Q", self.Q)):
            if matrix.shape != (n, n):
                raise ValueError(f"{name}: must be {n} x {n}, as `axes` has {n}, got {matrix.shape[0]} x {matrix.shape[1]}")
        if fault := covariance_fault(self.Q, definite=False):
            raise ValueError(f"Q: {fault}")
        if (self.B.size or self.control.size) and self.B.shape != (n, len(self.control)):
            shape = f"{self.B.shape[0]} x {self.B.shape[1]}"
            raise ValueError(f"B: must be {n} x {len(self.control)}, a row an axis, a column a control, got {shape}")

    @property
    def linear(self) -> bool:
        """Whether it has no control."""
        return not self.control.size

    def move(self, x: Array, dt: float) -> Array:
        n = len(self.state)
        F = self._over(dt)[0]
        return x @ F[:n, :n].T + F[:n, n]

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F (n, n) over `dt`."""
        n = len(self.state)
        return self._over(dt)[0][:n, :n]

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q (n, n) over `dt`."""
        return self._over(dt)[1]

    def _over(self, dt: float) -> tuple[Array, Array]:
        """Return [F B u; 0 1] (n+1, n+1) and Q (n, n) over `dt`: whole steps by squaring, then the part of one."""
        n = len(self.state)
        whole = int(dt / self.step + 1e-9)
        part = max(dt / self.step - whole, 0.0)
        F, Q = np.eye(n + 1), np.zeros((n, n))
        F_step, Q_step = np.eye(n + 1), np.array(self.Q)
        F_step[:n, :n] = self.F
        if self.control.size:
            F_step[:n, n] = self.B @ self.control
        F_part, Q_part = (1 - part) * np.eye(n + 1) + part * F_step, part * Q_step
        while whole:
            if whole & 1:
                Q = F_step[:n, :n] @ Q @ F_step[:n, :n].T + Q_step
                F = F_step @ F
            Q_step = F_step[:n, :n] @ Q_step @ F_step[:n, :n].T + Q_step
            F_step = F_step @ F_step
            whole >>= 1
        if part > 1e-9:
            Q = F_part[:n, :n] @ Q @ F_part[:n, :n].T + Q_part
            F = F_part @ F
        return F, (Q + Q.T) / 2
