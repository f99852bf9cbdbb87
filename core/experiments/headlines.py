"""The result of each experiment in a few words, from the content of its file."""

from collections.abc import Mapping
from typing import Any

from core.experiments.stored import with_onset_known
from core.fmea.catalogue import catalogue

Content = Mapping[str, Any]

WRITERS = {"with_fmea": "model with FMEA", "no_fmea": "model without FMEA"}
"""Who wrote the reports of Table 6, where that is not said plainly already."""


def _is_field(content: Content) -> bool:
    """Whether it was made in conditions of which the paper says nothing."""
    return content.get("conditions") == "field"


def best_score(content: Content) -> str:
    known = [row for row in content["rows"] if row.get("macro_f1") is not None]
    if not known:
        return "no cell was run yet"
    best = max(known, key=lambda row: row["macro_f1"])
    theirs = None if _is_field(content) else best.get("paper_macro_f1")
    beside = f", paper {theirs:.3f}" if theirs is not None else ""
    left = len(content["rows"]) - len(known)
    more = f"; {left} of {len(content['rows'])} rows not run yet" if left else ""
    known_onset = with_onset_known(content)
    return f"best macro-F1 {best['macro_f1']:.3f} ({best['scheme']}{beside}){known_onset}{more}"


def horizons(content: Content) -> str:
    chosen = content.get("chosen_on_validation")
    row = next((row for row in content["rows"] if row["scheme"] == chosen), None)
    if row is None:
        return best_score(content)
    steps = "step" if chosen == "1" else "steps"
    beside = "" if _is_field(content) else f", paper {row['paper_macro_f1']:.3f}"
    return (
        f"validation flights chose {chosen} {steps} ahead: macro-F1 {row['macro_f1']:.3f}{beside}"
        f"{with_onset_known(content)}"
    )


def cost(content: Content) -> str:
    first = content["rows"][0]
    return (
        f"{first['total_ms']:.0f} ms a diagnosis beside a mirror, paper "
        f"{first['paper_total_ms']:.0f} ms"
    )


def reports(content: Content) -> str:
    return "; ".join(
        f"{WRITERS.get(row['writer'], row['writer'])}: hallucination rate {row['hr']:.3f}"
        for row in content["rows"]
        if row["grounded"] and row["hr"] is not None
    )


def signs(content: Content) -> str:
    return (
        f"{content['held']} of {content['of']} signs and {content['magnitudes_within']} of "
        f"{content['of']} ranges as engineers expect"
    )


def speed(content: Content) -> str:
    return (
        f"a pair of flights costs {content['pair_ratio']:.1f} bare JSBSim loops, "
        f"{content['pair_s']:.2f} s for 300 s"
    )


def realism(content: Content) -> str:
    held = content["held"]
    auc = content["auc"]
    told = f"told from real flights with AUC {auc:.2f}" if auc is not None else "no verdict"
    return f"{held['means']['held']} of {held['means']['of']} channel means in range; {told}"


def falls(content: Content) -> str:
    lost = {mode: left["altitude_lost_ft"] for mode, left in content["faults"].items()}
    worst, second = sorted(lost, key=lambda mode: -lost[mode])[:2]
    return (
        f"{catalogue()[worst].name.lower()} loses {lost[worst]:,.0f} ft by the end, "
        f"{catalogue()[second].name.lower()} as the next {lost[second]:,.0f} ft"
    )


def field(content: Content) -> str:
    onset, healthy = content["onset"], content["healthy"]
    return (
        f"end to end, {100 * content['named_share']:.0f} % of faults named, the onset within 30 s "
        f"in {100 * onset['within_30_s_share']:.0f} %; {healthy['evidence_lines']} lines of false "
        f"evidence in {healthy['flights']} healthy flights"
    )


def delay(content: Content) -> str:
    rows = [row for row in content["rows"] if row["median_delay_s"] is not None]
    if not rows:
        return "no fault was named"
    worst = max(rows, key=lambda row: row["severity"])
    return f"named {worst['median_delay_s']:.0f} s after a severe onset (median)"


def unknown(content: Content) -> str:
    refused = ", ".join(
        f"{row['group']} {100 * row['refused_share']:.0f} %"
        for row in content["rows"]
        if row["residual"] == "paired"
    )
    return f"flights it refuses to name: {refused}"


def crowd(content: Content) -> str:
    return f"{content['pages']} pages at once: 95 % of samples come within {content['p95_s']:.2f} s"


def cross(content: Content) -> str:
    scored = {
        (row["trained"], row["tested"]): row["macro_f1"]
        for row in content["rows"]
        if row["residual"] == "paired"
    }
    return (
        f"in field, macro-F1 {scored['field', 'field']:.3f} by the model trained there, "
        f"{scored['lab', 'field']:.3f} by the lab's"
        f"{with_onset_known({**content, 'conditions': 'field'})}"
    )
