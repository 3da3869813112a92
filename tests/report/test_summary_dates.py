"""The summary of a recording whose times are dates says them as dates."""

import vedette
from vedette_report.summary.words import summary


def test_dates_are_said_as_dates(tmp_path):
    rows = [f"2026-05-12T08:30:{3 * k:02d}Z,{5 * k},0" for k in range(10)]
    (tmp_path / "plots.csv").write_text("\n".join(["utc,x,y", *rows]) + "\n")
    config = {
        "source": {
            "kind": "csv",
            "path": str(tmp_path / "plots.csv"),
            "detections": {"time": "utc", "columns": {"x": "x", "y": "y"}},
        },
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
    result = vedette.load(config).run()
    text = summary(result.experiment, result, result.score())
    assert "2026-05-12T08:30:00Z to 2026-05-12T08:30:27Z: 27 s" in text
