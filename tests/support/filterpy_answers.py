"""What FilterPy's own filters answer on the data of examples/filterpy: `python -m support.filterpy_answers FILE` stores it.

Run in an environment with filterpy 2.0.0, from the folder `tests`. Each answer is a list of states and one of covariances, a
scan an entry; the first return meets the prior itself, as it does in a tracker.
"""

import json
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).parents[2] / "examples" / "filterpy"
F, H, R = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]]), np.array([[4.0]])
Q, Q_FULL = np.array([[0.25, 0.5], [0.5, 1.0]]), np.array([[0.3, 0.4], [0.4, 1.0]])
PRIOR = np.diag([100.0, 9.0])
RADAR_START, RADAR_PRIOR = np.array([100.0, 300.0, 8.0, 0.0]), np.diag([400.0, 400.0, 25.0, 25.0])
"""Over x, y, vx, vy."""


def table(name):
    return np.loadtxt(HERE / name, delimiter=",", skiprows=1)[:, 1:]


def linear(cls, noise=Q, **more):
    one = cls(dim_x=2, dim_z=1, **more)
    one.x, one.F, one.H, one.Q = np.zeros((2, 1)), F, H, noise
    if hasattr(one, "P_inv"):
        one.P_inv, one.R_inv = np.linalg.inv(PRIOR), np.linalg.inv(R)
    else:
        one.P, one.R = PRIOR, R
    return one


def followed(one, u=None, returns=None):
    """Update by every return, predicting in between."""
    x, P = [], []
    for k, z in enumerate(table("line.csv") if returns is None else returns):
        if k:
            one.predict() if u is None else one.predict(u)
        one.update(z.reshape(-1, 1))
        x.append(np.ravel(one.x).tolist())
        P.append(np.array(one.P).tolist())
    return {"x": x, "P": P}


def kalman(noise=Q):
    from filterpy.kalman import KalmanFilter

    return linear(KalmanFilter, noise)


def of_radar(accel=0.25):
    """The motion of the radar's target, from FilterPy's own noise, and its measurement with its derivative."""
    from filterpy.common import Q_discrete_white_noise

    block, still = Q_discrete_white_noise(2, 1.0, accel), np.zeros((2, 2))
    across = np.block([[block, still], [still, block]])[np.ix_([0, 2, 1, 3], [0, 2, 1, 3])]
    move = np.eye(4) + np.eye(4, k=2)

    def measure(x):
        return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])

    def slope(x):
        r = np.hypot(x[0], x[1])
        return np.array([[x[0] / r, x[1] / r, 0.0, 0.0], [-x[1] / r**2, x[0] / r**2, 0.0, 0.0]])

    return move, across, measure, slope, np.diag([25.0, 1e-4])


def ekf():
    from filterpy.kalman import ExtendedKalmanFilter

    move, noise, measure, slope, R_radar = of_radar()
    one = ExtendedKalmanFilter(4, 2)
    one.x, one.P, one.F, one.Q, one.R = RADAR_START, RADAR_PRIOR, move, noise, R_radar
    x, P = [], []
    for k, z in enumerate(table("radar.csv")):
        if k:
            one.predict()
        one.update(z, slope, measure)
        x.append(one.x.tolist())
        P.append(one.P.tolist())
    return {"x": x, "P": P}


def ukf():
    from filterpy.kalman import JulierSigmaPoints, UnscentedKalmanFilter

    move, noise, measure, _, R_radar = of_radar()
    one = UnscentedKalmanFilter(4, 2, 1.0, measure, lambda x, dt: move @ x, JulierSigmaPoints(4, 1.0))
    one.x, one.P, one.Q, one.R = RADAR_START, RADAR_PRIOR, noise, R_radar
    x, P = [], []
    for k, z in enumerate(table("radar.csv")):
        if k:
            one.predict()
        else:
            one.sigmas_f = one.points_fn.sigma_points(one.x, one.P)
        one.update(z)
        x.append(one.x.tolist())
        P.append(one.P.tolist())
    return {"x": x, "P": P}


def ckf():
    """FilterPy updates with the points that it predicted, which lack the process noise; here they are drawn anew."""
    from filterpy.kalman import CubatureKalmanFilter
    from filterpy.kalman.CubatureKalmanFilter import spherical_radial_sigmas

    move, noise, measure, _, R_radar = of_radar()
    one = CubatureKalmanFilter(4, 2, 1.0, lambda x: measure(np.ravel(x)), lambda x, dt: move @ x)
    one.x, one.P, one.Q, one.R = RADAR_START[:, None], RADAR_PRIOR, noise, R_radar
    x, P = [], []
    for k, z in enumerate(table("radar.csv")):
        if k:
            one.predict()
        one.sigmas_f = np.array(spherical_radial_sigmas(one.x, one.P))
        one.update(z[:, None])
        x.append(np.ravel(one.x).tolist())
        P.append(one.P.tolist())
    return {"x": x, "P": P}


def bank():
    from filterpy.common import Q_discrete_white_noise

    return [kalman(Q_discrete_white_noise(2, 1.0, accel**2)) for accel in (0.1, 1.0)]


def imm():
    from filterpy.kalman import IMMEstimator

    one = IMMEstimator(bank(), [0.6, 0.4], np.array([[0.95, 0.05], [0.1, 0.9]]))
    one.cbar = one.mu  # before the first prediction no mode has switched
    x, P, mu = [], [], []
    for k, z in enumerate(table("line.csv")):
        if k:
            one.predict()
        one.update(z.reshape(1, 1))
        x.append(np.ravel(one.x).tolist())
        P.append(one.P.tolist())
        mu.append(one.mu.tolist())
    return {"x": x, "P": P, "mode_prob": mu}


def mmae():
    """FilterPy sums a covariance over its filters that takes components of x for filters: it is summed here instead."""
    from filterpy.kalman import MMAEFilterBank

    one = MMAEFilterBank(bank(), [0.6, 0.4], 2)
    x, P, mu = [], [], []
    for k, z in enumerate(table("line.csv")):
        if k:
            for each in one.filters:  # its own `predict` hands u = 0 on, which needs a B
                each.predict()
        one.update(z.reshape(1, 1))
        apart = [(each.x - one.x).ravel() for each in one.filters]
        cov = sum(p * (np.outer(y, y) + each.P) for p, y, each in zip(one.p, apart, one.filters, strict=True))
        x.append(np.ravel(one.x).tolist())
        P.append(cov.tolist())
        mu.append(one.p.tolist())
    return {"x": x, "P": P, "mode_prob": mu}


def control():
    one = kalman()
    one.B = np.array([[0.5], [1.0]])
    return followed(one, u=np.array([[0.2]]))


def rts():
    one = kalman()
    found = followed(one)
    x, P, *_ = one.rts_smoother(np.array(found["x"])[:, :, None], np.array(found["P"]))
    return {"x": x[:, :, 0].tolist(), "P": P.tolist()}


def fading():
    one = kalman()
    one.alpha = 1.05
    return followed(one)


def information():
    from filterpy.kalman import InformationFilter

    return followed(linear(InformationFilter, compute_log_likelihood=False))


def square_root():
    from filterpy.kalman import SquareRootKalmanFilter

    return followed(linear(SquareRootKalmanFilter, Q_FULL))


def gh():
    from filterpy.gh import GHFilter

    one = GHFilter(x=0.0, dx=0.0, dt=1.0, g=0.6, h=0.2)
    return {"x": [list(map(float, one.update(z))) for z in table("line.csv")[:, 0]]}


def ghk():
    from filterpy.gh import GHKFilter

    one = GHKFilter(x=0.0, dx=0.0, ddx=0.0, dt=1.0, g=0.6, h=0.2, k=0.02)
    x = []
    for z in table("line.csv")[:, 0]:
        one.update(z)
        x.append([float(one.x), float(one.dx), float(one.ddx)])
    return {"x": x}


def least_squares():
    """Its first answer has a rate from one return, which means nothing."""
    from filterpy.leastsq import LeastSquaresFilter

    one = LeastSquaresFilter(1.0, 1)
    return {"x": [one.update(z).tolist() for z in table("line.csv")[:, 0]]}


def ensemble(runs=400):
    """The mean and the deviation over runs of what an ensemble of 100 estimates at the last scan."""
    from filterpy.kalman import EnsembleKalmanFilter

    ends = []
    for seed in range(runs):
        np.random.seed(seed)  # noqa: NPY002 - FilterPy draws from the global generator
        one = EnsembleKalmanFilter(np.zeros(2), PRIOR, 1, 1.0, 100, lambda x: x[:1], lambda x, dt: F @ x)
        one.Q, one.R = Q_FULL, R
        for k, z in enumerate(table("line.csv")):
            if k:
                one.predict()
            one.update(z)
        ends.append([*one.x, *np.sqrt(np.diag(np.cov(one.sigmas.T)))])
    return {"runs": runs, "mean": np.mean(ends, axis=0).tolist(), "deviation": np.std(ends, axis=0, ddof=1).tolist()}


ANSWERS = {
    "kalman": lambda: followed(kalman()),
    "kalman_control": control,
    "ekf": ekf,
    "ukf": ukf,
    "ckf": ckf,
    "imm": imm,
    "mmae": mmae,
    "square_root": square_root,
    "information": information,
    "fading_memory": fading,
    "rts": rts,
    "gh": gh,
    "ghk": ghk,
    "least_squares": least_squares,
    "ensemble": ensemble,
}

if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps({name: answer() for name, answer in ANSWERS.items()}) + "\n", encoding="utf-8")
