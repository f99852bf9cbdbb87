"""``mirrortwin bench``: the speed of the twin."""

import argparse

from app.cli.output import note, print_json, progress, stdout

DESCRIPTION = """\
Measure the speed of the twin, as medians over the rounds:

  trajectory_ratio        a 300 s flight with autopilot, fault and 23 channels, in bare JSBSim loops
                          of the same aircraft and steps in the same process
  pair_ratio              that flight and its mirror, likewise
  long_flight_cost_ratio  a simulated second of a 2 h pair against one of a 300 s pair
  two_worker_speedup      64 faulted flights on two worker processes against one

The last two are measured in the first three rounds only. Takes about a minute on a quiet machine;
`mirrortwin experiment speed` also draws it.
"""
EXAMPLES = """\
examples:
  mirrortwin bench --quick
  mirrortwin bench --rounds 15 --json
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--rounds", type=int, default=10, metavar="N", help="how often to measure (default 10)"
    )
    parser.add_argument(
        "--quick", action="store_true", help="a quarter of an hour for 2 h, 8 flights for 64"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> None:
    """Print the measured speed; raises `InputError` for a bad number of rounds."""
    from core.experiments.bench import FULL, QUICK, measure
    from core.experiments.speed import BUSY

    with progress("measuring") as show:
        speed = measure(args.rounds, QUICK if args.quick else FULL, show)
    if speed.busy:
        note(BUSY)
    if args.json:
        print_json(speed.to_dict())
        return
    from rich.table import Table

    table = Table("work", "CPU time", "ratio", box=None)
    for work, seconds, ratio in (
        ("bare JSBSim loop, 300 s", speed.bare_s, 1.0),
        ("one trajectory", speed.trajectory_s, speed.trajectory_ratio),
        ("faulted and mirror", speed.pair_s, speed.pair_ratio),
        ("long pair, a second of it", speed.long_pair_s, speed.long_flight_cost_ratio),
    ):
        table.add_row(work, f"{seconds * 1e3:.0f} ms", f"{ratio:.2f}")
    table.add_row("two workers over one", "", f"{speed.two_worker_speedup:.2f}")
    stdout().print(table)
