"""The loop from scans to tracks: validation, gating, states, and the tracks' histories."""

from vedette.tracking.permanent import GivenTracks, PermanentTracks
from vedette.tracking.preprocessing import preprocessed, raw_sensors
from vedette.tracking.trees import Common, join, take

__all__ = ["Common", "GivenTracks", "PermanentTracks", "join", "preprocessed", "raw_sensors", "take"]
