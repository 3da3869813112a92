"""A target that drives along clothoids, as roads and railways are laid out."""

import numpy as np
from attrs import frozen

import vedette

NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@frozen
class Clothoid(vedette.MotionModel):
    """Heading h + c s + k s^2 / 2 along the path s: curvature c changes evenly, by the sharpness k."""

    kind = "clothoid"
    sigma_accel: float = vedette.fields.quantity("m/s^1.5", "speed gained in 1 s", above=0)
    sigma_sharpness: float = vedette.fields.quantity("1/km^2/s^0.5", "sharpness gained in 1 s", above=0)
    state = vedette.Space.of(x="m", y="m", heading="rad mod 2pi", speed="m/s", curvature="1/km", sharpness="1/km^2")

    def move(self, x, dt):
        h, v, c, k = (x[..., i, None] for i in (2, 3, 4, 5))
        s = 1e-3 * dt * v * np.append((NODES + 1) / 2, 1.0)  # path to each node and to the end, in km
        heading = h + c * s + k * s**2 / 2
        along = np.stack([np.cos(heading[..., :-1]), np.sin(heading[..., :-1])], axis=-2)
        position = x[..., :2] + dt * v / 2 * (along @ WEIGHTS)
        return self.state.canonical(np.concatenate([position, heading[..., -1:], v, c + k * s[..., -1:], k], axis=-1))

    def noise(self, x, dt):
        return dt * np.diag([0.0, 0.0, 0.0, self.sigma_accel, 0.0, self.sigma_sharpness]) ** 2
