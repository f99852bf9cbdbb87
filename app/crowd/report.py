"""What a crowd met, for people and for ``models/results``."""

import plotly.graph_objects as go
from plotly.subplots import make_subplots

from app.crowd.measure import RUNS_A_READING, Crowd
from core.experiments.drawing import BLUE, INK, ORANGE, SKY, axis, finish
from core.experiments.results import Result

GOAL_P95_S = 0.5

BUSY = (
    "The machine was busy before the crowd came: delays say little of the server. Measure again "
    "when it is quiet."
)


def result(crowd: Crowd) -> Result:
    """What is kept in ``models/results``: the figures, and delays and memory as a picture."""
    return Result(
        name="crowd",
        settings={"goals": {"p95_s": GOAL_P95_S}},
        findings=crowd.to_dict(),
        figure=_figure(crowd),
        summary=tuple(lines(crowd)),
    )


def lines(crowd: Crowd) -> list[str]:
    """The figures in a few lines."""
    told = [f"{crowd.pages} pages, each with {crowd.flights.duration_s:g} s of flight of its own"]
    for number, each in enumerate(crowd.rounds, start=1):
        told.append(
            f"round {number}: samples {each.delays.median_s * 1e3:.0f} ms late in the middle, "
            f"{each.delays.p95_s * 1e3:.0f} ms at the 95th percentile, "
            f"{each.delays.max_s * 1e3:.0f} ms at most; server {each.server_mb:.0f} MB and "
            f"{each.cpu_share:.2f} cores; {each.mb_a_page:.2f} MB a page; "
            f"{each.strangers + each.foreign_flights} pages told of others' runs"
        )
    gone_s = crowd.unread.gone_s
    told.append(
        f"with one page that reads nothing: {crowd.unread.others.p95_s * 1e3:.0f} ms at the 95th "
        "percentile for the others; "
        + ("it was never let go" if gone_s is None else f"let go after {gone_s:.0f} s")
    )
    memory = ", ".join(f"{mb:.0f}" for mb in crowd.alone_mb)
    told.append(f"runs on one page, the server after each tenth: {memory} MB")
    return told


def _figure(crowd: Crowd) -> go.Figure:
    """Above, how late samples come in each round; below, the server's memory as runs go by."""
    figure = make_subplots(rows=2, cols=1, row_heights=[0.6, 0.4], vertical_spacing=0.22)
    delays = {f"Round {number}": each.delays for number, each in enumerate(crowd.rounds, start=1)}
    delays["One page reads nothing"] = crowd.unread.others
    for title, colour, measure in (
        ("Median", SKY, "median_s"),
        ("95th percentile", BLUE, "p95_s"),
    ):
        figure.add_bar(
            x=list(delays), y=[getattr(each, measure) for each in delays.values()], name=title,
            marker_color=colour, row=1, col=1,
        )  # fmt: skip
    figure.add_hline(GOAL_P95_S, line={"color": INK, "dash": "dash"}, row=1, col=1)
    runs = [RUNS_A_READING * number for number in range(1, len(crowd.alone_mb) + 1)]
    figure.add_scatter(
        x=runs, y=crowd.alone_mb, name="Server, runs on one page", mode="lines+markers",
        line={"color": ORANGE, "width": 2.5}, row=2, col=1,
    )  # fmt: skip
    figure.update_yaxes(axis("Delay of samples, s", rangemode="tozero"), row=1, col=1)
    figure.update_xaxes(axis(), row=1, col=1)
    figure.update_yaxes(axis("Memory, MB", rangemode="tozero"), row=2, col=1)
    figure.update_xaxes(axis("Runs", dtick=RUNS_A_READING), row=2, col=1)
    return finish(figure, width=760, height=560, barmode="group")
