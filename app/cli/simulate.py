"""``mirrortwin simulate``: one flight and its healthy mirror, into a folder."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.options import add_fault_options, add_plan_options, requested_fault, requested_plan
from app.cli.output import note, print_json, progress, writable_folder

if TYPE_CHECKING:
    from core.fmea.fault import Fault
    from core.twin.actions import Action
    from core.twin.plan import Plan
    from core.twin.trajectory import Pair

_BLOCK_S = 30.0

DESCRIPTION = """\
Fly one flight twice, with the fault and without it, and write what both aircraft logged:

  faulted.parquet, mirror.parquet   time, channels and flight states, 50 samples a second
  run.rrd                           the same for the Rerun viewer
  run.json                          the plan, the fault and the actions

The same options write the same Parquet bytes on every run.
"""
EXAMPLES = """\
examples:
  mirrortwin simulate --fault baffle_crack --severity 0.8 --onset 60 --seed 7 --out flight
  mirrortwin simulate --fault engine_failure --altitude 5000 --speed 100 --heading 90 --out flight
  mirrortwin simulate --plan plan.toml --fault oil_cooler_maintenance --out flight
  mirrortwin simulate --actions actions.toml --out flight

a plan file holds any of these lines; other values keep their defaults:
  altitude_ft = 5200
  speed_kt = 95
  duration_s = 600
  seed = 7
  [weather]
  wind_kt = 12
  wind_from_deg = 240

an actions file holds any number of these:
  [[actions]]
  kind = "fault"          # or "repair", or "target" with altitude_ft, speed_kt, heading_deg
  time_s = 90
  mode = "baffle_crack"
  severity = 0.7
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    add_fault_options(parser)
    add_plan_options(parser)
    parser.add_argument(
        "--actions", type=Path, metavar="FILE",
        help="actions during the flight, as TOML or JSON: faults, repairs, new targets",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="the folder to write to"
    )
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")


def run(args: argparse.Namespace) -> None:
    """Fly the pair and write it; raises `InputError`, `FlightError` or `StoreError`."""
    plan = requested_plan(args)
    fault = requested_fault(args, plan)
    actions = _requested_actions(args.actions, plan)
    out = writable_folder(args.out)
    with progress("flying") as show:
        pair = _flown(plan, fault, actions, show)
    actions = _done(actions, pair)
    files = _write(out, pair, plan, fault, actions)
    if args.json:
        summary = {"plan": plan.to_dict(), "fault": fault.to_dict(), "samples": len(pair.mirror),
                   "ground_s": pair.ground_s}  # fmt: skip
        print_json(summary | {"files": [str(path) for path in files]})
        return
    for path in files:
        print(path)
    note(f"Now try: mirrortwin diagnose {out}")


def _requested_actions(path: Path | None, plan: "Plan") -> "tuple[Action, ...]":
    from core.twin.actions import in_order, load_actions

    return () if path is None else in_order(load_actions(path), plan)


def _done(actions: "tuple[Action, ...]", pair: "Pair") -> "tuple[Action, ...]":
    """The actions that were done; notes it if the flight ended on the ground."""
    from core.twin.actions import done_by

    done = done_by(actions, float(pair.mirror.time_s[-1]))
    if pair.ground_s is not None:
        note(
            f"The flight ends at {pair.ground_s:.1f} s: the aircraft met the ground "
            "(sea level; no terrain is simulated)"
        )
    if len(done) < len(actions):
        note(f"Not done, because the flight was over: {len(actions) - len(done)} of the actions")
    return done


def _flown(
    plan: "Plan", fault: "Fault", actions: "tuple[Action, ...]", show: Callable[[float], None]
) -> "Pair":
    from core.twin.flight import PairFlight
    from core.twin.trajectory import Pair

    flight = PairFlight(plan, fault, actions)
    blocks: list[Pair] = []
    while (block := flight.advance(_BLOCK_S)) is not None:
        blocks.append(block)
        show(flight.progress)
    return Pair.joined(blocks)


def _write(
    out: Path, pair: "Pair", plan: "Plan", fault: "Fault", actions: "tuple[Action, ...]"
) -> list[Path]:
    from importlib.metadata import version

    from app.scenes.recording import write_recording
    from core.fmea.fault import Fault
    from core.twin.actions import action_to_dict, first_fault
    from core.twin.flight_file import write_trajectory

    faulted, mirror, recording, record = (
        out / name for name in ("faulted.parquet", "mirror.parquet", "run.rrd", "run.json")
    )
    write_trajectory(faulted, pair.faulted)
    write_trajectory(mirror, pair.mirror)
    flown = (first_fault(fault, actions) or Fault()) if actions else fault
    write_recording(recording, pair, plan, flown)
    described: dict[str, Any] = {"plan": plan.to_dict(), "fault": fault.to_dict()}
    if listed := [action_to_dict(action) for action in actions]:
        described["actions"] = listed
    described["version"] = version("mirrortwin")
    record.write_text(json.dumps(described, indent=2) + "\n", encoding="utf-8")
    return [faulted, mirror, recording, record]
