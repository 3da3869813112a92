"""Tracks of a finished run for other programs: maps, tables, viewers."""
