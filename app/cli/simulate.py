"""``mirrortwin simulate``: one flight and its healthy mirror, into a folder."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.options import add_fault_options, add_plan_options, requested_fault, requested_plan
from app.cli.output import note, print_json, progress, writable_folder

if TYPE_CHECKING:
    from core.fmea.fault import Fault
    from core.twin.plan import Plan
    from core.twin.trajectory import Pair

_BLOCK_S = 30.0

DESCRIPTION = """\
Fly one flight twice, with the fault and without it, and write what both aircraft logged:

  faulted.parquet, mirror.parquet   time, 23 channels and the flight states, 50 samples a second
  run.rrd                           the same for the Rerun viewer
  run.json                          the plan and the fault

The same options write the same Parquet bytes on every run.
"""
EXAMPLES = """\
examples:
  mirrortwin simulate --fault baffle_crack --severity 0.8 --onset 60 --seed 7 --out flight
  mirrortwin simulate --fault engine_failure --altitude 5000 --speed 100 --heading 90 --out flight
  mirrortwin simulate --plan plan.toml --fault oil_cooler_maintenance --out flight

a plan file holds any of these lines, the rest keeps its default:
  altitude_ft = 5200
  speed_kt = 95
  duration_s = 600
  seed = 7
  [weather]
  wind_kt = 12
  wind_from_deg = 240
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_fault_options(parser)
    add_plan_options(parser)
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="the folder to write to"
    )
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")


def run(args: argparse.Namespace) -> None:
    """Fly the pair and write it; raises `InputError`, `FlightError` or `StoreError`."""
    plan = requested_plan(args)
    fault = requested_fault(args, plan)
    out = writable_folder(args.out)
    with progress("flying") as show:
        pair = _flown(plan, fault, show)
    files = _write(out, pair, plan, fault)
    if args.json:
        summary = {"plan": plan.to_dict(), "fault": fault.to_dict(), "samples": len(pair.mirror)}
        print_json(summary | {"files": [str(path) for path in files]})
        return
    for path in files:
        print(path)
    note(f"Now try: mirrortwin diagnose {out}")


def _flown(plan: "Plan", fault: "Fault", show: Callable[[float], None]) -> "Pair":
    from core.twin.flight import PairFlight
    from core.twin.trajectory import Pair, Trajectory

    flight = PairFlight(plan, fault)
    blocks: list[Pair] = []
    while (block := flight.advance(_BLOCK_S)) is not None:
        blocks.append(block)
        show(flight.progress)
    return Pair(
        Trajectory.joined([block.faulted for block in blocks]),
        Trajectory.joined([block.mirror for block in blocks]),
    )


def _write(out: Path, pair: "Pair", plan: "Plan", fault: "Fault") -> list[Path]:
    from importlib.metadata import version

    from app.scenes.recording import write_recording
    from core.jobs.store import write_trajectory

    faulted, mirror, recording, record = (
        out / name for name in ("faulted.parquet", "mirror.parquet", "run.rrd", "run.json")
    )
    write_trajectory(faulted, pair.faulted)
    write_trajectory(mirror, pair.mirror)
    write_recording(recording, pair, plan, fault)
    described = {"plan": plan.to_dict(), "fault": fault.to_dict(), "version": version("mirrortwin")}
    record.write_text(json.dumps(described, indent=2) + "\n", encoding="utf-8")
    return [faulted, mirror, recording, record]
