"""Tracks of announced targets, kept to the end."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette.tracking import PermanentTracks


@final
@frozen
class AnnouncedTracks(PermanentTracks):
    """Confirms every track at once and ends none; goes with the birth `announced`."""

    kind: ClassVar[str] = "announced"
