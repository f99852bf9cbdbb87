"""Options of a flight, a fault and a cluster; units and ranges are read from the plan."""

import argparse
import difflib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.plan import PLAN_RANGES, Plan, load_plan

if TYPE_CHECKING:  # it loads Dask
    from core.workers.scheduler import RemoteScheduler

_Option = tuple[str, str, str, str]
"""Option, metavar with the unit, field that it sets, and help text."""

_PLAN_OPTIONS: tuple[_Option, ...] = (
    ("--altitude", "FT", "altitude_ft", "altitude to hold"),
    ("--speed", "KT", "speed_kt", "indicated airspeed to hold"),
    ("--heading", "DEG", "heading_deg", "heading to hold"),
    ("--duration", "S", "duration_s", "length of the flight"),
)
_WEATHER_OPTIONS: tuple[_Option, ...] = (
    ("--isa", "DEGC", "isa_deviation_degc", "deviation from the standard temperature"),
    ("--wind", "KT", "wind_kt", "steady wind"),
    ("--wind-from", "DEG", "wind_from_deg", "direction of the wind"),
    ("--turbulence", "LEVEL", "turbulence", "from calm to moderate, whole numbers"),
)


def _range(field: str) -> str:
    low, high, unit = PLAN_RANGES[field]
    return f"{low:g} to {high:g} {unit}".rstrip()


def add_plan_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that `requested_plan` reads."""
    group = parser.add_argument_group(
        "the flight", "Values not given are drawn from --seed, or read from --plan."
    )
    group.add_argument("--seed", type=int, metavar="N", help="random seed (default 0)")
    group.add_argument("--plan", type=Path, metavar="FILE", help="a plan as TOML")
    for option, metavar, field, text in _PLAN_OPTIONS + _WEATHER_OPTIONS:
        group.add_argument(
            option, dest=field, type=float, metavar=metavar, help=f"{text}: {_range(field)}"
        )
    group.add_argument(
        "--power",
        choices=("fixed", "speed_hold"),
        help="fixed: leave the throttle where it holds the speed in health; speed_hold: keep "
        "controlling the speed",
    )
    group.add_argument(
        "--conditions",
        choices=("lab", "field"),
        help="lab: the mirror shares air and noise, as in the paper; field: it knows them only "
        "roughly",
    )


def requested_plan(args: argparse.Namespace) -> Plan:
    """The plan of the options; raises `InputError` naming the field that is out of range."""
    seed = Plan(seed=args.seed or 0).seed  # refused here where it is out of range
    plan = load_plan(args.plan) if args.plan else Plan.sampled(seed)
    names = ("seed", "power", "conditions", *(field for _, _, field, _ in _PLAN_OPTIONS))
    weather = _given(args, tuple(field for _, _, field, _ in _WEATHER_OPTIONS))
    return replace(plan, **_given(args, names), weather=replace(plan.weather, **weather))


def _given(args: argparse.Namespace, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: getattr(args, name) for name in names if getattr(args, name) is not None}


def add_fault_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that `requested_fault` reads."""
    group = parser.add_argument_group("the fault")
    group.add_argument(
        "--fault",
        default="nominal",
        metavar="ID",
        help="one of: " + ", ".join(catalogue()) + " (default nominal)",
    )
    group.add_argument(
        "--severity", type=float, default=0.6, metavar="0-1", help="0 is healthy (default 0.6)"
    )
    group.add_argument(
        "--onset", type=float, default=60.0, metavar="S",
        help="start of the fault, before the end of the flight (default 60 s)",
    )  # fmt: skip
    group.add_argument(
        "--cylinder", type=int, metavar="1-4", help="affected cylinder (default: the usual one)"
    )


def requested_fault(args: argparse.Namespace, plan: Plan) -> Fault:
    """The fault of the options; raises `InputError` naming the field that is out of range."""
    modes = catalogue()
    if args.fault not in modes:
        close = difflib.get_close_matches(args.fault, modes, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(close)}?" if close else "no mode has a similar name;"
        raise InputError("fault", f"unknown mode {args.fault!r}; {hint} see `mirrortwin faults`")
    fault = Fault(args.fault, args.severity, args.onset, args.cylinder)
    fault.check_within(plan.duration_s)
    return fault


def add_scheduler_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that `requested_scheduler` reads."""
    group = parser.add_argument_group(
        "a Dask cluster", "Without one, flights are flown by local processes."
    )
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="its scheduler, such as tls://HOST:8786"
    )
    for option, text in (
        ("--tls-ca", "certificate of the CA that both sides trust"),
        ("--tls-cert", "own certificate"),
        ("--tls-key", "own key, if it is not in the certificate file"),
    ):
        group.add_argument(
            option, type=Path, metavar="FILE", help=f"{text} (PEM; else from Dask's configuration)"
        )
    group.add_argument(
        "--insecure-scheduler", action="store_true",
        help="accept a scheduler on another machine without TLS: anyone on its network can run "
        "code in it and here",
    )  # fmt: skip


def requested_scheduler(args: argparse.Namespace) -> "RemoteScheduler | None":
    """The scheduler that the options name; raises `InputError` if it may not be used so."""
    from core.workers.scheduler import RemoteScheduler

    if args.scheduler is not None:
        return RemoteScheduler(
            args.scheduler, args.tls_ca, args.tls_cert, args.tls_key, args.insecure_scheduler
        )
    if args.tls_ca or args.tls_cert or args.tls_key or args.insecure_scheduler:
        raise InputError(
            "scheduler", "the --tls options and --insecure-scheduler need --scheduler too"
        )
    return None
