"""Tracks, written and read."""
