"""What the page *Results* shows: which result, what it says, how it is made."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from app.pages.words import mode_name
from core.experiments.shelf import with_onset_known

Kind = Literal["scores", "picture", "model"]
Content = Mapping[str, Any]

MEASURES: dict[str, tuple[str, str]] = {
    "accuracy": ("Accuracy", ".3f"),
    "macro_precision": ("Precision", ".3f"),
    "macro_recall": ("Recall", ".3f"),
    "macro_f1": ("Macro-F1", ".3f"),
    "per_class_f1_sd": ("Spread of F1 over classes", ".3f"),
    "mae": ("MAE, channel units", ".2f"),
    "rmse": ("RMSE, channel units", ".2f"),
    "mirror_ms": ("Mirror, ms", ".1f"),
    "features_ms": ("Features, ms", ".1f"),
    "cnn_ms": ("Network, ms", ".1f"),
    "total_ms": ("Total, ms", ".1f"),
    "ccc": ("Causal chain coverage", ".3f"),
    "sec": ("Sensor evidence consistency", ".3f"),
    "dc": ("Diagnostic consistency", ".3f"),
    "hr": ("Hallucination rate", ".3f"),
}
"""Name and number format of every measure that a table may hold."""

EXPLAINED: dict[str, str] = {
    "accuracy": "accuracy",
    "macro_precision": "precision",
    "macro_recall": "recall",
    "macro_f1": "macro_f1",
    "ccc": "ccc",
    "sec": "sec",
    "dc": "dc",
    "hr": "hr",
}
"""The word of the glossary that says what a measure is."""

WRITERS = {"with_fmea": "model with FMEA", "no_fmea": "model without FMEA"}
"""Who wrote the reports of Table 6, where that is not said plainly already."""


@dataclass(frozen=True, slots=True)
class Exhibit:
    """A result by the name in its address.

    ``files`` are the results that show it, one a condition; ``command`` makes it and ``cost`` says
    how long that takes. ``lead`` is the measure drawn, ``log`` whether on a logarithmic axis.
    ``headline`` says the result in a few words.
    """

    name: str
    title: str
    about: str
    files: tuple[str, ...]
    command: str
    cost: str
    kind: Kind = "picture"
    lead: str = "macro_f1"
    log: bool = False
    headline: Callable[[Content], str] = lambda content: ""


def _is_field(content: Content) -> bool:
    """Whether it was made in conditions of which the paper says nothing."""
    return content.get("conditions") == "field"


def _best(content: Content) -> str:
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


def _horizons(content: Content) -> str:
    chosen = content.get("chosen_on_validation")
    row = next((row for row in content["rows"] if row["scheme"] == chosen), None)
    if row is None:
        return _best(content)
    steps = "step" if chosen == "1" else "steps"
    beside = "" if _is_field(content) else f", paper {row['paper_macro_f1']:.3f}"
    return (
        f"validation flights chose {chosen} {steps} ahead: macro-F1 {row['macro_f1']:.3f}{beside}"
        f"{with_onset_known(content)}"
    )


def _cost(content: Content) -> str:
    first = content["rows"][0]
    return (
        f"{first['total_ms']:.0f} ms a diagnosis beside a mirror, paper "
        f"{first['paper_total_ms']:.0f} ms"
    )


def _reports(content: Content) -> str:
    return "; ".join(
        f"{WRITERS.get(row['writer'], row['writer'])}: hallucination rate {row['hr']:.3f}"
        for row in content["rows"]
        if row["grounded"] and row["hr"] is not None
    )


def _signs(content: Content) -> str:
    return (
        f"{content['held']} of {content['of']} signs and {content['magnitudes_within']} of "
        f"{content['of']} ranges as engineers expect"
    )


def _speed(content: Content) -> str:
    return (
        f"a pair of flights costs {content['pair_ratio']:.1f} bare JSBSim loops, "
        f"{content['pair_s']:.2f} s for 300 s"
    )


def _realism(content: Content) -> str:
    held = content["held"]
    auc = content["auc"]
    told = f"told from real flights with AUC {auc:.2f}" if auc is not None else "no verdict"
    return f"{held['means']['held']} of {held['means']['of']} channel means in range; {told}"


def _falls(content: Content) -> str:
    lost = {mode: left["altitude_lost_ft"] for mode, left in content["faults"].items()}
    worst, second = sorted(lost, key=lambda mode: -lost[mode])[:2]
    return (
        f"{mode_name(worst).lower()} loses {lost[worst]:,.0f} ft by the end, "
        f"{mode_name(second).lower()} as the next {lost[second]:,.0f} ft"
    )


def _field(content: Content) -> str:
    onset, healthy = content["onset"], content["healthy"]
    return (
        f"end to end, {100 * content['named_share']:.0f} % of faults named, the onset within 30 s "
        f"in {100 * onset['within_30_s_share']:.0f} %; {healthy['evidence_lines']} lines of false "
        f"evidence in {healthy['flights']} healthy flights"
    )


def _delay(content: Content) -> str:
    rows = [row for row in content["rows"] if row["median_delay_s"] is not None]
    if not rows:
        return "no fault was named"
    worst = max(rows, key=lambda row: row["severity"])
    return f"named {worst['median_delay_s']:.0f} s after a severe onset (median)"


def _unknown(content: Content) -> str:
    refused = ", ".join(
        f"{row['group']} {100 * row['refused_share']:.0f} %"
        for row in content["rows"]
        if row["residual"] == "paired"
    )
    return f"flights it refuses to name: {refused}"


def _crowd(content: Content) -> str:
    return f"{content['pages']} pages at once: 95 % of samples come within {content['p95_s']:.2f} s"


def _crossed(content: Content) -> str:
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


_TRAINED = "Trains on a data set: hours. What is done is kept, so it fills bit by bit."

EXHIBITS: dict[str, Exhibit] = {
    item.name: item
    for item in (
        Exhibit(
            "model", "The shipped models", "What each 1D-CNN on this server takes for what, on "
            "test flights whose seeds it never saw: each row is what was injected, each column "
            "what it said.", (), "mirrortwin train", _TRAINED, kind="model",
        ),
        Exhibit(
            "table1", "Table 1: features", "The 1D-CNN on four feature modes, three seeds each. "
            "The paper's claim: residuals against a mirror beat everything else.",
            ("table1-lab", "table1-field"), "mirrortwin experiment table1", _TRAINED,
            kind="scores", headline=_best,
        ),
        Exhibit(
            "table2", "Table 2: features and classifiers", "Four feature modes times six "
            "classifiers. The paper's claim: what you show the classifier matters more than which "
            "one it is.", ("table2-lab", "table2-field"), "mirrortwin experiment table2", _TRAINED,
            kind="scores", headline=_best,
        ),
        Exhibit(
            "table3", "Table 3: residuals or states", "Whether a classifier needs residuals, "
            "states, or both.", ("table3-lab", "table3-field"), "mirrortwin experiment table3",
            _TRAINED, kind="scores", headline=_best,
        ),
        Exhibit(
            "table4", "Table 4: surrogate horizon", "How far ahead the GRU surrogate learns to "
            "predict, and what that does to the diagnosis.", ("table4-lab", "table4-field"),
            "mirrortwin experiment table4", _TRAINED, kind="scores", headline=_horizons,
        ),
        Exhibit(
            "table5", "Table 5: cost", "What one diagnosis costs by each way. Different machines: "
            "the paper's is an Intel Core i7-12700H.", ("table5-lab",),
            "mirrortwin experiment table5", "Under a minute.", kind="scores", lead="total_ms",
            log=True, headline=_cost,
        ),
        Exhibit(
            "table6", "Table 6: reports", "How good reports are, by the template and by a language "
            "model, before and after grounding. Good is 1, for hallucinations 0.",
            ("table6-lab",), "mirrortwin experiment table6",
            "Minutes; with a language model, hours on a small machine.", kind="scores", lead="hr",
            headline=_reports,
        ),
        Exhibit(
            "fig6", "Fig. 6: paths", "Where five faults take the aircraft, beside nominal flight.",
            ("fig6",), "mirrortwin experiment fig6", "Seconds.", headline=_falls,
        ),
        Exhibit(
            "fig7", "Fig. 7: channels", "Six key channels under the same five faults.", ("fig7",),
            "mirrortwin experiment fig7", "Seconds.",
            headline=lambda content: f"{len(content['channels'])} channels, "
            f"{len(content['faults']) - 1} faults beside nominal flight",
        ),
        Exhibit(
            "signs", "Signs", "Does every fault move every channel the way, and as far as, "
            "engineers say it does?", ("signs",), "mirrortwin experiment signs", "A minute.",
            headline=_signs,
        ),
        Exhibit(
            "realism", "Realism", "Field flights beside real G1000 logs: levels, noise, ties, and "
            "whether a classifier can tell them apart.", ("realism",),
            "mirrortwin experiment realism", "Some ten minutes, and real logs.",
            headline=_realism,
        ),
        Exhibit(
            "speed", "Speed", "What a flight costs, counted in bare JSBSim loops of the same "
            "length: the green bands are the goals.", ("speed",), "mirrortwin experiment speed",
            "Some minutes, on a quiet machine.", headline=_speed,
        ),
        Exhibit(
            "crowd", "Many at once", "How late samples come when many pages fly at once, and what "
            "memory the server takes. The dashed line is the goal.", ("crowd",),
            "mirrortwin bench --clients 50 --out models/results",
            "Some ten minutes, on a quiet machine.", headline=_crowd,
        ),
        Exhibit(
            "cross", "Lab and field", "Models trained in still air and in weather, each tested in "
            "both, and the score that each channel would win back if it read as in lab.",
            ("cross",), "mirrortwin experiment cross", "Minutes, and both data sets.",
            headline=_crossed,
        ),
        Exhibit(
            "field", "Field, end to end", "Flights in wind and gusts as the shipped diagnosis "
            "answers them, the onset unknown: F1 of whole flights.", ("field",),
            "mirrortwin experiment field", "Some ten minutes.", headline=_field,
        ),
        Exhibit(
            "delay", "Delay", "How soon after its onset a fault is named, and for good.",
            ("delay",), "mirrortwin experiment delay", "Minutes.", headline=_delay,
        ),
        Exhibit(
            "unknown", "Unknown faults", "Whether it says “none of these” to what it never learnt.",
            ("unknown",), "mirrortwin experiment unknown", "Minutes.", headline=_unknown,
        ),
    )
}  # fmt: skip
