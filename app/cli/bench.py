"""``mirrortwin bench``: the speed of the twin, and of the server with many pages."""

import argparse
from pathlib import Path

from app.cli.output import note, print_json, progress, stdout, writable_folder
from core.errors import InputError

DESCRIPTION = """\
Measure the speed of the twin, as medians over the rounds:

  trajectory_ratio        a 300 s flight with autopilot, fault and sensors, in bare JSBSim loops
                          of the same aircraft and steps in the same process
  pair_ratio              that flight and its mirror, likewise
  long_flight_cost_ratio  a simulated second of a 2 h pair against one of a 300 s pair
  two_worker_speedup      64 faulted flights on two worker processes against one

The last two are measured in the first three rounds only. Takes about a minute on a quiet machine;
`mirrortwin experiment speed` also draws it.

With --clients, measure the server instead: N pages at once, each with a live flight of its own at
ten times real time, in three rounds; then the same with one page that reads nothing; then 50 runs
on one page. Measured are the delay of samples (from the flight to the page), the memory of the
server, and whether a page received anything of another's run. Takes some minutes.
"""
EXAMPLES = """\
examples:
  mirrortwin bench --quick
  mirrortwin bench --rounds 15 --json
  mirrortwin bench --clients 50 --json
  mirrortwin bench --clients 50 --out models/results     keeps them as crowd.json
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--rounds", type=int, metavar="N",
        help="how often to measure (default 10, with --clients 3)",
    )  # fmt: skip
    parser.add_argument(
        "--quick", action="store_true",
        help="a quarter of an hour instead of 2 h, 8 flights instead of 64; with --clients, 60 s "
        "instead of 300 s",
    )  # fmt: skip
    parser.add_argument(
        "--clients", type=int, metavar="N", help="measure the server with N pages at once"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="with --clients: also write crowd.json there"
    )
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")


def run(args: argparse.Namespace) -> None:
    """Print what was measured; raises `InputError` for a bad number of rounds or clients."""
    if args.clients is not None:
        _crowd(args)
    elif args.out is not None:
        raise InputError(
            "out", "needs --clients; `mirrortwin experiment speed` stores the other results"
        )
    else:
        _speed(args)


def _speed(args: argparse.Namespace) -> None:
    from core.experiments.cost.bench import FULL, QUICK, measure
    from core.experiments.cost.speed import BUSY

    with progress("measuring") as show:
        speed = measure(
            10 if args.rounds is None else args.rounds, QUICK if args.quick else FULL, show
        )
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


def _crowd(args: argparse.Namespace) -> None:
    from app.crowd.measure import FULL, QUICK, measure
    from app.crowd.report import BUSY, lines, result
    from core.checks import checked_number
    from core.experiments.results import write_result

    clients = int(checked_number("clients", args.clients, 2, 100))
    rounds = int(checked_number("rounds", 3 if args.rounds is None else args.rounds, 1, 100))
    out = writable_folder(args.out) if args.out else None
    with progress("measuring") as show:
        crowd = measure(clients, QUICK if args.quick else FULL, rounds, progress=show)
    if crowd.busy:
        note(BUSY)
    measured = result(crowd)
    content = write_result(measured, out) if out else measured.to_dict()
    if args.json:
        print_json(content)
        return
    for line in lines(crowd):
        print(line)
