"""Vedette's own format for recordings: JSON lines."""
