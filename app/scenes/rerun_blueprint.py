"""The layout of a recording in the Rerun viewer: the flight in 3D, channels, residuals."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby

import rerun as rr
import rerun.blueprint as rrb

from app.scenes.geometry import Camera
from app.theme import VERTICAL_SCALE
from core.channels import CHANNELS, Channel, Subsystem, unit_label
from core.cylinders import CYLINDERS

TIMELINE = "t"
_TAB_ORDER: tuple[Subsystem, ...] = ("engine", "oil", "fuel", "electrical", "flight")


@dataclass(frozen=True, slots=True)
class Plot:
    """Channels that share an axis: one wide entity. ``columns`` are their places in the table."""

    path: str
    title: str
    subsystem: Subsystem
    channels: tuple[Channel, ...]
    columns: tuple[int, ...]


def _plots() -> tuple[Plot, ...]:
    """One plot for channels that lie together in the table and share unit and gauge span."""

    def axis(item: tuple[int, Channel]) -> tuple[str, str, float]:
        return item[1].subsystem, item[1].unit, item[1].full_scale

    plots = []
    for _, group in groupby(enumerate(CHANNELS), key=axis):
        columns, channels = zip(*group, strict=True)
        first = channels[0]
        label = first.label.rstrip(" 0123456789") if len(channels) > 2 else " and ".join(
            [first.label, *(channel.label.lower() for channel in channels[1:])]
        )  # fmt: skip
        unit = unit_label(first.unit)
        path = "/channels/" + "_".join(channel.name.split()[-1] for channel in channels)
        plots.append(Plot(path, f"{label}, {unit}", first.subsystem, channels, columns))
    return tuple(plots)


PLOTS = _plots()


def blueprint(camera: Camera, floor_km: float, duration_s: float) -> rrb.Blueprint:
    """The layout, with the camera, the ground and the length of one flight."""
    whole = rr.TimeRange(
        start=rr.TimeRangeBoundary.absolute(seconds=0.0),
        end=rr.TimeRangeBoundary.absolute(seconds=duration_s),
    )
    time_axis = rrb.TimeAxis(view_range=whole)
    scene = rrb.Spatial3DView(
        origin="/scene",
        name=f"Flight path, grid 1 km, heights x{VERTICAL_SCALE:g}",
        line_grid=rrb.LineGrid3D(
            visible=True,
            spacing=1.0,
            plane=rr.components.Plane3D.XY.with_distance(floor_km),
            stroke_width=1.0,
            color=(128, 138, 150, 110),
        ),
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital,
            position=camera.position,
            look_target=camera.look_at,
            eye_up=(0.0, 0.0, 1.0),
        ),
    )
    notes = rrb.TextDocumentView(origin="/run", name="Run")
    return _bare(
        rrb.Horizontal(
            rrb.Tabs(scene, notes),
            rrb.Vertical(
                rrb.Tabs(*_tabs(time_axis), active_tab=0), _residuals(time_axis), row_shares=[4, 3]
            ),
            column_shares=[3, 2],
        )
    )


def narrow_blueprint() -> rrb.Blueprint:
    """The layout of any flight on a narrow screen: one view below the other.

    It depends on neither the path nor the length of the flight: the camera follows the aircraft.
    """
    ever = rr.TimeRangeBoundary.infinite()
    axis = rrb.TimeAxis(view_range=rr.TimeRange(start=ever, end=ever))
    scene = rrb.Spatial3DView(
        origin="/scene",
        name="Flight path",
        eye_controls=rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, tracking_entity="/scene/faulted", eye_up=(0.0, 0.0, 1.0)
        ),
    )
    tabs = rrb.Tabs(_residuals(axis), *_tabs(axis), active_tab=0)
    return _bare(rrb.Vertical(scene, tabs, row_shares=[1, 1]))


def _residuals(time_axis: rrb.TimeAxis) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        origin="/residuals",
        name="Residuals, % of gauge span",
        axis_x=time_axis,
        plot_legend=rrb.PlotLegend(visible=False),
    )


def _bare(views: rrb.Horizontal | rrb.Vertical) -> rrb.Blueprint:
    """The views without the viewer's own panels: the page around has its own."""
    return rrb.Blueprint(
        views,
        rrb.TopPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=TIMELINE, play_state="following"),
        auto_layout=False,
        auto_views=False,
    )


def _tabs(time_axis: rrb.TimeAxis) -> Iterable[rrb.View | rrb.Vertical]:
    """A tab for each plot of the four cylinders, then one for each subsystem's other plots."""
    for plot in reversed(PLOTS):
        if len(plot.channels) == len(CYLINDERS):
            yield _view(plot, time_axis)
    for subsystem in _TAB_ORDER:
        views = [
            _view(plot, time_axis)
            for plot in PLOTS
            if plot.subsystem == subsystem and len(plot.channels) < len(CYLINDERS)
        ]
        yield rrb.Vertical(*views, name=subsystem.capitalize()) if len(views) > 1 else views[0]


def _view(plot: Plot, time_axis: rrb.TimeAxis) -> rrb.TimeSeriesView:
    """A plot; with a legend only where colours mark cylinders or sides."""
    legend = rrb.PlotLegend(rrb.Corner2D.LeftBottom, visible=len(plot.channels) > 1)
    return rrb.TimeSeriesView(
        origin=plot.path, name=plot.title, axis_x=time_axis, plot_legend=legend
    )
