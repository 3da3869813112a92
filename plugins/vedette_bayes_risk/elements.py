"""All that the paper on Bayes-risk detection has, and where it is here."""

from __future__ import annotations

from vedette_report.findings import Element

_COUNTS, _DETECTION = "tests/bayes_risk/test_counting.py", "tests/bayes_risk/test_detection.py"

ELEMENTS = (
    Element(
        "global decision g at the number of sensors that makes the Bayes risk least",
        "section 2; equation 1; figure 1",
        ("preprocessor bayes_risk_decision",),
        ("tests/bayes_risk/test_decision.py", "law: preprocessor"),
    ),
    Element(
        "confirmations of a base's returns, their probabilities and L(k)",
        "equations 2, 4 and 5",
        ("preprocessor bayes_risk_detection", "preprocessor bayes_risk_printed"),
        (f"{_COUNTS}::test_the_count_given_a_target_and_given_clutter", _DETECTION, "claim: P_D(k) and P_F(k)"),
    ),
    Element(
        "probabilities of a false alarm and of a miss",
        "equation 3",
        (),
        (_COUNTS, "claim: The probability of a false alarm"),
    ),
    Element(
        "L(k) as weight of a return",
        "equation 5",
        ("associator bayes_risk",),
        ("tests/bayes_risk/test_association.py", "law: associator"),
    ),
    Element(
        "parallel Kalman filters",
        "equation 6; figure 2",
        ("estimator kalman", "estimator parallel_kalman_printed"),
        ("claim: P(k | k) = sum",),
    ),
    Element(
        "IMM/MSPDA, what it is compared with",
        "section 4",
        ("estimator imm", "associator pda"),
        ("law: estimator", "law: associator"),
    ),
    Element(
        "the target's path", "table 1; figure 3", (), ("tests/bayes_risk/test_reproduction.py::test_the_path_is_table_1",)
    ),
    Element(
        "errors in manoeuvres",
        "table 2; figure 4",
        (),
        (
            "claim: The error in manoeuvres is 3.53 m",
            "claim: The proposed filter is 2 to 25 % better",
            "claim: It is better because",
        ),
    ),
    Element(
        "the same counts as a likelihood ratio, not in the paper",
        "beyond",
        ("preprocessor count_likelihood_detection",),
        (_DETECTION,),
    ),
    Element(
        "R given the number of sensors, not in the paper",
        "beyond",
        ("preprocessor bayes_risk_by_count",),
        (f"{_COUNTS}::test_the_fused_error_given_the_count", "tests/bayes_risk/test_beyond.py"),
    ),
    Element(
        "detection without a privileged base, not in the paper",
        "beyond",
        ("preprocessor clustered_detection",),
        ("tests/bayes_risk/test_clustered.py", "tests/bayes_risk/test_beyond.py"),
    ),
)
