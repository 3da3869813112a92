"""The pictures of a run and of reports on consistency, as components: what draws them is imported when they are drawn."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar, final

from attrs import frozen

from vedette import Picture, Result

if TYPE_CHECKING:
    from vedette_report.recorded import Recorded
    from vedette_report.whole_trackers.judging import Report


@final
@frozen
class Map(Picture):
    """Map of a run: tracks, truth and returns, with ellipses."""

    kind: ClassVar[str] = "picture"

    def draw(self, subject: Result) -> Any:
        from vedette_report.drawing.picture import picture

        if len(subject.made_by.tracker.state) < 2:
            return None
        return picture(subject.made_by, subject)


@final
@frozen
class Errors(Picture):
    """Errors of a run over time beside what its covariances say, and its modes."""

    kind: ClassVar[str] = "errors"

    def draw(self, subject: Result) -> Any:
        from vedette_report.drawing.errors import errors

        return errors(subject.made_by, subject, subject.judged)


@final
@frozen
class Strip(Picture):
    """Frames of a video in a row, with the tracks in them."""

    kind: ClassVar[str] = "strip"

    def draw(self, subject: Result) -> Any:
        from vedette_report.drawing.strip import strip

        if not len(subject.framed) or not {"x", "y"} <= set(subject.made_by.tracker.state.names):
            return None
        return strip(subject.made_by, subject)


@final
@frozen
class Simulated(Picture):
    """NEES, NIS and calibration over time of a tracker on truth that was drawn."""

    kind: ClassVar[str] = "consistency"
    of: ClassVar[str] = "consistency"

    def draw(self, subject: Report) -> Any:
        from vedette_report.drawing.consistency import drawn

        return drawn(subject)


@final
@frozen
class OfRecording(Picture):
    """NEES, NIS and the correlation of innovations over time, of the tracks of a recording."""

    kind: ClassVar[str] = "consistency_recorded"
    of: ClassVar[str] = "consistency of a recording"

    def draw(self, subject: tuple[str, Sequence[Recorded]]) -> Any:
        from vedette_report.recorded.picture import drawn

        return drawn(*subject)
