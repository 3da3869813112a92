"""Numerical integration."""

from scipy.integrate import solve_ivp


# Turns in space.
def integrated(derivative, x, dt):
    return solve_ivp(lambda t, y: derivative(y), (0, dt), x, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
