"""``mirrortwin bench``: the speed of the twin."""

import argparse

from app.cli.output import print_json, progress, stdout

DESCRIPTION = """\
Measure how long the twin takes for a 300 s flight, as multiples of JSBSim's bare loop for the same
aircraft and steps in the same process: trajectory_ratio for one flight with autopilot, fault and
23 channels, pair_ratio for that flight and its mirror. Medians over the rounds.
"""
EXAMPLES = """\
examples:
  mirrortwin bench
  mirrortwin bench --rounds 15 --json
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--rounds", type=int, default=7, metavar="N", help="how often to measure (default 7)"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> None:
    """Print the measured speed; raises `InputError` for a bad number of rounds."""
    from core.experiments.bench import measure

    with progress("measuring") as show:
        speed = measure(args.rounds, show)
    if args.json:
        print_json(speed.to_dict())
        return
    from rich.table import Table

    table = Table("work", "time", "bare loops", box=None)
    table.add_row("bare JSBSim loop", f"{speed.bare_s * 1e3:.0f} ms", "1.00")
    for work, seconds, ratio in (
        ("one trajectory", speed.trajectory_s, speed.trajectory_ratio),
        ("faulted and mirror", speed.pair_s, speed.pair_ratio),
    ):
        table.add_row(work, f"{seconds * 1e3:.0f} ms", f"{ratio:.2f}")
    stdout().print(table)
