"""A linear motion model from its matrices."""

from __future__ import annotations

from functools import cached_property
from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.matrices import covariance_fault, named_space
from vedette_standard.motion.within_a_step import WithinAStep, within_a_step


def _state(model: Linear) -> Space:
    return named_space(model.axes, model.units)


@final
@frozen
class Linear(MotionModel):
    """x' = F x + B u + w, w ~ N(0, Q), over each step of length `step`, with a constant control u.

    The matrices hold for that step: n of them make F^n and Q + F Q F' + .. A part r of one is that of the flow
    dx = (A x + b) dt + dw that makes F, B u and Q in a step: exp(A r). Of a noise that no flow makes, as one that is held
    through a step, the part is that of a near one that is made, of the same size; of an F that none makes, as it forgets an
    axis or turns its sign at once, F is (1 - r) I + r F, B u r B u and Q r Q: let scans come at whole steps then.
    With a control it is affine, not linear: `ekf` is then exact, and `kalman` refuses it.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 4.3.

    >>> from scipy.linalg import sqrtm
    >>> F, Q, B, u = np.array([[1.0, 0.5], [0.0, 0.9]]), np.array([[0.2, 0.1], [0.1, 0.3]]), np.array([[2.0], [1.0]]), [3.0]
    >>> model, x = Linear(("p", "q"), F, Q, step=2.0, B=B, control=u), np.array([10.0, 4.0])
    >>> push, half = np.array([6.0, 3.0]), sqrtm(F)  # B u, of which a half step makes y: half y + y is of two
    >>> np.allclose(model.move(x, 4.0), F @ (F @ x + push) + push), np.allclose(model.noise(x, 4.0), Q + F @ Q @ F.T)
    (True, True)
    >>> np.allclose(model.move(x, 1.0), half @ x + np.linalg.solve(half + np.eye(2), push))
    True
    >>> q = model.noise(x, 1.0)
    >>> np.allclose(model.jacobian(x, 3.0), half @ F), np.allclose(half @ q @ half.T + q, Q), model.divisible
    (True, True, True)
    >>> Linear(("p", "q"), np.diag([1.0, -0.5]), Q).jacobian(x, 0.25).diagonal().tolist()  # 1 - r + r F
    [1.0, 0.625]
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

    @property
    def divisible(self) -> bool:
        """Whether a flow makes F and Q."""
        return self._within is not None and self._within.exact

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
        n = len(self.state)
        return self._over(dt)[1][:n, :n]

    @cached_property
    def _step(self) -> tuple[Array, Array]:
        """[F B u; 0 1] and [Q 0; 0 0] (n+1, n+1) over a step."""
        n = len(self.state)
        F, Q = np.eye(n + 1), np.zeros((n + 1, n + 1))
        F[:n, :n], Q[:n, :n] = self.F, self.Q
        if self.control.size:
            F[:n, n] = self.B @ self.control
        return F, Q

    @cached_property
    def _within(self) -> WithinAStep | None:
        return within_a_step(*self._step)

    def _over(self, dt: float) -> tuple[Array, Array]:
        """Return [F B u; 0 1] and [Q 0; 0 0] (n+1, n+1) over `dt`: whole steps by squaring, then the part of one."""
        whole = int(dt / self.step + 1e-9)
        part = max(dt / self.step - whole, 0.0)
        F_step, Q_step = self._step
        F, Q = np.eye(len(F_step)), np.zeros(F_step.shape)
        while whole:
            if whole & 1:
                F, Q = F_step @ F, F_step @ Q @ F_step.T + Q_step
            F_step, Q_step = F_step @ F_step, F_step @ Q_step @ F_step.T + Q_step
            whole >>= 1
        if part > 1e-9:
            F_part, Q_part = self._part(part)
            F, Q = F_part @ F, F_part @ Q @ F_part.T + Q_part
        return F, (Q + Q.T) / 2

    def _part(self, part: float) -> tuple[Array, Array]:
        """Return the same over a part of a step, from 0 to 1."""
        if self._within is not None:
            return self._within.over(part)
        F, Q = self._step
        return (1 - part) * np.eye(len(F)) + part * F, part * Q
