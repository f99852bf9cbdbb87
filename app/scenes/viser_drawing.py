"""The drawing of a viser scene, as nodes that are updated in place while the flight grows."""

from typing import Literal

import numpy as np
import viser

from app.scenes import geometry
from app.scenes.cameras import apart_m, apart_words
from app.scenes.geometry import Array, Poses, drawn_height, drawn_positions
from app.scenes.mesh import WINGSPAN_M, aircraft_glb
from app.scenes.painting import Colours
from app.scenes.palette import FAULTED, MIRROR, RESIDUAL, Rgb, linear_light, palette

DRAWN_POINTS = 900
_CURTAIN_OPACITY = 0.07
_PLAIN_PX, _PAINTED_PX = 3.0, 5.0
_EMPTY_FLOOR_FT = -1000.0
_GHOST_OPACITY = 0.55
_GHOST_SWELL = 1.04
"""The ghost is drawn this much larger, so that it stays a halo where both aircraft coincide."""

_TITLES = {"faulted": "Faulted", "mirror": "Mirror"}
_PAINTS: dict[str, Rgb] = {"faulted": FAULTED, "mirror": MIRROR}


Hold = Literal["left", "center", "right"]
Anchor = Literal[
    "bottom-left", "bottom-center", "bottom-right", "top-left", "top-center", "top-right"
]
_ANCHORS: dict[tuple[Literal["bottom", "top"], Hold], Anchor] = {
    ("bottom", "left"): "bottom-left",
    ("bottom", "center"): "bottom-center",
    ("bottom", "right"): "bottom-right",
    ("top", "left"): "top-left",
    ("top", "center"): "top-center",
    ("top", "right"): "top-right",
}


class Drawing:
    """Draws both flights of a pair into one viser scene, in the world of `app.scenes.geometry`."""

    def __init__(self, scene: viser.SceneApi) -> None:
        """Draw into ``scene``; `clear` must be called before anything else."""
        self._scene = scene
        scene.configure_environment_map("city", environment_intensity=0.6)
        scene.configure_default_lights(cast_shadow=False)
        self._dark = False
        self._lines: dict[str, viser.LineSegmentsHandle] = {}
        self._ribbons: dict[str, viser.MeshHandle] = {}
        self._labels: dict[str, viser.LabelHandle] = {}
        self._aircraft: dict[str, viser.GlbHandle] = {}
        self._grid: viser.GridHandle | None = None
        self._floor_km = 0.0

    def clear(self, dark: bool) -> None:
        """Leave nothing but the empty grid, in the colours of the theme."""
        self._dark = dark
        self._floor_km = drawn_height(_EMPTY_FLOOR_FT, 0.0).item()
        self._scene.reset()
        for handles in (self._lines, self._ribbons, self._labels, self._aircraft):
            handles.clear()
        colours = palette(dark)
        self._grid = self._scene.add_grid(
            "/ground",
            cell_size=1.0,
            cell_color=colours.grid_cell,
            cell_thickness=1.0,
            section_size=5.0,
            section_color=colours.grid_section,
            section_thickness=1.4,
            infinite_grid=True,
            fade_distance=90.0,
            fade_strength=1.5,
            shadow_opacity=0.0,
            position=(0.0, 0.0, self._floor_km),
        )

    def draw(
        self, faulted: Poses, mirror: Poses, onset_s: float | None, colours: Colours | None = None
    ) -> None:
        """Draw both flights so far; ``onset_s`` None or outside them draws no mark.

        ``colours``: those of the faulted path's `DRAWN_POINTS`, (n, 3), None for the usual one.
        """
        origin_ft = float(mirror.values[0, 2])
        floor_ft = geometry.floor_ft(geometry.lowest_ft(faulted, mirror))
        self._floor_km = drawn_height(floor_ft, origin_ft).item()
        for name, poses in (("mirror", mirror), ("faulted", faulted)):
            points = drawn_positions(poses.thinned(DRAWN_POINTS), origin_ft)
            shadow = points * [1.0, 1.0, 0.0] + [0.0, 0.0, self._floor_km]
            self._segments(f"/{name}/shadow", geometry.segments(shadow), self._faint(name), 2.0)
            if name == "faulted":
                self._path(points, colours)
        self._segments("/mirror/path", geometry.dashes(mirror, origin_ft), MIRROR, 5.0)
        self._gap(faulted, mirror, origin_ft)
        self._surface(
            "/curtain",
            geometry.curtain(faulted, origin_ft, self._floor_km),
            palette(self._dark).onset,
            _CURTAIN_OPACITY,
        )
        self._ground(mirror, floor_ft)
        if onset_s is not None and onset_s <= faulted.time_s[-1]:
            self._onset(drawn_positions(faulted.at(onset_s), origin_ft)[0])

    def place(
        self, name: str, pose: Poses, origin_ft: float, wingspan_km: float, hold: Hold = "center"
    ) -> None:
        """Put one aircraft at a pose, drawn with this wingspan, its altitude beside it.

        ``hold``: which part of that text is at the aircraft; near an edge of the view, the one
        that keeps it in.
        """
        position = drawn_positions(pose, origin_ft)[0]
        wxyz = geometry.attitude(pose)[0]
        ghost = name == "mirror"
        scale = wingspan_km / WINGSPAN_M * (_GHOST_SWELL if ghost else 1.0)
        text = f"{_TITLES[name]} {pose.values[0, 2]:,.0f} ft"
        beside = position + np.array([0.0, 0.0, wingspan_km * (0.34 if ghost else -0.34)])
        foot = np.array([position[0], position[1], self._floor_km])
        self._segments(f"/{name}/drop", np.array([[position, foot]]), self._faint(name), 1.0)
        aircraft = self._aircraft.get(name)
        if aircraft is None:
            self._aircraft[name] = self._scene.add_glb(
                f"/{name}/aircraft",
                aircraft_glb(_PAINTS[name], _GHOST_OPACITY if ghost else 1.0),
                scale=scale, wxyz=wxyz, position=position,
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        else:
            aircraft.position, aircraft.wxyz, aircraft.scale = position, wxyz, scale
        self._label(name, text, beside, _ANCHORS["bottom" if ghost else "top", hold])

    def _label(self, name: str, text: str, position: Array, anchor: Anchor) -> None:
        """A text in the scene, added or updated in place."""
        label = self._labels.get(name)
        if label is None:
            self._labels[name] = self._scene.add_label(
                f"/labels/{name}", text, position=position, anchor=anchor
            )
        else:
            label.position, label.text, label.anchor = position, text, anchor

    def _faint(self, name: str) -> Rgb:
        """An aircraft's colour faded into the ground, for what it casts there."""
        ground = palette(self._dark).sky_bottom
        mixed = 0.35 * np.array(_PAINTS[name]) + 0.65 * np.array(ground)
        return int(mixed[0]), int(mixed[1]), int(mixed[2])

    def _segments(self, name: str, segments: Array, colour: Rgb, width_px: float) -> None:
        """Line segments (n, 2, 3), added or updated in place."""
        if len(segments) == 0:
            return
        handle = self._lines.get(name)
        if handle is not None:
            handle.points = segments.astype(np.float32)
            return
        self._lines[name] = self._scene.add_line_segments(
            name, segments, colour, thickness=width_px, thickness_units="screen"
        )

    def part(self, faulted: Poses, mirror: Poses, origin_ft: float) -> None:
        """Draw the distance between both aircraft at one time: a line, and its true length."""
        ends = [drawn_positions(pose, origin_ft)[0] for pose in (faulted, mirror)]
        self._segments("/apart", np.array([ends]), RESIDUAL, 4.0)
        words = apart_words(apart_m(faulted, mirror))
        label = self._labels["faulted"]
        label.text = f"{label.text}, {words}" if words else label.text

    def _path(self, points: Array, colours: Colours | None) -> None:
        """The faulted path, in one colour or painted point by point."""
        if len(points) < 2:
            return
        if colours is None:
            colours = np.tile(np.array(FAULTED, dtype=np.uint8), (len(points), 1))
            width = _PLAIN_PX
        else:
            width = _PAINTED_PX
        segments = geometry.segments(points).astype(np.float32)
        linear = linear_light(colours)
        painted = np.stack([linear[:-1], linear[1:]], axis=1)
        line = self._lines.get("/faulted/path")
        if line is None:
            # With a colour for each end from the start: viser's client cannot turn to that later.
            self._lines["/faulted/path"] = self._scene.add_line_segments(
                "/faulted/path", segments, painted, thickness=width, thickness_units="screen"
            )
        else:
            line.points, line.colors, line.thickness = segments, painted, width

    def _gap(self, faulted: Poses, mirror: Poses, origin_ft: float) -> None:
        """The effect of the fault: the surface between both flights at equal times, with rungs."""
        self._surface("/gap", geometry.gap(faulted, mirror, origin_ft), FAULTED, 0.16)
        rungs = geometry.rungs(faulted, mirror, origin_ft)
        self._segments("/gap/rungs", rungs, FAULTED, 1.0)

    def _surface(self, name: str, surface: geometry.Surface, colour: Rgb, opacity: float) -> None:
        """A translucent surface, added or updated in place."""
        vertices, faces = surface
        ribbon = self._ribbons.get(name)
        if ribbon is None:
            self._ribbons[name] = self._scene.add_mesh_simple(
                name, vertices, faces, color=colour, opacity=opacity, side="double",
                cast_shadow=False, receive_shadow=False,
            )  # fmt: skip
        else:
            ribbon.vertices = vertices.astype(np.float32)

    def _ground(self, mirror: Poses, floor_ft: float) -> None:
        """Set the grid to its altitude and write the altitude on it, under the start."""
        assert self._grid is not None
        self._grid.position = (0.0, 0.0, self._floor_km)
        east_km, north_km = mirror.values[0, 1] / 1000.0, mirror.values[0, 0] / 1000.0
        start = np.array([east_km, north_km, self._floor_km])
        self._label("ground", f"{floor_ft:,.0f} ft", start, "top-center")

    def _onset(self, point: Array) -> None:
        """Mark the onset of the fault: a post from the ground to the path."""
        foot = np.array([point[0], point[1], self._floor_km])
        colour = palette(self._dark).onset
        self._segments("/onset/post", np.array([[foot, point]]), colour, 2.0)
        self._label("onset", "Fault begins", foot, "top-center")
