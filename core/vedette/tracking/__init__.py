"""The loop from scans to tracks: validation, gating, states, and the tracks' histories."""

from vedette.tracking.expected import Expected
from vedette.tracking.permanent import GivenTracks, PermanentTracks
from vedette.tracking.preprocessing import preprocessed, raw_sensors
from vedette.tracking.trees import Common, join, take

__all__ = ["Common", "Expected", "GivenTracks", "PermanentTracks", "join", "preprocessed", "raw_sensors", "take"]
