"""A run seen while it goes: its page by a server on this machine alone, or a view in the terminal."""
