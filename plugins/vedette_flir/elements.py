"""All that the infrared paper has, and where it is here."""

from __future__ import annotations

from vedette_report.findings import Element

_SPOTS, _MODELS = "tests/flir/test_spots.py", "tests/flir/test_models.py"

ELEMENTS = (
    Element(
        "intensity of a hot spot, and its 8 x 8 pixels",
        "equations 1 and 5; figures 1 and 2",
        ("sensor gaussian_spot", "sensor elliptic_spot"),
        (_SPOTS, "law: sensor"),
    ),
    Element("what is seen is the sum of dynamics, atmosphere and vibration", "equation 2", (), (_SPOTS,)),
    Element(
        "truth: wandering dynamics behind a third-order atmosphere",
        "equations 3 and 4; figure 3",
        ("motion atmospheric_wander",),
        (_MODELS, "law: motion"),
    ),
    Element(
        "filter of eight states",
        "equations 6 to 9",
        ("motion jittered_acceleration", "motion carrying"),
        ("tests/flir/test_paper_filter.py", "law: motion"),
    ),
    Element(
        "extended Kalman filter on pixels, with one pass and iterated",
        "equations 10 to 14",
        ("estimator ekf", "estimator iekf"),
        (
            "tests/flir/test_paper_filter.py",
            "claim: An extended Kalman filter",
            "claim: The single-pass filter",
            "claim: The dynamics are known",
        ),
    ),
    Element("vibration", "section 2-3", (), ("left out, as in the paper: its platform stands still",)),
    Element("data processing", "section 4 of the body", (), ("its body is lost in the copy at hand",)),
    Element(
        "errors of dynamics and atmosphere, four figures without scales",
        "section III",
        (),
        ("tests/study/commands/test_reproduce.py", "claim: The dynamics are known"),
    ),
    Element(
        "on-line adaptation to brightness and size",
        "section I",
        ("sensor gaussian_spot", "sensor elliptic_spot"),
        ("claim: On-line adaptation",),
    ),
    Element(
        "several hot spots, of known and of unknown shape",
        "section IV",
        ("sensor hot_spots", "estimator template_filter"),
        ("claim: Targets with several hot spots", "tests/flir/test_template.py"),
    ),
    Element(
        "noise correlated over space",
        "sections I and IV",
        ("sensor gaussian_spot", "sensor elliptic_spot", "sensor hot_spots"),
        ("claim: A proper correlation", _SPOTS),
    ),
    Element(
        "noise correlated over time",
        "section I",
        ("estimator whitened_filter",),
        ("claim: The correlation of the noise over time", "tests/flir/test_whitened.py", "law: estimator"),
    ),
    Element(
        "adaptive noise of the state",
        "section IV",
        ("estimator residual_monitored",),
        ("claim: Adapting the state noise", "tests/flir/test_monitored.py"),
    ),
    Element(
        "a filter that matches the truth, not in the paper", "beyond", ("motion jittered_wander",), (_MODELS, "law: motion")
    ),
)
