"""The figures of runs as tables, side by side: of each what it is, its unit, and its value in each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

MEANINGS = {
    "scans": ("scans that were judged", ""),
    "tracks": ("tracks that were ever confirmed", ""),
    "begun": ("tracks begun", ""),
    "position_rmse_m": ("position error, RMS while covered", "m"),
    "position_deviation_m": ("position error that the covariances expect", "m"),
    "velocity_rmse_mps": ("velocity error, RMS while covered", "m/s"),
    "bias_m": ("mean error", "m"),
    "coverage": ("part of the scans in which an object is covered", ""),
    "confirmed_after_s": ("wait until an object is first covered", "s"),
    "id_switches": ("identity switches", ""),
    "false_tracks": ("confirmed tracks that cover nothing, at a time", ""),
    "lost": ("part of the objects that are lost", ""),
    "nees_position": ("NEES of the position over what is expected", ""),
    "nees_state": ("NEES of the state over what is expected", ""),
    "nis": ("NIS over what is expected", ""),
    "mode_prob": ("mean mode probability", ""),
    "gospa_m": ("GOSPA, without tracks far from all objects", "m"),
    "gospa_localisation": ("GOSPA's part from errors", "m^p"),
    "gospa_missed": ("GOSPA's part from objects without a track", "m^p"),
    "gospa_false": ("GOSPA's part from tracks without an object", "m^p"),
    "gospa_all_m": ("GOSPA of all confirmed tracks", "m"),
    "ospa_m": ("OSPA", "m"),
    "trajectory_gospa_m": ("trajectory GOSPA a scan", "m"),
    "trajectory_gospa_localisation": ("its part from errors", "m^p"),
    "trajectory_gospa_missed": ("its part from objects without a track", "m^p"),
    "trajectory_gospa_false": ("its part from tracks without an object", "m^p"),
    "trajectory_gospa_switches": ("its part from identity switches", "m^p"),
    "ospa2_m": ("OSPA(2) of whole tracks", "m"),
    "mota": ("MOTA", ""),
    "motp_m": ("MOTP, mean distance of covered objects", "m"),
    "hota": ("HOTA", ""),
    "hota_detection": ("HOTA's part of detection", ""),
    "hota_association": ("HOTA's part of association", ""),
    "hota_localisation": ("HOTA's part of localisation", ""),
    "siap_completeness": ("SIAP completeness", ""),
    "siap_ambiguity": ("SIAP ambiguity", ""),
    "siap_spuriousness": ("SIAP spuriousness", ""),
    "siap_position_m": ("SIAP position error", "m"),
    "siap_velocity_mps": ("SIAP velocity error", "m/s"),
    "siap_changes_per_s": ("SIAP identity switches", "1/s"),
    "siap_longest": ("SIAP longest track, part of a life", ""),
    "position_bound_m": ("Cramer-Rao bound of the position error", "m"),
}
"""What the figures of `summary.json` are, and their units; docs/metrics.md defines them."""

_OF_OBJECTS = {
    "coverage": ("coverage", ""),
    "position_rmse_m": ("position error", "m"),
    "velocity_rmse_mps": ("velocity error", "m/s"),
    "id_switches": ("identity switches", ""),
    "confirmed_after_s": ("first covered", "s"),
}
_LEFT_OUT = ("seed", "scans_taken", "returns", "refused")
"""Numbers of a summary that are no figures of its tracks."""


def metrics(figures: Sequence[Mapping[str, Any]], modes: Sequence[str], axes: Sequence[str], unit: str) -> dict[str, Any]:
    """Return `rows` of the figures, and `objects` of each true object, one value a run in each.

    Of several runs it returns the figures that two of them have.
    `modes` names the modes, `axes` those of the map, `unit` is that of positions.
    """
    names = [*MEANINGS, *(name for each in figures for name in each if name not in MEANINGS and name not in _LEFT_OUT)]
    least = min(2, len(figures))
    rows = [row for name in dict.fromkeys(names) for row in _rows(name, figures, modes, axes, unit) if _known(row) >= least]
    found = [{each["name"]: each for each in run.get("truths") or ()} for run in figures]
    told = []
    for true in dict.fromkeys(name for run in found for name in run if sum(name in each for each in found) >= least):
        cells = {name: [_number(run.get(true, {}).get(name)) for run in found] for name in _OF_OBJECTS}
        told.append({"name": true, **cells})
    heads = {name: [words, _unit(of, unit)] for name, (words, of) in _OF_OBJECTS.items()}
    return {"rows": rows, "objects": told, "of_objects": heads}


def _rows(
    name: str, figures: Sequence[Mapping[str, Any]], modes: Sequence[str], axes: Sequence[str], unit: str
) -> list[dict[str, Any]]:
    values = [run.get(name) for run in figures]
    about, of = MEANINGS.get(name, (name.replace("_", " "), ""))
    if any(isinstance(value, list) and all(_number(part) is not None for part in value) and value for value in values):
        longest = max(len(value) for value in values if isinstance(value, list))
        parts = {"mode_prob": modes, "bias_m": axes}.get(name, ())
        told = [parts[i] if i < len(parts) else str(i + 1) for i in range(longest)]
        columns = [[_part(value, i) for value in values] for i in range(longest)]
        return [
            {"name": f"{name}.{i}", "about": f"{about}, {told[i]}", "unit": _unit(of, unit), "values": column}
            for i, column in enumerate(columns)
        ]
    numbers = [_number(value) for value in values]
    if all(value is None for value in numbers):
        return []
    return [{"name": name, "about": about, "unit": _unit(of, unit), "values": numbers}]


def _known(row: dict[str, Any]) -> int:
    return sum(value is not None for value in row["values"])


def _unit(of: str, unit: str) -> str:
    """Return a unit of length in px where positions are."""
    return of.replace("m", unit, 1) if of.startswith("m") else of


def _part(value: Any, i: int) -> float | None:
    return _number(value[i]) if isinstance(value, list) and i < len(value) else None


def _number(value: Any) -> float | None:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None
