"""The options of `vedette tune`, apart from what it does: help and other commands need nothing of that."""

from __future__ import annotations

from argparse import ArgumentParser

ABOUT = (
    "Find the values of parameters under which a recording's detections are likeliest, without truth, on the first part of "
    "the scans; judge them on the rest; say how well each is known, and whether Q or R was at fault. Writes a config that "
    "runs. Ctrl-C keeps what is done: --resume goes on."
)
METHODS = ["nelder-mead", "powell", "l-bfgs-b"]


def add_options(tune: ArgumentParser) -> None:
    """Add all options but --set."""
    tune.add_argument("config", metavar="CONFIG", help="a TOML, YAML or JSON file that describes tracker and source")
    tune.add_argument(
        "--free",
        nargs="+",
        action="extend",
        default=[],
        metavar="PATH.TO.KEY=LOW..HIGH",
        help="what to tune and its range, as in estimator.motion.sigma_accel=0.01..10; default: a tenth to ten times",
    )
    tune.add_argument("--part", default="0.5", metavar="P", help="part of the scans to tune on, the first; default: 0.5")
    tune.add_argument(
        "--by", default="likelihood", choices=["likelihood", "consistency"], help="the criterion; default: likelihood"
    )
    tune.add_argument("--starts", default="3", metavar="N", help="searches, the first from the config's values; default: 3")
    tune.add_argument("--method", default=METHODS[0], choices=METHODS, help="of the searches; default: nelder-mead")
    tune.add_argument("--workers", default="1", metavar="N", help="processes; they change no result; default: 1")
    tune.add_argument("--seed", metavar="N", help="of everything random; the same as --set seed=N")
    tune.add_argument("--out", metavar="DIR", help="folder for config, figures and picture; default: out/NAME-tuned")
    tune.add_argument("--resume", action="store_true", help="go on with the unfinished tuning in the folder --out")
    tune.add_argument("--json", action="store_true", help="end standard output with one line of JSON: the figures")
