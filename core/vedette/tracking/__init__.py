"""The loop from scans to tracks: what enters, what is gated, how states follow each other, what is kept of them."""

from vedette.tracking.permanent import GivenTracks, PermanentTracks
from vedette.tracking.preprocessing import preprocessed, raw_sensors
from vedette.tracking.trees import join, take

__all__ = ["GivenTracks", "PermanentTracks", "join", "preprocessed", "raw_sensors", "take"]
