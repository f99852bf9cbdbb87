"""Reports for download: Markdown, or one HTML file with its plots that needs no network.

Both name the run, the models and versions behind it, and say that the flight was simulated.
"""

import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from core.channels import CHANNEL_INDEX
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.outcome import Outcome
from core.report.blocks import Block, Item, Listing, Paragraph, Table, blocks
from core.report.case.wording import label, plain, unit_of
from core.report.check.metrics import CHECKED, HOW_CHECKED, MEASURES
from core.report.grounded import GroundedReport, GroundedSentence
from core.report.sections import SECTIONS
from core.report.statement import Run
from core.report.template.cross_check import TABLE_HEAD
from core.twin.trajectory import Pair

SIMULATED = (
    "Simulated flight: both aircraft were flown by MirrorTwin in JSBSim. This is not a record of a "
    "real aircraft and no basis for its maintenance."
)

SHADED = "Shaded: from the first departure to the end of what the report cites."
"""What the shaded part of a plot is: the interval in the report's table."""

MAX_PLOTS = 6
"""Channels drawn, those that moved most."""

PLOT_STEP = 50
"""Every 50th sample is drawn: one a second, which is enough for a page."""

FAULTED, MIRROR = "#D55E00", "#0072B2"
"""Colours of both flights on paper (Okabe and Ito: apart for every eye)."""

_BAND = "rgba(213, 94, 0, 0.10)"

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1b1f24; margin: 2rem auto; max-width: 52rem;
       padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin-top: 1.8rem; }
table { border-collapse: collapse; font-size: 0.9rem; width: 100%; }
th, td { border-bottom: 1px solid #d8dee4; padding: 0.25rem 0.5rem; text-align: left; }
.simulated { border: 1px solid #9a6700; border-radius: 6px; padding: 0.5rem 0.8rem; }
.outcome { font-size: 1.05rem; } summary { cursor: pointer; margin-top: 1.8rem; }
.note { color: #57606a; } del { color: #82071e; }
@media print { body { margin: 0; max-width: none; } }
"""


@dataclass(frozen=True, slots=True, eq=False)
class Exported:
    """The content of a file. ``identity``: what the run is (id, plan, versions...), for people.

    ``outcome``: the injected fault and the diagnosis, None where the fault is not known.
    """

    identity: Mapping[str, str]
    diagnosis: Diagnosis
    report: GroundedReport
    pair: Pair | None = None
    outcome: Outcome | None = None

    @property
    def about(self) -> dict[str, str]:
        """The run's identity with writer, classifier and conditions."""
        return {
            **self.identity,
            "Classifier": f"{self.diagnosis.model}, {self.diagnosis.conditions} conditions",
            "Written by": self.report.writer,
        }

    @property
    def checks(self) -> list[tuple[str, str]]:
        """The measures of the report, each spelt out, with its value and what is best."""
        measured = self.report.final.to_dict()
        return [(name, f"{measured[key]:.2f} ({best})") for key, (name, best) in MEASURES.items()]

    @property
    def struck(self) -> list[tuple[str, str]]:
        """The sentences that were struck, each with the reason."""
        return [
            (item.checked.plain, "; ".join(item.checked.reasons))
            for item in self.report.sentences
            if not item.kept
        ]


def to_markdown(given: Exported) -> str:
    """The report as Markdown."""
    about = "\n".join(f"- {name}: {plain(value)}" for name, value in given.about.items())
    line = "" if given.outcome is None else f"**{plain(given.outcome.line)}**\n\n"
    head = f"# Diagnostic report\n\n**{SIMULATED}**\n\n{line}{about}"
    parts = [head, given.report.markdown]
    if given.report.notes:
        parts.append("## Notes\n\n" + "\n".join(f"- {plain(note)}" for note in given.report.notes))
    if given.struck:
        lines = [f"- ~~{plain(text)}~~ ({plain(reason)})" for text, reason in given.struck]
        parts.append("## Struck\n\n" + "\n".join(lines))
    checks = "\n".join(f"- {name}: {value}" for name, value in given.checks)
    parts.append(f"## {CHECKED}\n\n{HOW_CHECKED}\n\n{checks}")
    return "\n\n".join(parts) + "\n"


def to_html(given: Exported) -> str:
    """The report as one HTML file, plots and all, that loads nothing from anywhere."""
    about = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
        for name, value in given.about.items()
    )
    notes = "".join(f"<p class='note'>{html.escape(note)}</p>" for note in given.report.notes)
    struck = "".join(
        f"<li><del>{html.escape(text)}</del> {html.escape(reason)}</li>"
        for text, reason in given.struck
    )
    plots = "" if given.pair is None else _plots(given.pair, given.diagnosis)
    line = "" if given.outcome is None else html.escape(given.outcome.line)
    checks = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
        for name, value in given.checks
    )
    return "\n".join(
        [
            "<!doctype html><html lang='en'><head><meta charset='utf-8'>",
            "<meta name='viewport' content='width=device-width, initial-scale=1'>",
            f"<title>Diagnostic report</title><style>{_STYLE}</style></head><body>",
            f"<h1>Diagnostic report</h1><p class='simulated'>{html.escape(SIMULATED)}</p>",
            f"<p class='outcome'><strong>{line}</strong></p>" if line else "",
            f"<table>{about}</table>{notes}",
            _sections(given.report),
            f"<h2>Plots</h2>{plots}" if plots else "",
            f"<h2>Struck</h2><ul>{struck}</ul>" if struck else "",
            f"<details><summary>{CHECKED}</summary><p>{HOW_CHECKED}</p>",
            f"<table>{checks}</table></details>",
            "</body></html>\n",
        ]
    )


def _sections(report: GroundedReport) -> str:
    parts: list[str] = []
    for section in SECTIONS:
        parts.append(f"<h2>{section.title}</h2>")
        parts += map(_block, blocks(report.section(section.title)))
    return "\n".join(parts)


def _block(block: Block) -> str:
    """A block as HTML; whatever the text holds stays text."""
    match block:
        case Paragraph():
            return f"<p>{_text(block.sentences)}</p>"
        case Listing():
            items = "\n".join(map(_item, block.items))
            return f"<ol>\n{items}\n</ol>" if block.is_numbered else f"<ul>\n{items}\n</ul>"
        case Table():
            head = _row("th", TABLE_HEAD)
            rows = "\n".join(_row("td", row.checked.cells) for row in block.rows)
            return f"<table>\n<thead>{head}</thead>\n<tbody>{rows}</tbody>\n</table>"


def _item(item: Item) -> str:
    value = "" if item.number is None else f' value="{item.number}"'
    return f"<li{value}>{_text(item.sentences)}{''.join(map(_block, item.below))}</li>"


def _row(tag: str, cells: Sequence[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"


def _text(sentences: Sequence[GroundedSentence]) -> str:
    return " ".join("".join(map(_run, item.checked.runs)) for item in sentences)


def _run(run: Run) -> str:
    text = html.escape(run.text)
    return text if run.style == "plain" else f"<{run.style}>{text}</{run.style}>"


def evidence_figure(pair: Pair, diagnosis: Diagnosis) -> go.Figure:
    """The channels that moved most, faulted over mirror, each with its interval shaded."""
    # Plotly looks for pandas among the loaded modules, and fails on one that another thread is
    # still loading: wait for that here.
    import_module("pandas")
    items = diagnosis.evidence[:MAX_PLOTS]
    figure = make_subplots(
        rows=max(1, len(items)),
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.04,
        subplot_titles=[f"{label(item.channel)}, {unit_of(item.channel)}" for item in items],
    )
    time_s = pair.faulted.time_s[::PLOT_STEP]
    for row, item in enumerate(items, start=1):
        index = CHANNEL_INDEX[item.channel]
        for name, flight, colour in (
            ("healthy mirror", pair.mirror, MIRROR),
            ("faulted", pair.faulted, FAULTED),
        ):
            values = flight.channels[::PLOT_STEP, index]
            line = {"color": colour, "width": 1.5}
            figure.add_scatter(
                x=time_s, y=values, name=name, line=line, showlegend=row == 1, row=row, col=1
            )
        # Opaque: the template would make the band too pale to see.
        figure.add_vrect(
            x0=item.start_s, x1=item.end_s, fillcolor=_BAND, opacity=1.0, line_width=0,
            layer="below", row=row, col=1,
        )  # fmt: skip
    figure.update_xaxes(title_text="time of flight, s", row=max(1, len(items)), col=1)
    figure.update_layout(
        template="simple_white",
        height=120 + 150 * max(1, len(items)),
        margin={"l": 60, "r": 20, "t": 40, "b": 50},
        legend={"orientation": "h", "y": 1.06},
    )
    return figure


def _plots(pair: Pair, diagnosis: Diagnosis) -> str:
    if not diagnosis.evidence:
        return "<p>No channel left its noise.</p>"
    config: dict[str, Any] = {"displaylogo": False, "responsive": True}
    figure = evidence_figure(pair, diagnosis).to_html(
        full_html=False, include_plotlyjs=True, config=config
    )
    return f"<p class='note'>{SHADED}</p>{figure}"
