"""The scene and the third party that tests of commands share."""

from support.command_line import acme, config, undrawn

__all__ = ["acme", "config", "undrawn"]
