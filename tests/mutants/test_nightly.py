"""What is run by night alone catches nothing alone: the faults that it would see are caught by a test of the day.

`BY_DAY` names, for every test that is marked `nightly`, what tries the same by day: a test, `laws` (of a kind that changed:
`support.selection`), or `.ci/run`. `FAULTS` puts faults in, and the day's test fails. All other mutants, ours and those of
others, are caught by tests that are marked nowhere.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bayes_risk import test_association as weights
from flir import test_sizes, test_template
from marine import test_cfar as rates
from marine import test_chain as chain
from mutants.test_cures import CURES
from support.paths import ROOT
from testing import test_assert_consistent as consistent
from tools.tuning.test_mutants import MUTANTS
from vedette_bayes_risk.parallel import ParallelKalmanPrinted
from vedette_flir.estimators import growth, template
from vedette_marine.picture.evidence import Evidence
from vedette_report.consistency import chi_square_verdict
from vedette_report.whole_trackers import verdicts
from vedette_standard.estimators.kalman import Kalman

TESTS = ROOT / "tests"

BY_DAY: dict[str, tuple[str, ...]] = {
    "benchmarks/test_existence.py::test_stated_existence_is_the_share_of_targets": (
        "benchmarks/test_existence.py::test_doubt_that_is_left_out_is_found",
    ),
    "benchmarks/test_flir_found.py::test_more_is_found_where_more_stands_out_and_where_less_is_asked": (
        "benchmarks/test_flir_found.py::test_a_drawn_spot_is_found_and_noise_is_not",
    ),
    "benchmarks/test_wild.py::test_each_kind_is_followed": (
        "tools/drafting/test_proof.py::test_every_recorded_ship_that_is_named_has_one_track",
        "tools/drafting/test_proof.py::test_one_target_that_manoeuvres_has_one_track",
    ),
    "benchmarks/test_wild.py::test_two_aircraft_of_one_name_are_tracked_no_worse_than_without_names": (
        "tools/drafting/test_wrong_codes.py::test_wrong_codes_do_no_harm",
        "tracking/test_hostile_names.py::test_two_objects_have_two_tracks_whatever_their_codes",
    ),
    "fuzz/test_fuzz.py::test_guided_by_coverage_a_planted_fault_is_found_and_no_other": (
        "fuzz/test_fuzz.py::test_nothing_escapes",
        "fuzz/test_seeds.py",
    ),
    "fuzz/test_fuzz.py::test_the_fuzzer_of_folders_bites": (
        "fuzz/test_fuzz.py::test_the_fuzzer_of_live_calls_bites",
        "fuzz/test_seeds.py",
    ),
    "adapters/test_stonesoup.py::laws": ("adapters/test_stonesoup_tutorials.py",),
    "bayes_risk/test_reproduction.py::test_where_returns_compete_the_printed_covariance_is_twice_too_small": (
        "bayes_risk/test_association.py::test_the_printed_covariance_is_the_mixtures_less_the_spread_of_the_means",
        "bayes_risk/test_verdicts.py::test_what_a_default_run_finds_decides_all",
    ),
    "bayes_risk/test_breaks.py::test_a_break_moves_the_verdicts_that_it_names_and_no_other": (
        "bayes_risk/test_verdicts.py::test_the_papers_figures_flip_what_was_not_reproduced",
        "bayes_risk/test_verdicts.py::test_returns_that_are_not_averaged_err_more",
        "laws",
    ),
    "flir/test_breaks.py::test_a_break_moves_the_verdicts_that_it_names_and_no_other": (
        "flir/test_reproduction.py::test_a_broken_component_flips_what_is_reproduced",
        "laws",
    ),
    "reproduction/test_elsewhere.py::test_an_imm_beats_detection_with_a_base": (
        "bayes_risk/test_verdicts.py::test_what_a_default_run_finds_decides_all",
    ),
    "mutants/test_automatic.py::test_those_that_were_caught_are": (
        "testing/test_mutants.py::test_a_mutant_is_caught_by_the_law_named_for_it",
    ),
    "marine/test_breaks.py::test_a_break_moves_the_verdicts_that_it_names_and_no_other": (
        "marine/test_verdicts.py::test_an_associator_that_takes_no_return_flips_what_was_reproduced",
        "marine/test_verdicts.py::test_a_turn_to_the_other_side_flips_the_gain",
        "laws",
    ),
    "target_oriented/test_breaks.py::test_a_break_moves_the_verdicts_that_it_names_and_no_other": (
        "target_oriented/test_verdicts.py::test_a_model_that_does_not_turn_loses_more_and_gains_nothing",
        "laws",
    ),
    "vts/test_matched_truth.py::test_in_another_scene_the_imm_is_better_than_single_filters_too": (
        "vts/test_reproduction.py::test_the_imm_keeps_its_gate_and_is_calmer_than_any_single_filter_that_does",
    ),
    "tools/tuning/test_by_place.py::test_errors_hold_what_they_promise": (
        "tools/tuning/test_by_place.py::test_a_hidden_sector_and_a_far_ring_are_found",
        "tools/tuning/test_by_place.py::test_existence_as_it_was_known_then_finds_too_high_a_probability",
    ),
    "standard/unresolved/test_events.py::test_two_boats_that_merge_half_of_the_time": (
        "standard/unresolved/test_events.py::test_weights_are_sums_over_all_events",
        "standard/unresolved/test_events.py::test_a_return_for_both_updates_each_as_the_joint_gaussian_does",
    ),
    "standard/unresolved/test_hypotheses.py::test_two_boats_that_merge_half_of_the_time": (
        "standard/unresolved/test_hypotheses.py::test_one_scan_is_the_sum_over_all_events",
        "standard/unresolved/test_hypotheses.py::test_a_second_scan_weighs_the_histories_by_all_their_events",
    ),
    "tracking/test_registration.py::test_two_radars_one_of_them_misplaced": (
        "tracking/test_registration.py::test_rows_and_offsets_are_the_joint_posterior",
        "tracking/test_registration.py::test_a_bearing_offset_is_found_from_ais_of_half_of_the_vessels",
    ),
    "tools/commands/test_check_time.py::test_a_check_is_short_and_finds_nothing": ("laws",),
    "tools/drafting/test_height_and_rate.py::test_a_draft_tracks_as_well_as_a_hand": (
        "tools/drafting/test_height_and_rate.py::test_a_rate_that_falls_where_ranges_grow_is_left_out",
        "tools/commands/test_new.py::test_from_an_empty_folder_to_tracks_on_a_map_in_two_commands",
    ),
    "tools/drafting/test_moving_doppler.py::BY_NIGHT": (
        "tools/drafting/test_moving_doppler.py::test_a_moving_doppler_radar_is_drafted_as_by_a_hand",
        "tools/drafting/test_moving_doppler.py::test_a_platform_that_stands_needs_no_velocity",
        "tools/drafting/test_height_and_rate.py::test_a_rate_on_a_moving_platform_is_left_out",
    ),
    "tools/commands/test_new.py::test_over_many_draws_the_error_is_within_a_twentieth": (
        "tools/commands/test_new.py::test_from_an_empty_folder_to_tracks_on_a_map_in_two_commands",
    ),
    "tools/commands/test_new.py::test_two_sensors_get_a_table_each": (
        "tools/commands/test_new.py::test_from_an_empty_folder_to_tracks_on_a_map_in_two_commands",
    ),
    "tools/commands/test_new_roles.py::test_a_package_of_all_roles_keeps_its_laws_and_becomes_a_wheel": (
        "tools/commands/test_new.py::test_a_new_plugin_keeps_its_laws",
    ),
    "live/test_fuzz.py::test_a_service_takes_or_refuses_whatever_comes": ("live/test_formats.py",),
    "tools/smoothing/test_smooth_on_dask.py::test_a_worker_that_is_killed_loses_nothing": (
        "tools/smoothing/test_smooth_command.py::test_an_object_across_files_is_smoothed_whole_and_parts_change_nothing",
        "study/test_cluster.py::test_a_worker_that_dies_changes_nothing",
    ),
    "live/test_store.py::test_a_service_that_is_killed_takes_each_line_of_a_file_once": (
        "live/test_store.py::test_a_file_is_read_on_after_a_restart",
    ),
    "live/test_store.py::test_a_service_that_is_killed_goes_on_with_a_sender_that_repeats": (
        "live/test_store.py::test_a_service_that_is_restarted_goes_on_to_the_last_bit",
    ),
    "live/test_brokers.py::test_scans_come_and_tracks_go_through_a_broker": (
        "live/test_brokers.py::test_a_third_partys_kafka_input_reads_a_topic",
    ),
    "report/test_interrupting.py::test_whenever_many_runs_are_interrupted": (
        "report/test_interrupting.py::test_the_files_of_an_interrupted_run_hold_the_same_scans",
    ),
    "report/test_resuming.py::test_killed_at_any_moment_it_comes_to_the_same_end": (
        "report/test_resuming.py::test_what_comes_out_is_what_an_undisturbed_run_leaves",
    ),
    "tracking/test_horizons.py::test_horizons_on_the_crossing": ("tracking/test_retelling.py",),
    "tracking/test_horizons.py::test_the_crossing_errs_as_it_did_when_its_page_was_measured": (
        "tracking/test_clusters_of_hypotheses.py",
        "standard/associators/test_hypotheses.py",
    ),
    "report/test_door_out.py::test_killed_at_any_moment_nothing_is_damaged": (
        "report/test_door_out.py::test_a_killed_run_leaves_former_results_and_is_shown",
    ),
    "study/commands/test_reproduce.py::BY_NIGHT": (
        "study/commands/test_reproduce.py::test_a_study_prints_its_tables_and_verdicts_and_ends_well",
        "bayes_risk/test_reproduction.py::test_the_same_seed_gives_the_same_study",
        "flir/test_reproduction.py::test_the_seed_decides",
        "marine/test_reproduction.py::test_the_study_says_all_and_its_seed_decides",
        "target_oriented/test_reproduction.py::test_the_same_seed_gives_the_same_study",
    ),
    "docs/test_notebooks.py::SLOW": (
        "docs/test_notebooks.py::test_it_is_a_valid_notebook_that_holds_the_whole_page",
        "docs/test_blocks.py::test_its_blocks_do_what_it_says",
    ),
    "tools/explaining/test_planted.py::by_night": (
        "tools/explaining/test_planted.py::test_a_planted_disproportion_is_found",
    ),
    "flir/test_clips.py::test_recorded_segments": (
        "flir/test_template.py::test_a_drifting_template_is_held_by_its_centroid",
        "flir/test_template.py::test_a_few_faint_frames_are_not_worth_another_target",
    ),
    "flir/test_found_anywhere.py::LARGE": ("flir/test_found_anywhere.py::test_frames_of_any_size",),
    "flir/test_doubt.py::test_recorded_clips_run_whole": (
        "flir/test_doubt.py::test_a_run_says_when_its_target_was_lost_and_found_again",
    ),
    "flir/test_sizes.py::test_labels_of_recorded_clips_lie_within_the_stated_doubt": (
        "flir/test_sizes.py::test_the_box_follows_a_target_that_grows_and_states_its_doubt",
    ),
    "marine/test_cfar.py::test_boats_are_tracked_from_simulated_sweeps": (
        "marine/test_cfar.py::test_each_test_is_its_definition",
        "marine/test_cfar.py::test_a_target_lies_where_it_is",
    ),
    "marine/test_simulated_pictures.py::test_boats_are_kept_in_a_rough_sea": (
        "marine/test_simulated_pictures.py::test_boats_are_tracked_from_simulated_pictures",
    ),
    "marine/test_simulated_pictures.py::test_evidence_of_the_picture_keeps_spikes_from_becoming_tracks": (
        "marine/test_chain.py::test_evidence_is_the_log_likelihood_ratio_of_brightness_and_size",
    ),
    "marine/test_simulated_pictures.py::test_the_study_from_pictures_says_all_and_a_run_is_the_same_among_others": (
        "marine/test_simulated_pictures.py::test_boats_are_tracked_from_simulated_pictures",
        "marine/test_reproduction.py::test_the_study_says_all_and_its_seed_decides",
    ),
    "marine/test_simulated_pictures.py::test_the_large_ship_is_tracked_from_simulated_pictures": (
        "marine/test_scene_mutants.py::test_a_mutant_is_caught",
        "marine/test_simulated_pictures.py::test_boats_are_tracked_from_simulated_pictures",
    ),
    "standard/test_filterpy.py::test_the_stored_answers_are_filterpys": ("standard/test_filterpy.py",),
    "standard/estimators/test_extremes.py::test_every_estimator_stays_whole_in_many_cases": (
        "standard/estimators/test_extremes.py::test_every_estimator_stays_whole_with_every_motion",
    ),
    "study/test_judgement.py::test_our_trackers_are_no_worse_on_recordings": (
        "study/test_judgement.py::test_our_trackers_are_no_worse_than_they_were",
        "study/test_judgement.py::test_a_study_that_averages_over_recordings_is_judged_by_its_averages",
    ),
    "test_examples.py::test_autoferry_over_ten_draws": (
        "test_examples.py::test_autoferry",
        "test_examples.py::test_a_radars_delay_is_found_without_truth",
        "tracking/test_retroactive.py",
        "mutants/test_cures.py",
    ),
    "test_examples.py::test_joyrides_bias_pays_over_ten_draws": (
        "test_examples.py::test_joyride_automatic",
        "mutants/test_cures.py",
    ),
    "testing/test_false_alarms.py::test_right_components_keep_every_law": (
        "testing/test_false_alarms.py::test_right_components_keep_the_laws_that_they_once_failed",
        "testing/test_right_unusual.py::test_right_components_of_other_shapes_keep_the_laws",
    ),
    "testing/test_plugin_template.py::test_it_keeps_the_laws": (".ci/run",),
    "testing/test_power.py::test_errors_that_are_not_white_are_named_and_white_ones_are_not": (
        "testing/test_whole_trackers.py::test_errors_that_are_not_white_are_named",
    ),
    "testing/test_power.py::test_right_trackers_give_no_alarm_by_default_and_exact_ones_as_many_as_stated": (
        "testing/test_assert_consistent.py::test_a_right_tracker_passes_and_says_how_it_was_judged",
    ),
    "testing/test_power.py::test_p_values_of_right_problems_are_uniform_and_alarms_as_rare_as_stated": (
        "testing/test_assert_consistent.py::test_a_right_tracker_passes_and_says_how_it_was_judged",
        "testing/test_power.py::test_detection_is_what_theory_says",
    ),
    "report/test_error_in_time.py::test_white_errors_are_seldom_called_correlated_and_correlated_ones_always": (
        "report/test_error_in_time.py::test_a_correlated_error_is_found_with_its_size_and_time",
        "report/test_error_in_time.py::test_white_errors_of_targets_that_turn_are_not_called_correlated",
    ),
    "tools/drafting/test_several.py::BY_NIGHT": (
        "tools/drafting/test_several.py::test_each_ship_has_one_track_of_both_sensors",
        "tools/drafting/test_several.py::test_rows_without_a_column_of_sensors_are_of_the_one_whose_columns_they_fill",
        "tools/drafting/test_several.py::test_x_is_east_or_north_as_it_meets_the_radar",
    ),
    "tools/drafting/test_sights.py::test_a_sensor_of_short_range_loses_no_target_of_the_others": (
        "tools/drafting/test_sights.py::test_others_tell_where_a_sensor_sees_nothing",
        "tools/drafting/test_several.py::test_each_ship_has_one_track_of_both_sensors",
    ),
    "tools/drafting/test_correlated.py::test_over_a_grid_of_correlations_and_deviations": (
        "tools/drafting/test_correlated.py::test_a_draft_writes_correlated_errors_and_tracks_by_them",
        "tools/drafting/test_correlated.py::test_white_errors_are_drafted_white",
    ),
    "tools/test_advice.py::test_over_drawings_no_advice_costs": (
        "tools/test_advice.py::test_advice_as_it_is_printed_costs_nothing_that_is_held_back",
        "tools/test_advice.py::test_the_opposite_of_what_is_advised_costs",
    ),
    "tools/test_advice.py::test_what_tune_writes_costs_nothing_that_is_held_back": (
        "tools/tuning/test_validation.py::test_better_ones_are_taken",
        "tools/tuning/test_validation.py::test_values_worse_on_the_scans_held_back_are_advised_against_and_pulled_back",
    ),
    "tools/tuning/test_births.py::test_errors_hold_what_they_promise": (
        "tools/tuning/test_births.py::test_a_probability_of_detection_is_that_of_the_data",
        "tools/tuning/test_births.py::test_targets_that_leave_the_clutter_do_not_thin_it",
    ),
    "tools/tuning/test_calibration.py::test_an_imms_transition_is_found_within_its_error": ("tools/tuning/test_mutants.py",),
    "tools/tuning/test_calibration.py::test_errors_hold_what_they_promise": ("tools/tuning/test_mutants.py",),
    "tools/tuning/test_tune.py::test_workers_change_nothing": ("tools/tuning/test_tune.py",),
}


def marked() -> set[str]:
    """Return what the sources mark: a test, or the name that holds the mark of some of a test's cases."""
    found = set()
    for path in sorted(TESTS.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        if "pytest.mark.nightly(" not in text or path == Path(__file__):
            continue
        for node in ast.parse(text).body:
            if "pytest.mark.nightly" in ast.unparse(node):
                name = getattr(node, "name", None) or next(x.id for x in ast.walk(node) if isinstance(x, ast.Name))
                found.add(f"{path.relative_to(TESTS).as_posix()}::{name}")
    return found


def test_the_table_has_what_is_marked_and_names_tests_of_the_day() -> None:
    assert marked() == set(BY_DAY)
    for named in BY_DAY.values():
        for other in named:
            path, _, name = other.partition("::")
            if other == "laws":
                continue
            file = ROOT / path if path.startswith(".ci") else TESTS / path
            assert not name or f"\ndef {name}(" in file.read_text(encoding="utf-8"), other
            assert file.exists()
            assert other not in BY_DAY


def test_no_test_of_mutants_is_left_to_the_night() -> None:
    """But the automatic ones, which no author thought of: those of our own are tried by day, at least one a law."""
    assert not [name for name in BY_DAY if "mutant" in name.removeprefix("mutants/test_automatic.py")]


Fault = tuple[Any, str, Any, Callable[[], None]]


FAULTS: dict[str, Fault] = {
    "recorded segments: a drift counted the other way": (
        template, "centroid", lambda image: -template_centroid(image),
        test_template.test_a_drifting_template_is_held_by_its_centroid,
    ),
    "recorded segments: any match is as good": (
        template, "match_ratio", lambda *given: 60.0, test_template.test_a_target_that_fades_is_missed_and_found_again,
    ),
    "labels of clips: a size that stays": (
        growth, "grown", lambda size, *given: size,
        test_sizes.test_the_box_follows_a_target_that_grows_and_states_its_doubt,
    ),
    "returns that compete: the spread of the means is kept": (
        ParallelKalmanPrinted, "update", Kalman.update,
        weights.test_the_printed_covariance_is_the_mixtures_less_the_spread_of_the_means,
    ),
    "sweeps: a factor too large by a tenth": (
        rates, "factor", lambda *given: 1.1 * cfar_factor(*given), rates.test_each_test_is_its_definition,
    ),
    "evidence: brightness counts for nothing": (
        Evidence, "of", lambda self, groups, *given: np.zeros(len(groups.at)),
        chain.test_evidence_is_the_log_likelihood_ratio_of_brightness_and_size,
    ),
    "p-values: squares too large by a tenth": (
        verdicts, "chi_square_verdict", lambda name, squares, *given: chi_square_verdict(name, 1.1 * squares, *given),
        lambda: consistent.test_a_right_tracker_passes_and_says_how_it_was_judged(consistent.LINEAR, ""),
    ),
}  # fmt: skip
template_centroid, cfar_factor = template.centroid, rates.factor


def test_what_a_fault_replaces_is_there() -> None:
    """All of them, as one is put in by day."""
    assert not [name for name, (where, attribute, *_) in (FAULTS | CURES | MUTANTS).items() if not hasattr(where, attribute)]


@pytest.mark.parametrize("name", FAULTS)
@pytest.mark.by_turns
def test_by_day_a_fault_is_caught(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    where, attribute, wrong, check = FAULTS[name]
    monkeypatch.setattr(where, attribute, wrong)
    with pytest.raises(AssertionError):
        check()
