"""`python -m docsite build` builds the site; `python -m docsite blocks [PAGE ...]` runs code blocks and says how."""

import argparse
import sys
from pathlib import Path

from docsite.pages import ROOT, pages
from docsite.runner import faults, run


def told(chosen: list[Path], pace: str) -> int:
    """Print a line for each block; return 1 if one does not do what its page says."""
    wrong = 0
    for page, ran in run(chosen, pace=pace).items():
        for one in ran:
            name = page.resolve().relative_to(ROOT)
            print(
                f"{'FAULT' if one.fault else one.state:13} {one.took:6.2f} s  {name}:{one.block.line} {one.block.language}"
            )
        for fault in faults(page, ran):
            wrong = 1
            print(fault)
    return wrong


def main() -> int:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m docsite", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    blocks = commands.add_parser("blocks", help="run the code blocks of pages")
    blocks.add_argument("pages", nargs="*", type=Path, help="default: all")
    building = commands.add_parser("build", help="build the site, into .site/html")
    for command in (blocks, building):
        about = "without the blocks that are marked slow or nightly"
        command.add_argument("--fast", action="store_const", dest="pace", const="fast", default="nightly", help=about)
    arguments = parser.parse_args()
    if arguments.command == "build":
        from docsite.site import build

        return build(arguments.pace)
    return told([page.resolve() for page in arguments.pages] or pages(), arguments.pace)


if __name__ == "__main__":
    sys.exit(main())
