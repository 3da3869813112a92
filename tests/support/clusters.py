"""What tests of studies on a cluster share: a boat that is drawn and tracked, and a scheduler in another process."""

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}


def boat(duration):
    """A config of one boat, drawn and tracked for `duration` s."""
    return {
        "source": {
            "kind": "simulation",
            "duration": duration,
            "looks": {"radar": {"interval": 1}},
            "drawn": {"boat": {"models": [CV], "start": START}},
        },
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0, "detection_probability": 0.9}},
        "estimator": {"kind": "kalman", "motion": CV},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": START},
        "lifecycle": {"kind": "single_target"},
    }


def cluster(protocol):
    """A program that serves a cluster of one worker, prints its address, and ends with its standard input."""
    return f"""
import sys
from distributed import LocalCluster
if __name__ == "__main__":
    made = LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None, silence_logs=50,
                        protocol="{protocol}", host="127.0.0.1")
    print(made.scheduler_address, flush=True)
    sys.stdin.read()
"""
