"""The loop from scans to tracks: what enters, what is gated, how states follow each other, what is kept of them."""

from vedette.tracking.permanent import GivenTracks, PermanentTracks
from vedette.tracking.preprocessing import preprocessed, raw_sensors

__all__ = ["GivenTracks", "PermanentTracks", "preprocessed", "raw_sensors"]
