"""The scene and the filters of the study, as configs; examples/bayes_risk holds the same to be changed."""

from __future__ import annotations

import math
from typing import Any

from attrs import frozen

SIGMA = 6.7
"""In m; the paper does not state it. Chosen so that its filter has the published error: agreement there is calibration."""
REACH = 4.0
"""The threshold over sigma."""
THRESHOLD = REACH * SIGMA
CLUTTER = 0.3e-6
SENSORS = tuple(f"s{i}" for i in range(1, 8))
GATE = 0.9999


def scene() -> dict[str, Any]:
    """Return the source: table 1 of the paper, seen by seven sensors each second for 90 s."""
    legs = [
        {"do": "straight", "seconds": 20},
        {"do": "push", "seconds": 10, "push": [-5, 5]},
        {"do": "straight", "seconds": 20},
        {"do": "push", "seconds": 20, "push": [-5, -5]},
        {"do": "push", "seconds": 20, "push": [5, 5]},
    ]
    area = {"x": {"low": -500, "high": 5000}, "y": {"low": -500, "high": 11000}}
    target = {"start": [0, 0], "course": math.pi / 4, "speed": math.hypot(100, 100), "legs": legs}
    return {
        "kind": "simulation",
        "duration": 90,
        "looks": {name: {"interval": 1, "clutter": area} for name in SENSORS},
        "ships": {"target": target},
    }


def sensor(clutter: float, sigma: float = SIGMA) -> dict[str, Any]:
    """Return the config of one of the seven identical sensors."""
    return {"kind": "cartesian_position", "sigma": sigma, "clutter_density": clutter}


@frozen
class Choice:
    """What the paper leaves unsaid: sigma of the sensors in m, the threshold over it, a factor on all process noises."""

    sigma: float = SIGMA
    reach: float = REACH
    noise: float = 1.0

    def config(
        self, title: str, estimator: dict[str, Any], associator: str, clutter: float, rest: dict[str, float]
    ) -> dict[str, Any]:
        """Return an experiment whose tracker takes the scans of the seven sensors one after the other."""
        return {
            "title": title,
            "seed": 1,
            "source": scene(),
            "sensors": {name: sensor(clutter, self.sigma) for name in SENSORS},
            "estimator": estimator,
            "gate": {"probability": GATE},
            "associator": {"kind": associator},
            "birth": {"kind": "given", "spread": {"x": self.sigma, "y": self.sigma, **rest}},
            "lifecycle": {"kind": "single_target"},
        }

    def straight(self, estimator: str) -> dict[str, Any]:
        """Return the proposed filter's one model, of constant velocity."""
        return {"kind": estimator, "motion": {"kind": "constant_velocity_piecewise", "sigma_accel": 6.0 * self.noise}}

    def proposed(
        self, detection: str, estimator: str, associator: str = "bayes_risk", clutter: float = CLUTTER
    ) -> dict[str, Any]:
        """Return detection over the seven sensors, one constant-velocity filter per return; the fused sigma is not used."""
        config = self.config("", self.straight(estimator), associator, clutter, _SPEED)
        detector: dict[str, Any] = {"kind": detection, "sensors": config["sensors"], "threshold": self.reach * self.sigma}
        if detection != "clustered_detection":
            detector["base"] = "s1"
        title = f"Distributed detection over seven sensors: {detection}, {estimator}"
        fused = {"preprocessors": {"fused": detector}, "sensors": {"fused": sensor(clutter, self.sigma)}}
        return config | {"title": title} | fused

    def baseline(self, q: tuple[float, float], transition: list[list[float]], title: str) -> dict[str, Any]:
        """Return IMM over constant velocity and constant acceleration; PDA takes simultaneous scans one after the other."""
        cv, ca = (self.noise * intensity for intensity in q)
        modes = [
            {"kind": "kalman", "motion": {"kind": "constant_velocity_piecewise", "sigma_accel": cv}},
            {"kind": "kalman", "motion": {"kind": "wiener_acceleration_piecewise", "sigma_change": ca}},
        ]
        estimator = {"kind": "imm", "transition": transition, "modes": modes}
        return self.config(title, estimator, "pda", CLUTTER, _SPEED | {"ax": 2.0, "ay": 2.0})

    def filters(self) -> dict[str, dict[str, Any]]:
        """Return the filters of table 2: as corrected, as printed, and the IMM tuned and soft."""
        tuned = self.baseline((1.0, 2.0), [[0.95, 0.05], [0.1, 0.9]], "IMM of CV and CA with multi-sensor PDA, tuned")
        soft = self.baseline((0.05, 0.5), [[0.8, 0.2], [0.2, 0.8]], "IMM of CV and CA with multi-sensor PDA, soft")
        return {
            "proposed": self.proposed("bayes_risk_detection", "kalman"),
            "proposed, printed": self.proposed("bayes_risk_printed", "parallel_kalman_printed"),
            "IMM/MSPDA tuned": tuned,
            "IMM/MSPDA soft": soft,
        }

    def beyond(self) -> dict[str, dict[str, Any]]:
        """Return what the paper has not: R given k, no privileged base, and plain sequential PDA of one model."""
        return {
            "R given k": self.proposed("bayes_risk_by_count", "kalman"),
            "no base": self.proposed("clustered_detection", "kalman", "pda"),
            "sequential PDA": self.config(
                "One constant-velocity filter with sequential PDA", self.straight("kalman"), "pda", CLUTTER, _SPEED
            ),
        }

    def ungated(self) -> dict[str, dict[str, Any]]:
        """Return the proposed filter, corrected and printed, without the gate that the paper does not have."""
        return {f"{name}, no gate": self.filters()[name] | {"gate": "off"} for name in ("proposed", "proposed, printed")}

    def contested(self) -> dict[str, dict[str, Any]]:
        """Return the variants at 100 times the published clutter, where returns compete often enough to tell them apart."""
        variants: dict[str, tuple[str, str, str]] = {
            "printed weights, printed P": ("bayes_risk_printed", "parallel_kalman_printed", "bayes_risk"),
            "printed weights, with spread": ("bayes_risk_printed", "kalman", "bayes_risk"),
            "corrected weights, printed P": ("bayes_risk_detection", "parallel_kalman_printed", "bayes_risk"),
            "corrected weights, with spread": ("bayes_risk_detection", "kalman", "bayes_risk"),
            "likelihood ratio, with spread": ("count_likelihood_detection", "kalman", "bayes_risk"),
            "likelihood ratio, PDA": ("count_likelihood_detection", "kalman", "pda"),
        }
        return {name: self.proposed(*parts, DENSE) for name, parts in variants.items()}


_SPEED = {"vx": 10.0, "vy": 10.0}
DENSE = 100 * CLUTTER
FILTERS, BEYOND, UNGATED, CONTESTED = Choice().filters(), Choice().beyond(), Choice().ungated(), Choice().contested()
"""Process noises, transition probabilities, threshold and gate are chosen: the paper states none."""
