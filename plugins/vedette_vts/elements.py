"""All that the paper on the vessel traffic radar has, and where it is here."""

from __future__ import annotations

from vedette_report.findings import Element

_TESTS = "tests/vts/test_reproduction.py::"

ELEMENTS = (
    Element(
        "models of constant velocity and constant acceleration",
        "equations 1 to 6",
        ("motion constant_velocity_piecewise", "motion wiener_acceleration_piecewise"),
        ("law: motion", "tests/vts/test_matched_truth.py::test_each_filter_is_consistent_on_its_own_model"),
    ),
    Element(
        "returns converted, with their covariance",
        "equations 7 to 10",
        ("preprocessor naive_conversion", "sensor polar_position"),
        ("tests/standard/preprocessors/test_conversions.py",),
    ),
    Element(
        "the same without correlation between gain and error, not in the paper",
        "beyond",
        ("preprocessor decorrelated_conversion", "sensor decorrelated_position"),
        ("tests/vts/test_decorrelated.py::test_far_off_only_the_decorrelated_conversion_is_consistent",),
    ),
    Element(
        "IMM of filters whose states differ",
        "equations 11 to 13 and 20 to 25; figure 1",
        ("estimator imm",),
        ("law: estimator", "tests/vts/test_matched_truth.py::test_each_filter_is_consistent_on_its_own_model"),
    ),
    Element("CVKF and CAKF", "equations 14 to 19", ("estimator kalman",), ("law: estimator",)),
    Element(
        "the vessel, and what the radar sees of it",
        "tables 1 and 2; figure 2",
        (),
        (f"{_TESTS}test_the_trajectory_is_table_1",),
    ),
    Element("the CVKF leaves its gate", "figure 3", (), ("claim: The CVKF errs much in manoeuvres",)),
    Element(
        "the CAKF keeps it, and errs more in straight flight",
        "figure 4",
        (),
        ("claim: The returns stay in the gate of the CAKF", "claim: It is the model of constant acceleration"),
    ),
    Element(
        "the IMMs keep it",
        "figures 5 and 6",
        (),
        (
            "claim: The returns stay in the gate of the IMMCV2",
            "claim: The returns stay in the gate of the IMMCVCA",
            "claim: The returns are always in the gate",
        ),
    ),
    Element(
        "the IMM errs as little as the CVKF in straight flight, and less than a single filter that keeps the track",
        "sections 3 and 4",
        (),
        ("claim: In straight flight the IMM is about", "claim: The IMM keeps the track"),
    ),
)
