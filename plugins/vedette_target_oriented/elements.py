"""All that the paper on the target-oriented velocity has, and where it is here."""

from __future__ import annotations

from vedette_report.findings import Element

_MODELS, _RESETS = "tests/target_oriented/test_models.py", "tests/target_oriented/test_resets.py"
_CONSISTENT = "tests/target_oriented/test_consistency.py"

ELEMENTS = (
    Element("state and measurement of a filter", "equation 1; figure 1", ("estimator ekf",), ("law: estimator",)),
    Element(
        "the target-oriented model: state, axes, transition, noise",
        "equations 2 to 7",
        ("motion target_oriented",),
        ("law: motion", _MODELS, f"{_CONSISTENT}::test_the_mean_noise_makes_the_model_consistent"),
    ),
    Element(
        "heading from the last two positions, v_s set to 0",
        "equation 8; section 3.1",
        ("motion target_oriented_literal", "motion target_oriented_certain"),
        (_RESETS, f"{_CONSISTENT}::test_on_jump_truth_the_consistent_model_is_in_its_band_and_the_literal_one_is_twice_off"),
    ),
    Element(
        "a heading from a filter of its own or from an average, which the paper does not take",
        "section 3.1",
        ("motion target_oriented_smoothed",),
        (f"{_RESETS}::test_a_filtered_heading_lags_by_its_gain", "claim: A filtered heading errs less"),
    ),
    Element(
        "three of them in an IMM-PDAF", "section 3.2; figure 2", ("estimator imm", "associator pda"), ("law: estimator",)
    ),
    Element(
        "accelerations that walk at random for a time",
        "section 4.1; equation 9",
        (),
        ("tests/target_oriented/test_accelerations.py",),
    ),
    Element(
        "their correlation",
        "figure 3",
        (),
        ("claim: Scenario 1: forward and side", "claim: Scenario 2: forward and side"),
    ),
    Element(
        "their distribution and variances",
        "figure 4",
        (),
        (
            "claim: Scenario 1: the forward acceleration",
            "claim: Scenario 2: forward and aside",
            "claim: The forward acceleration is nearly",
            "claim: Along the velocity the variance",
            "claim: The four variances",
        ),
    ),
    Element(
        "the aircraft, Singer's model and known turn rates beside it",
        "section 4.3",
        ("motion singer", "motion known_turn"),
        ("tests/target_oriented/test_reproduction.py::test_the_trajectory_is_the_papers", "law: motion"),
    ),
    Element(
        "errors over time",
        "figure 5",
        (),
        ("claim: Singer's error is larger", "claim: The target-oriented model errs sharply"),
    ),
    Element(
        "errors and fails",
        "table 1; section 4.3",
        (),
        (
            "claim: In manoeuvres the target-oriented",
            "claim: It is better than known turn rates",
            "claim: Over the whole flight",
            "claim: On straight legs",
            "claim: It loses the target less often",
            "claim: Singer fails in 11.4 %",
            "claim: RMS errors in metres",
            "claim: Fails are 3.3 %",
        ),
    ),
    Element("the covariance as printed", "equation 7", (), ("claim: Equation 7 is the covariance",)),
)
