"""All that the marine paper has, and where it is here."""

from __future__ import annotations

from vedette_report.findings import Element

_STUDY, _VERDICTS = "tests/marine/test_reproduction.py", "tests/marine/test_verdicts.py"

ELEMENTS = (
    Element(
        "mixing, modes' likelihoods and probabilities, combination",
        "equations 1 to 4 and 27 to 32",
        ("estimator imm",),
        ("law: estimator", f"{_STUDY}::test_the_printed_mode_update_is_stuck_at_zero_and_ours_is_not"),
    ),
    Element(
        "start from AIS: course, speed, rate of turn",
        "equations 5 to 9; section 3.1",
        ("birth announced", "lifecycle announced"),
        (f"{_STUDY}::test_the_printed_course_convention_loses_what_is_seen_late", "law: birth"),
    ),
    Element(
        "prediction by the models of table 6",
        "equations 10 to 15; table 6; figures 1 and 2",
        (
            "motion constant_velocity_piecewise",
            "motion random_walk_piecewise",
            "motion coordinated_turn_piecewise",
        ),
        (f"{_VERDICTS}::test_table_6_is_computed_as_printed", "law: motion"),
    ),
    Element("gate and its volume", "equations 16 and 17; table 6", (), ("claim: A gate of 13.074",)),
    Element(
        "probabilistic data association, m/V as density",
        "equations 18 to 26; table 1",
        ("associator pda",),
        ("law: associator", f"{_STUDY}::test_a_density_from_the_gate_is_careful_by_a_few_per_cent"),
    ),
    Element(
        "from radar pictures to returns",
        "figures 4 and 6; section 3.1",
        ("preprocessor radar_picture", "sensor radar_screen"),
        ("tests/marine/test_simulated_pictures.py", "tests/marine/test_pictures.py"),
    ),
    Element(
        "the recordings DARC and MANV, their ships and AIS",
        "tables 2 and 3; figures 3 and 5",
        (),
        (f"{_STUDY}::test_the_scenes_to_change_are_the_study_s", "to be had from the DLR, not at hand"),
    ),
    Element(
        "errors against AIS",
        "equations 33 and 34; table 4; figure 7 a, b",
        (),
        (
            "claim: IMM-PDAF is more accurate than CV-PDAF where",
            "claim: IMM-PDAF is more accurate than CT-PDAF where",
            "claim: IMM-PDAF is more accurate than CV-PDAF on the large",
            "claim: The errors are in the order",
            "claim: Errors of 98 to 117 m",
        ),
    ),
    Element("tracks through clutter", "figure 7 c, d; section 3.2", (), ("claim: IMM-PDAF tracks the targets stably",)),
    Element(
        "a track that begins before its first return",
        "figure 7 d; section 3.2",
        (),
        ("claim: A track that begins before", f"{_STUDY}::test_without_returns_a_track_coasts_as_announced"),
    ),
    Element("run times", "table 5", (), ("claim: The run times",)),
)
