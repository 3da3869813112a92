"""What a command is made of: exit codes, and options that several commands share. The core's own commands are beside it."""

from vedette.commands import options
from vedette.commands.exit_codes import DONE, FAILED, INTERRUPTED, UNFIT, WRONG

__all__ = ["DONE", "FAILED", "INTERRUPTED", "UNFIT", "WRONG", "options"]
