"""Mutants that no author thought of: operators on the source of the plugins' components, drawn by a stated seed."""
