"""What a command is made of: exit codes, and options that several commands share. The core has one command, `info`."""

from vedette.commands import options
from vedette.commands.exit_codes import DONE, FAILED, INTERRUPTED, UNFIT, UNTRIED, WRONG, complain

__all__ = ["DONE", "FAILED", "INTERRUPTED", "UNFIT", "UNTRIED", "WRONG", "complain", "options"]
