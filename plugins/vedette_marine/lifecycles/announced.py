"""Tracks of announced targets, kept to the end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, final

from attrs import frozen

from vedette.tracking import PermanentTracks


@final
@frozen
class AnnouncedTracks(PermanentTracks):
    """Confirms every track at once and ends none; goes with the birth `announced`."""

    kind: ClassVar[str] = "announced"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "announced"}
