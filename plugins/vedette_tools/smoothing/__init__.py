"""Positions that bear the names of their objects, cleaned and smoothed, many objects at a time."""
