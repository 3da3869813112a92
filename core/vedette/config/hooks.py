"""The hooks through which every component is registered, Vedette's own included.

A plugin is a module, named by an entry point in the group `vedette`, that states the version of the contract it was written
for and implements the first hook, and optionally the others::

    import vedette

    VEDETTE_CONTRACT = 2

    @vedette.plugin
    def vedette_components():
        return [MyMotionModel]
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import pluggy

from vedette.roles import Component, Sensor
from vedette.types import Recording

if TYPE_CHECKING:
    from argparse import Namespace
    from pathlib import Path

    from vedette.experiment import Experiment, Result
    from vedette.metrics import Figure
    from vedette.tracking.intake import Intake

plugin = pluggy.HookimplMarker("vedette")
specification = pluggy.HookspecMarker("vedette")


@specification
def vedette_components() -> Iterable[type[Component]]:  # type: ignore[empty-body]  # pluggy reads the signature only
    """Return the component classes of this plugin."""


@specification
def vedette_files(folder: Path, experiment: Experiment, result: Result) -> Iterable[str]:  # type: ignore[empty-body]
    """Write further files of a run into `folder`; return their names, none if there is nothing to write."""


@specification
def vedette_files_of_stream(folder: Path, experiment: Experiment, result: Result) -> Iterable[str]:  # type: ignore[empty-body]
    """Do so for a run that was written as it went: `result` has no tracks and no scans, tracks.csv in `folder` has them."""


@specification
def vedette_warnings(intake: Intake, recording: Recording, sensors: Mapping[str, Sensor]) -> Iterable[str]:  # type: ignore[empty-body]
    """Return a sentence for each thing that looks wrong with the input of a run, none if all looks right."""


@specification
def vedette_page(folder: Path, arguments: Namespace) -> Path | None:
    """Write the page that `vedette report` was asked for, if this plugin wrote the `folder`, and return it; else None."""


@specification
def vedette_figures() -> Iterable[Figure]:  # type: ignore[empty-body]
    """Return figures that this plugin judges runs by: name, unit, sentence, how they sum over runs, and what computes them.

    They stand in `summary.json`, the summary, the page of a run, and, if they have a name for studies, in these.
    """


@specification
def vedette_draft(path: Path, wishes: Mapping[str, Any]) -> str | None:
    """Return a config, as TOML, that tracks the targets of a file or folder that this plugin reads; None for any other.

    `wishes` is what the user said beside it: options of `vedette new config` by their names, as they were given.
    """
