"""Our field flights beside real ones: levels, noise, ties between channels, and a classifier.

Both are measured by the same code on the same kind of cruise (`core.experiments.realism.cruise`).
Real logs stay where they are: the result holds figures made of them, not their data.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from core.channels import CHANNELS
from core.clock import DT_S
from core.dataset.field_plans import field_plan, load_distribution
from core.errors import InputError
from core.exchange.log import Log
from core.exchange.log_files import LOGS, read_logs
from core.experiments.realism.cruise import (
    CORRELATIONS,
    Cruise,
    cruising,
    describe,
    steady_stretches,
)
from core.experiments.realism.detector import (
    CRUISE_WINDOW_S,
    STATISTICS,
    Verdict,
    tell_apart,
    tell_own_apart,
)
from core.experiments.realism.figure import draw
from core.experiments.realism.rows import ChannelRow, CorrelationRow
from core.experiments.results import Progress, Result
from core.seeds import REALISM_SEED
from core.twin.flight import fly
from core.twin.plan import Plan

NOISE_FACTOR = 1.5
CORRELATION_WITHIN = 0.25
_A_SECOND = round(1.0 / DT_S)
_SHARE_FLYING = 0.9
"""Of the work; the rest is reading, measuring and the classifier."""


def run(quick: bool, progress: Progress, logs: Path = LOGS) -> Result:
    """Read the logs, fly by seed, compare; raises `InputError` where no log can be used."""
    real, refused = real_flights(logs)
    theirs = describe(real)
    if not theirs.seconds:
        raise InputError("logs", f"no log in {logs} has any cruise (level, over 90 kt)")
    distribution = load_distribution()
    plans = sampled_plans(quick)
    flown = [_logged(plan, done / len(plans), progress) for done, plan in enumerate(plans)]
    progress(_SHARE_FLYING)
    ours = describe(flown)
    channels, correlations = channel_rows(ours, theirs), correlation_rows(ours, theirs)
    verdict, own_aucs = tell_apart(flown, real), tell_own_apart(flown, real)
    progress(1.0)
    return Result(
        name="realism",
        settings={
            "quick": quick,
            "conditions": "field",
            "seeds": [plans[0].seed, plans[-1].seed],
            "flights": len(plans),
            "distribution": distribution,
            "noise_factor": NOISE_FACTOR,
            "correlation_within": CORRELATION_WITHIN,
            "window_s": CRUISE_WINDOW_S,
            "statistics": list(STATISTICS),
        },
        findings={
            "held": _counts(channels, correlations),
            "auc": verdict.auc,
            "auc_of_our_own_told_to_be_real": own_aucs,
            "channels": [asdict(row) for row in channels],
            "correlations": [asdict(row) for row in correlations],
            "classifier": asdict(verdict),
            "cruise_s": {"ours": ours.seconds, "real": theirs.seconds},
            "steady_s": {"ours": ours.steady_seconds, "real": theirs.steady_seconds},
            "logs": [_about(log) for log in real],
            "logs_left_out": refused,
        },
        figure=draw(channels, correlations, verdict),
        summary=(
            *_summary(channels, correlations, verdict, own_aucs),
            *(f"{log.name}: {'; '.join(log.reading.sentences())}" for log in real),
            *(f"left out: {why}" for why in refused.values()),
        ),
    )


def real_flights(folder: Path) -> tuple[list[Log], dict[str, str]]:
    """Logs of real Cessna 172s, and why each other file is left out; raises `InputError`."""
    read, refused = read_logs(folder)
    for log in read:
        if log.reading.simulated:
            refused[log.name] = f"{log.name}: is a simulated flight, as its head says"
        elif log.reading.not_a_172 is not None:
            refused[log.name] = f"{log.name}: is no Cessna 172: {log.reading.not_a_172}"
    real = [log for log in read if log.name not in refused]
    if not real:
        raise InputError(
            "logs", f"nothing to compare with in {folder}: {'; '.join(refused.values())}"
        )
    return real, refused


def sampled_plans(quick: bool) -> list[Plan]:
    """The plans flown, by seed."""
    distribution = load_distribution()
    number = distribution["quick_flights" if quick else "flights"]
    return [field_plan(REALISM_SEED + k, distribution) for k in range(number)]


def _logged(plan: Plan, done: float, progress: Progress) -> Log:
    """One of our flights as a log would have it: every fiftieth sample."""
    progress(_SHARE_FLYING * done)
    flight = fly(plan)
    return Log(
        f"seed {plan.seed}",
        flight.time_s[::_A_SECOND].copy(),
        flight.channels[::_A_SECOND].astype(np.float64),
    )


def channel_rows(ours: Cruise, real: Cruise) -> list[ChannelRow]:
    """The comparison channel by channel."""
    rows: list[ChannelRow] = []
    for k, about in enumerate(CHANNELS):
        mean, low, high = (_known(values[k]) for values in (ours.mean, real.low, real.high))
        noise, real_noise = _known(ours.white_sd[k]), _known(real.white_sd[k])
        ratio = noise / real_noise if noise is not None and real_noise else None
        rows.append(
            ChannelRow(
                channel=about.name,
                unit=about.unit,
                mean_ours=mean,
                mean_real=_known(real.mean[k]),
                low_real=low,
                high_real=high,
                mean_held=None
                if mean is None or low is None or high is None
                else low <= mean <= high,
                noise_ours=noise,
                noise_real=real_noise,
                noise_ratio=_rounded(ratio),
                noise_held=None if ratio is None else 1.0 / NOISE_FACTOR <= ratio <= NOISE_FACTOR,
            )
        )
    return rows


def correlation_rows(ours: Cruise, real: Cruise) -> list[CorrelationRow]:
    """The comparison pair by pair, over both spans."""
    rows: list[CorrelationRow] = []
    for span, mine, theirs in (
        ("cruise", ours.slow, real.slow),
        ("half a minute", ours.fast, real.fast),
    ):
        for k, pair in enumerate(CORRELATIONS):
            a, b = _known(mine[k]), _known(theirs[k])
            held = None
            if a is not None and b is not None:
                held = a * b > 0.0 and abs(a - b) <= CORRELATION_WITHIN
            rows.append(CorrelationRow(pair, span, a, b, held))
    return rows


def _known(value: float) -> float | None:
    return _rounded(float(value)) if math.isfinite(value) else None


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.5g}")


def _counts(
    channels: Sequence[ChannelRow], correlations: Sequence[CorrelationRow]
) -> dict[str, dict[str, int]]:
    """How many of each kind of claim hold, of how many that could be judged."""
    judged = {
        "means": [row.mean_held for row in channels],
        "noise": [row.noise_held for row in channels],
        "correlations": [row.held for row in correlations if row.span == "cruise"],
        "correlations_half_a_minute": [row.held for row in correlations if row.span != "cruise"],
    }
    return {
        kind: {"held": sum(map(bool, held)), "of": sum(one is not None for one in held)}
        for kind, held in judged.items()
    }


def _about(log: Log) -> dict[str, Any]:
    steady = steady_stretches(log)
    return {
        "name": log.name,
        "rows": len(log),
        "cruise_s": int(cruising(log).sum()),
        "steady_s": sum(rows.stop - rows.start for rows in steady),
        "missing": list(log.missing),
        "aircraft": log.reading.aircraft,
        "converted": [asdict(each) for each in log.reading.converted],
        "dropped": [asdict(each) for each in log.reading.dropped],
        "doubts": list(log.reading.doubts),
    }


def _summary(
    channels: Sequence[ChannelRow],
    correlations: Sequence[CorrelationRow],
    verdict: Verdict,
    own_aucs: Sequence[float],
) -> tuple[str, ...]:
    counts = _counts(channels, correlations)
    lines = [
        f"{text}: {counts[kind]['held']} of {counts[kind]['of']}"
        for kind, text in (
            ("means", "channel means inside the real cruise range"),
            ("noise", f"white noise within a factor {NOISE_FACTOR:g} of the real"),
            ("correlations", f"correlations in cruise within {CORRELATION_WITHIN:g}"),
            ("correlations_half_a_minute", "the same within half a minute of steady cruise"),
        )
    ]
    if verdict.auc is None:
        lines.append(f"classifier: too few real windows of steady cruise ({verdict.n_real})")
    else:
        leans = ", ".join(list(verdict.leans_on)[:5])
        lines.append(
            f"classifier: AUC {verdict.auc:.2f} (0.5 is the goal) on {verdict.n_real} real windows "
            f"kept apart by {verdict.groups}; leans on {leans}"
        )
    if own_aucs:
        lines.append(
            "the same, with some of our own flights told to be the real ones: AUC "
            + ", ".join(f"{auc:.2f}" for auc in own_aucs)
        )
    return tuple(lines)
