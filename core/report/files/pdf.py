"""A report as PDF, set by Typst: one wheel with compiler and fonts, no system package.

The text is data and is never read as Typst markup, whichever writer wrote it; the page is designed
in ``assets/data/report/report.typ``.
"""

import json
from collections.abc import Sequence
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import typst

from core.channels import CHANNEL_INDEX, channel
from core.clock import clock
from core.diagnosis.diagnosis import Evidence
from core.errors import MirrorTwinError
from core.paths import DATA
from core.report.blocks import Block, Listing, Paragraph, Table, blocks
from core.report.case.wording import label, unit_of
from core.report.check.metrics import CHECKED, HOW_CHECKED
from core.report.files.export import (
    FAULTED,
    MAX_PLOTS,
    MIRROR,
    PLOT_STEP,
    SHADED,
    SIMULATED,
    Exported,
)
from core.report.grounded import GroundedReport, GroundedSentence
from core.report.sections import SECTIONS
from core.report.statement import Run
from core.report.template.cross_check import TABLE_HEAD
from core.twin.trajectory import Pair

TITLE = "Diagnostic report"

_PAGE = DATA / "report" / "report.typ"

_WIDTH, _HEIGHT = 680, 120
_LEFT, _RIGHT, _TOP, _BOTTOM = 48, 18, 6, 18
"""A plot's size and margins, in SVG units."""

Blocks = list[dict[str, Any]]


def to_pdf(given: Exported) -> bytes:
    """The report as PDF: its identity, its text, its plots, what was struck, how it was checked."""
    pair = given.pair
    items = given.diagnosis.evidence[:MAX_PLOTS] if pair is not None else ()
    data = {
        "title": TITLE,
        "footer": f"{given.identity.get('Run', '')}, simulated flight",
        "simulated": SIMULATED,
        "outcome": "" if given.outcome is None else given.outcome.line,
        "about": list(given.about.items()),
        "notes": list(given.report.notes),
        "blocks": _sections(given.report),
        "legend": f"Orange: faulted. Blue: healthy mirror. {SHADED} Flight time.",
        "plots": [
            {"title": f"{label(item.channel)}, {unit_of(item.channel)}", "svg": _svg(pair, item)}
            for item in items
            if pair is not None
        ],
        "struck": given.struck,
        "checked": CHECKED,
        "how_checked": HOW_CHECKED,
        "checks": given.checks,
    }
    try:
        page: bytes = typst.compile(
            _PAGE.read_bytes(), sys_inputs={"data": json.dumps(data)}, ignore_system_fonts=True
        )
    except (RuntimeError, typst.TypstError) as error:
        raise MirrorTwinError(f"the report cannot be set as PDF: {error}") from None
    return page


def _sections(report: GroundedReport) -> Blocks:
    """The sections as the page takes them: headings, paragraphs, lists and tables of runs."""
    found: Blocks = []
    for section in SECTIONS:
        found.append({"kind": "heading", "runs": [_run(Run(section.title))]})
        found += map(_block, blocks(report.section(section.title)))
    return found


def _block(block: Block) -> dict[str, Any]:
    match block:
        case Paragraph():
            return _paragraph(block.sentences)
        case Listing():
            items = [[_paragraph(item.sentences), *map(_block, item.below)] for item in block.items]
            if not block.is_numbered:
                return {"kind": "bullets", "items": items}
            return {"kind": "numbers", "start": block.items[0].number, "items": items}
        case Table():
            head = [[_run(Run(cell))] for cell in TABLE_HEAD]
            rows = [
                [{"runs": [_run(Run(cell))]} for cell in row.checked.cells] for row in block.rows
            ]
            return {"kind": "table", "rows": [head, *rows]}


def _paragraph(sentences: Sequence[GroundedSentence]) -> dict[str, Any]:
    runs = [run for item in sentences for run in (*item.checked.runs, Run(" "))]
    return {"kind": "paragraph", "runs": list(map(_run, runs[:-1]))}


def _run(run: Run) -> dict[str, str]:
    return {"text": run.text, "style": run.style}


def _svg(pair: Pair, item: Evidence) -> str:
    """One channel against time, faulted over mirror, with the interval of the evidence shaded."""
    time_s = pair.faulted.time_s[::PLOT_STEP]
    lines = [
        (colour, flight.channels[::PLOT_STEP, CHANNEL_INDEX[item.channel]])
        for colour, flight in ((MIRROR, pair.mirror), (FAULTED, pair.faulted))
    ]
    low = min(float(values.min()) for _, values in lines)
    high = max(float(values.max()) for _, values in lines)
    span = max(high - low, 0.01 * channel(item.channel).full_scale)
    floor = (low + high - span) / 2.0
    end_s = float(pair.faulted.time_s[-1])

    def x(time: Any) -> Any:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * np.asarray(time) / end_s

    def y(value: Any) -> Any:
        share = (np.asarray(value) - floor) / span
        return _TOP + (_HEIGHT - _TOP - _BOTTOM) * (1.0 - share)

    decimals = channel(item.channel).decimals
    bottom = _HEIGHT - _BOTTOM
    parts = [
        f'<rect x="{x(item.start_s):.1f}" y="{_TOP}" height="{bottom - _TOP}" '
        f'width="{x(item.end_s) - x(item.start_s):.1f}" fill="{FAULTED}" fill-opacity="0.1"/>'
    ]
    for value in (floor, floor + span):
        parts.append(_grid(f"M{_LEFT} {y(value):.1f}H{_WIDTH - _RIGHT}"))
        parts.append(_text(_LEFT - 5, float(y(value)) + 4, f"{value:.{decimals}f}", "end"))
    for time in np.linspace(0.0, end_s, 6):
        parts.append(_grid(f"M{x(time):.1f} {_TOP}V{bottom}"))
        parts.append(_text(float(x(time)), _HEIGHT - 4, clock(float(time)), "middle"))
    for colour, values in lines:
        points = " ".join(
            f"{left:.1f},{top:.1f}" for left, top in zip(x(time_s), y(values), strict=True)
        )
        parts.append(
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.3"/>'
        )
    size = f'width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{"".join(parts)}</svg>'


def _grid(path: str) -> str:
    return f'<path d="{path}" stroke="#d8dee4" stroke-width="0.8"/>'


def _text(left: float, top: float, said: str, anchor: str) -> str:
    return (
        f'<text x="{left:.1f}" y="{top:.1f}" text-anchor="{anchor}" font-size="11" '
        f'font-family="Libertinus Serif" fill="#56636f">{escape(said)}</text>'
    )
