"""The options of `vedette tune`, apart from what it does: help and other commands need nothing of that."""

from __future__ import annotations

from argparse import ArgumentParser

ABOUT = (
    "Find the parameters of greatest likelihood given a recording's returns, without truth, on the first part of the scans; "
    "test them on the rest; state the error of each, and whether Q or R was wrong. Writes a config that runs. After Ctrl-C, "
    "--resume continues."
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
        help="parameters to tune, and ranges, as in estimator.motion.sigma_accel=0.01..10; default: a tenth to ten times",
    )
    tune.add_argument(
        "--part", default="0.5", metavar="P", help="fraction of the scans to tune on, from the first on; default: 0.5"
    )
    tune.add_argument(
        "--by", default="likelihood", choices=["likelihood", "consistency"], help="the criterion; default: likelihood"
    )
    tune.add_argument(
        "--starts", default="3", metavar="N", help="number of searches; the first starts at the config's values; default: 3"
    )
    tune.add_argument("--method", default=METHODS[0], choices=METHODS, help="search method; default: nelder-mead")
    tune.add_argument("--workers", default="1", metavar="N", help="number of processes; it changes no result; default: 1")
    tune.add_argument("--seed", metavar="N", help="seed of all random numbers; the same as --set seed=N")
    tune.add_argument("--out", metavar="DIR", help="folder for config, results and picture; default: out/NAME-tuned")
    tune.add_argument("--resume", action="store_true", help="continue the unfinished tuning in the folder --out")
    tune.add_argument("--json", action="store_true", help="end standard output with one line of JSON: the results")
