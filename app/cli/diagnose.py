"""``mirrortwin diagnose``: name the fault behind two logged flights."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.output import note, print_json, stdout
from core.errors import InputError, StoreError

if TYPE_CHECKING:
    from core.diagnosis.diagnosis import Diagnosis, Intervention
    from core.twin.actions import Action
    from core.twin.plan import Plan
    from core.twin.trajectory import Pair

DESCRIPTION = """\
Diagnose a folder that `mirrortwin simulate` wrote. Only faulted.parquet and mirror.parquet are
read, or with --residual surrogate faulted.parquet and the plan; the injected fault is not.
"""
EXAMPLES = """\
examples:
  mirrortwin diagnose flight
  mirrortwin diagnose flight --json
  mirrortwin diagnose flight --residual surrogate
  mirrortwin diagnose flight --conditions field

the JSON holds "top" (a fault id), "probabilities" (id: 0 to 1, of every class) and "evidence" (the
channels that left their mirror, or what the surrogate expected: when, how far, which way).
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a folder written by simulate")
    parser.add_argument(
        "--residual", choices=("paired", "surrogate"), default="paired",
        help="paired: compare with the healthy mirror (default); surrogate: compare with a network "
        "that predicts healthy flights, which needs no mirror",
    )  # fmt: skip
    parser.add_argument(
        "--conditions", choices=("lab", "field"),
        help="use the model trained for these conditions (default: those in run.json, else lab)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the diagnosis as JSON")


def run(args: argparse.Namespace) -> None:
    """Print the diagnosis; raises `InputError`, `StoreError` or `MirrorTwinError`."""
    pair = read_pair(args.folder, mirrored=args.residual == "paired")
    plan = read_plan(args.folder)
    from core.diagnosis.predict import load_diagnoser

    conditions = args.conditions or (plan.conditions if plan is not None else "lab")
    known = read_interventions(args.folder, pair)
    diagnoser = load_diagnoser(args.residual, conditions=conditions)
    diagnosis = diagnoser.diagnose(pair, plan, interventions=known)
    if plan is not None and plan.conditions != diagnosis.conditions:
        note(
            f"this flight was flown in {plan.conditions} conditions, and {diagnosis.model} was "
            f"trained on {diagnosis.conditions} flights only: its scores do not apply here"
        )
    if args.json:
        print_json(diagnosis.to_dict())
    else:
        _print_tables(diagnosis)


def read_plan(folder: Path) -> "Plan | None":
    """The commanded plan, from ``run.json``; None where it holds none.

    Raises `InputError` if it is a plan that cannot be flown, or the file is damaged.
    """
    from core.twin.actions import commanded

    plan, actions = _read_run(folder)
    return None if plan is None else commanded(plan, actions)


def read_interventions(folder: Path, pair: "Pair") -> "tuple[Intervention, ...]":
    """Repairs and new targets, from ``run.json``, and where the flight met the ground.

    Which fault was injected is not among them. Raises `InputError` as `read_plan` does.
    """
    from core.diagnosis.interventions import interventions

    return interventions(_read_run(folder)[1], pair.ground_s)


def _read_run(folder: Path) -> "tuple[Plan | None, tuple[Action, ...]]":
    """The plan and the actions in ``run.json``; neither where there is none."""
    from core.files import read_json
    from core.twin.actions import read_action
    from core.twin.plan import Plan

    if not (folder / "run.json").exists():
        return None, ()
    try:
        values = read_json(folder / "run.json")
        if "plan" not in values:
            return None, ()
        actions = tuple(map(read_action, values.get("actions", ())))
        return Plan.from_dict(values["plan"]), actions
    except StoreError as error:
        raise InputError(
            "DIR", f"{error}. Without it, lab conditions are assumed: remove it if that is right"
        ) from None
    except (TypeError, ValueError, AttributeError, OverflowError, KeyError):
        raise InputError("DIR", f"{folder / 'run.json'} does not hold a plan") from None


def read_pair(folder: Path, *, mirrored: bool = True) -> "Pair":
    """The pair in ``folder``; raises `InputError` if it is not there or its halves differ.

    Without ``mirrored`` only the faulted flight is read, and stands on both sides.
    """
    if not folder.is_dir():
        raise InputError("DIR", f"there is no folder {folder}")
    import numpy as np

    from core.exchange.foreign_flight import check_flight, check_pages
    from core.twin.flight_file import read_trajectory
    from core.twin.trajectory import Pair

    names = ("faulted.parquet", "mirror.parquet" if mirrored else "faulted.parquet")
    paths = [folder / name for name in names]
    for path in paths:
        if not path.is_file():
            raise InputError(
                "DIR", f"{folder} holds no {path.name}; `mirrortwin simulate` writes it"
            )
    flights = []
    for path in dict.fromkeys(paths):
        check_pages(path, ("",))
        flights.append(read_trajectory(path))
        check_flight(str(path), flights[-1])
    pair = Pair(flights[0], flights[-1])
    if len(pair.faulted) != len(pair.mirror):
        raise InputError(
            "DIR",
            f"faulted.parquet has {len(pair.faulted)} samples and mirror.parquet "
            f"{len(pair.mirror)}: they are not of one flight",
        )
    if not np.array_equal(pair.faulted.time_s, pair.mirror.time_s):
        raise InputError(
            "DIR",
            "faulted.parquet and mirror.parquet have different times: they are not of one flight",
        )
    return pair


def _print_tables(diagnosis: "Diagnosis") -> None:
    from rich.table import Table

    from core.channels import unit_label
    from core.units import percent

    stdout().print(f"{diagnosis.model}, trained for {diagnosis.conditions} conditions\n")
    ranked = Table("diagnosis", "probability", box=None)
    for mode, probability in diagnosis.ranked(3):
        ranked.add_row(mode, percent(probability))
    stdout().print(ranked)
    if diagnosis.none_of_these:
        stdout().print(
            "\nNone of these: the flight resembles no class that the model was trained on."
        )
    if not diagnosis.evidence:
        stdout().print("\nNo channel deviated from its reference.")
        return
    found = Table("channel", "from", "to", "mean residual", "in sigma", box=None)
    for item in diagnosis.evidence:
        found.add_row(
            item.channel,
            f"{item.start_s:.0f} s",
            f"{item.end_s:.0f} s",
            f"{item.value:+.3g} {unit_label(item.unit)}",
            f"{item.sigma:+.1f}",
        )
    stdout().print()
    stdout().print(found)
