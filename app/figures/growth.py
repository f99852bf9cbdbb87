"""A failure mode's residuals as it grows: one small chart a channel, three severities in each."""

from app import theme
from app.figures.axes import Figure, bare_layout, kept_rows, moments, onset_mark, packed, time_axis
from core.channels import CHANNELS, unit_label
from core.experiments.signs.growth import GROWTH_ONSET_S, GROWTH_PLAN, Growth

GROWTH_POINTS = 500

SEVERITY_DASHES = ("dot", "dash", "solid")
WIDTHS = (1.2, 1.5, 2.2)
"""From mild to severe: distinct without colour."""


def growth_figure(growth: Growth, index: int) -> Figure:
    """Residual of the channel at ``index`` against time, a line a severity, in the unit of it."""
    channel = CHANNELS[index]
    unit = unit_label(channel.unit)
    traces = []
    for (severity, residual), dash, width in zip(
        sorted(growth.residuals.items()), SEVERITY_DASHES, WIDTHS, strict=True
    ):
        rows = kept_rows(growth.time_s, residual[:, index], GROWTH_POINTS)
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "name": f"severity {severity:g}",
                "x": moments(growth.time_s[rows]),
                "y": packed(residual[rows, index]),
                "line": {"color": theme.RESIDUAL, "dash": dash, "width": width},
                "hovertemplate": f"%{{y:+.{channel.decimals}f}} {unit}",
            }
        )
    layout = bare_layout(
        margin={"l": 44, "r": 10, "t": 6, "b": 20},
        xaxis=time_axis(GROWTH_PLAN.duration_s, nticks=4),
        yaxis={"zeroline": True, "ticks": "", "nticks": 5, "fixedrange": True},
        shapes=onset_mark(GROWTH_ONSET_S),
    )
    return {"data": traces, "layout": layout}
