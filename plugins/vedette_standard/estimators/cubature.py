"""The cubature Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import MotionModel, Traits, fields
from vedette.filters import PointFilter


@final
@frozen
class CubatureKalman(PointFilter):
    """Moves the 2n points mean +- sqrt(n) columns of the Cholesky factor of P, weights 1/(2n), and takes their moments.

    The rule is exact for polynomials up to the third degree. It is the unscented filter without a central point, kappa = 0,
    and is computed so.
    Arasaratnam, Haykin, Cubature Kalman Filters, IEEE Trans. Automatic Control 54, 2009.
    """

    kind: ClassVar[str] = "ckf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True)

    motion: MotionModel = fields.part("how the target moves")

    @property
    def kappa(self) -> float:
        """0: no central point."""
        return 0.0
