"""Recorded streams as sources of runs."""
