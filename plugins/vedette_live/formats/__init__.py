"""How messages stand in bytes: decoders of what sensors send, encoders of tracks."""
