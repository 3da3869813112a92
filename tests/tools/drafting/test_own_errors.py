"""Columns of each return's own errors are found, and kept where returns are likelier by them."""

import tomllib
from collections import Counter

import numpy as np
import pytest

from vedette_tools.drafting.config import draft_config
from vedette_tools.drafting.recognising import read_table
from vedette_tools.drafting.trial import tried

ERRORS = {
    "deviations": ("x_std,y_std", lambda k: (2.0 + k, 3.0), {"x": "x_std", "y": "y_std"}),
    "variances": (
        "var_x,cov_xy,var_y",
        lambda k: (9.0, -1.0, 4.0 + k),
        {"x x": "var_x", "y y": "var_y", "x y": "cov_xy"},
    ),
    "one alone": ("var_x,b", lambda k: (9.0, 1.0), {}),
    "none above 0": ("x_std,y_std", lambda k: (0.0, 0.0), {}),
}


@pytest.mark.parametrize("what", ERRORS)
def test_errors_of_returns_are_read_where_each_axis_has_them(what, tmp_path):
    titles, row, noise = ERRORS[what]
    rows = [",".join(map(str, (2 * k, 3 * k, 50 - k, *row(k)))) for k in range(40)]
    (tmp_path / "d.csv").write_text("\n".join([f"time,x,y,{titles}", *rows]))
    assert read_table(tmp_path / "d.csv").noise == noise


@pytest.mark.parametrize(("far", "kept"), [(1.0, True), (1000.0, False)])
@pytest.mark.costly
def test_a_draft_keeps_errors_of_returns_only_where_these_are_likelier_by_them(far, kept, tmp_path, monkeypatch):
    """Each design is tried once on returns with errors of their own, and without."""
    tries = Counter()

    def counted(text, scans, clean):
        tries[text, scans[0].detections.noise is None] += 1
        return tried(text, scans, clean=clean)

    monkeypatch.setattr("vedette_tools.drafting.config.tried", counted)
    rng = np.random.default_rng(4)
    sigmas = [3.0 if k % 2 else 60.0 for k in range(80)]
    spots = (
        np.array([(3e3 + 16 * k, 1e3 - 6 * k) for k in range(80)]) + rng.normal(0, 1, (80, 2)) * np.array(sigmas)[:, None]
    )
    rows = [f"{2 * k},{x},{y},{far * s},{far * s}" for k, ((x, y), s) in enumerate(zip(spots, sigmas, strict=True))]
    (tmp_path / "d.csv").write_text("\n".join(["time,x,y,sigma_x,sigma_y", *rows]))
    draft = draft_config(tmp_path / "d.csv")
    assert ("noise" in tomllib.loads(draft)["source"]["detections"]) == kept
    assert set(tries.values()) == {1}
    assert ("left out: returns are less likely" in draft) != kept
