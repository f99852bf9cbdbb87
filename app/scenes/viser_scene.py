"""One browser session's live 3D scene: the adapter around a viser server of its own.

Isolation is by construction: each session has its own `viser.ViserServer` on a loopback port of
its own, which answers only to `app.scenes.viser_proxy`, by a key that never leaves this process.
"""

import secrets
import threading

import numpy as np
import rich
import viser
from viser import _messages as viser_messages
from viser.infra import WebsockClientConnection

from app.scenes import geometry
from app.scenes.cameras import VIEWS, View, following
from app.scenes.geometry import Array, Camera, Poses
from app.scenes.painting import Legend, Paint, Readings, colours_at, legend_of
from app.scenes.viser_drawing import DRAWN_POINTS, Drawing, Hold
from core.errors import InputError
from core.jobs.events import Samples
from core.twin.plan import Plan
from core.twin.trajectory import Pair

KEY_HEADER = "X-MirrorTwin-Key"

_READ_STRIDE = 10
"""Readings kept for colours: 5 a second, as many as poses."""


class ViserScene:
    """Both aircraft, their paths and the gap between them. Methods may be called from any thread.

    Nothing is drawn while no page looks, only stored: most pages have their scene folded away or
    show the other one. A page that opens the scene sees its current state.
    `extend` takes about a millisecond of drawing, `show` a few; `stop` may take a second.
    """

    def __init__(self) -> None:
        """Start a viser server on a free loopback port (some 3 ms)."""
        self.key = secrets.token_urlsafe(24)
        self._lock = threading.RLock()
        # viser announces its start and its end on stdout, where nobody asked: keep each quiet in
        # the thread that says it.
        with rich.get_console().capture():
            self._server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        self._server.get_event_loop().call_soon_threadsafe(rich.get_console().begin_capture)
        self._refuse_strangers()
        self._drawing = Drawing(self._server.scene)
        self._dark = False
        self._duration_s = 300.0
        self._onset_s: float | None = None
        self._faulted: Poses | None = None
        self._mirror: Poses | None = None
        self._readings: Readings | None = None
        self._paint: Paint | None = None
        self._view: View = "whole"
        self._time_s = 0.0
        self._camera: Camera | None = None
        self._stage: tuple[Array, float] | None = None
        self._aspects: dict[int, float] = {}
        self._watchers = 0
        self._is_drawn = False
        usual = geometry.expected_points(Poses.start(Plan()), self._duration_s)
        self._begin_at(geometry.framed(usual, Plan().heading_deg))
        self._server.on_client_connect(self._welcome)
        self._server.on_client_disconnect(self._forget)

    @property
    def port(self) -> int:
        """The loopback port of this scene's viser server."""
        return self._server.get_port()

    @property
    def viewers(self) -> int:
        """How many pages look at this scene now."""
        return self._watchers

    def watch(self) -> None:
        """Note a viewer, before its socket is opened: draw now, and from now on."""
        with self._lock:
            self._watchers += 1
            if not self._is_drawn:
                self._redraw()

    def leave(self) -> None:
        """Note that a viewer has left."""
        with self._lock:
            self._watchers -= 1

    @property
    def dark(self) -> bool:
        """Whether the scene is drawn for a dark page."""
        return self._dark

    @dark.setter
    def dark(self, dark: bool) -> None:
        with self._lock:
            if dark != self._dark:
                self._dark = dark
                self._redraw()

    def reset(self, duration_s: float = 300.0, onset_s: float | None = None) -> None:
        """Empty the scene for a flight of ``duration_s``, whose fault begins at ``onset_s``."""
        with self._lock:
            self._duration_s, self._onset_s = duration_s, onset_s
            self._faulted = self._mirror = self._camera = self._stage = self._readings = None
            self._time_s = 0.0
            self._redraw()

    def paint(self, paint: Paint | None) -> None:
        """Colour the faulted path by a channel or a residual, in this run and those to come."""
        with self._lock:
            self._paint = paint
            self._draw_flights()

    def legend(self) -> Legend | None:
        """The key of the colours for the flight so far, None while nothing is painted."""
        with self._lock:
            if self._paint is None or self._readings is None:
                return None
            return legend_of(self._paint, self._readings)

    def look(self, view: View) -> None:
        """Turn every page's camera to a view: the whole flight, following it, or free."""
        if view not in VIEWS:
            raise InputError("view", f"must be {', '.join(VIEWS)}, got {view!r:.20}")
        with self._lock:
            self._view = view
            for client in self._server.get_clients().values():
                self._aim(client)

    def extend(self, samples: Samples) -> None:
        """Draw the next samples of both flights. Samples that start again at 0 start it again."""
        with self._lock:
            faulted = Poses.of(samples.time_s, samples.faulted_states)
            mirror = Poses.of(samples.time_s, samples.mirror_states)
            readings = Readings(
                np.asarray(samples.time_s, np.float64), samples.faulted, samples.mirror
            )
            self._time_s = float(mirror.time_s[-1])
            if self._faulted is None or self._mirror is None or samples.index == 0:
                self._faulted, self._mirror, self._readings = faulted, mirror, readings
                self._redraw()
            else:
                assert self._readings is not None
                self._readings = self._readings.joined(readings)
                self._faulted = self._faulted.joined(faulted)
                self._mirror = self._mirror.joined(mirror)
                self._draw_flights()

    def show(self, pair: Pair, onset_s: float | None) -> None:
        """Draw a whole run; ``onset_s`` None marks no onset."""
        with self._lock:
            is_marked_anew, self._onset_s = onset_s != self._onset_s, onset_s
            self._faulted = Poses.of_flight(pair.faulted)
            self._mirror = Poses.of_flight(pair.mirror)
            thin = pair[::_READ_STRIDE]
            self._readings = Readings(
                thin.mirror.time_s, thin.faulted.channels, thin.mirror.channels
            )
            self._duration_s = self._time_s = float(pair.mirror.time_s[-1])
            if is_marked_anew:
                self._redraw()
            else:
                self._draw_flights()

    def seek(self, time_s: float | None) -> None:
        """Move both aircraft to where they were at ``time_s``; None: where they were last.

        Nothing to do in an empty scene.
        """
        with self._lock:
            if self._mirror is None:
                return
            self._time_s = float(self._mirror.time_s[-1]) if time_s is None else time_s
            if self._is_seen():
                with self._server.atomic():
                    self._place()

    def stop(self) -> None:
        """Stop the viser server and disconnect its pages. Blocks for up to a second."""
        self._server.stop()

    def _is_seen(self) -> bool:
        """Whether to draw a change; if not, it is noted for the next viewer."""
        self._is_drawn = self._is_drawn and self._watchers > 0
        return self._is_drawn

    def _redraw(self) -> None:
        """Draw everything again."""
        self._is_drawn = self._watchers > 0
        if not self._is_drawn:
            return
        with self._server.atomic():
            self._server.gui.configure_theme(
                dark_mode=self._dark, show_logo=False, show_share_button=False
            )
            self._drawing.clear(self._dark)
            self._draw_flights()

    def _draw_flights(self) -> None:
        if self._faulted is None or self._mirror is None or not self._is_seen():
            return
        colours = None
        if self._paint is not None and self._readings is not None:
            drawn_s = self._faulted.thinned(DRAWN_POINTS).time_s
            colours = colours_at(self._paint, self._readings, drawn_s)
        with self._server.atomic():
            self._drawing.draw(self._faulted, self._mirror, self._onset_s, colours)
            self._frame()
            self._place()

    def _place(self) -> None:
        assert self._faulted is not None and self._mirror is not None and self._camera is not None
        origin_ft = float(self._mirror.values[0, 2])
        wingspan_km = geometry.wingspan_km(self._camera)
        mirror, faulted = self._mirror.at(self._time_s), self._faulted.at(self._time_s)
        for name, pose in (("mirror", mirror), ("faulted", faulted)):
            self._drawing.place(name, pose, origin_ft, wingspan_km, self._hold())
        self._drawing.part(faulted, mirror, origin_ft)
        if self._view in ("chase", "side"):
            for client in self._server.get_clients().values():
                self._aim(client)

    def _hold(self) -> Hold:
        """Which part of the aircraft's texts to hold: the whole flight runs from left to right."""
        if self._view in ("chase", "side"):
            return "center"
        share = self._time_s / self._duration_s
        return "left" if share < 0.3 else "right" if share > 0.7 else "center"

    def _frame(self) -> None:
        """Aim the camera at the whole flight to come; again only if the flight leaves the view.

        The viewer's own view is thus left alone while a run goes as expected.
        """
        assert self._faulted is not None and self._mirror is not None
        origin_ft = float(self._mirror.values[0, 2])
        points = np.concatenate([
            geometry.drawn_positions(poses.thinned(200), origin_ft)
            for poses in (self._faulted, self._mirror)
        ])  # fmt: skip
        if self._camera is not None and geometry.in_view(self._camera, points):
            return
        here = self._mirror.at(0.0)
        points = np.concatenate([points, geometry.expected_points(here, self._duration_s)])
        self._stage = points, float(here.values[0, 5])
        self._camera = camera = geometry.framed(*self._stage)
        clients = self._server.get_clients().values()
        for client in clients:
            self._aim(client)
        if not clients:
            # Only then: in a page that is open already, this would race with its own camera.
            self._begin_at(camera)

    def _begin_at(self, camera: Camera) -> None:
        """The camera of a page just opened, until it is welcomed with one of its own."""
        start = self._server.initial_camera
        start.position, start.look_at, start.fov = camera.position, camera.look_at, camera.fov

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Aim a new page's camera, now and whenever its window changes shape."""

        def reshaped(camera: viser.CameraHandle) -> None:
            if abs(np.log(_aspect(camera) / self._aspects.get(client.client_id, 1.0))) > 0.05:
                self._aim(client)

        client.camera.on_update(reshaped)
        self._aim(client)

    def _forget(self, client: viser.ClientHandle) -> None:
        self._aspects.pop(client.client_id, None)

    def _aim(self, client: viser.ClientHandle) -> None:
        """Turn one page's camera: to the whole stage in the shape of its window, or along."""
        with self._lock:
            aspect = self._aspects[client.client_id] = _aspect(client.camera)
            camera = self._camera_for(aspect)
            if camera is None:
                return
            with client.atomic():
                client.camera.fov = camera.fov
                client.camera.position = camera.position
                client.camera.look_at = camera.look_at

    def _camera_for(self, aspect: float) -> Camera | None:
        """Where the chosen view looks from now; None where it is the viewer's own."""
        if self._view == "free" or self._stage is None:
            return None
        if self._view == "whole":
            return geometry.framed(*self._stage, aspect=aspect)
        assert self._faulted is not None and self._mirror is not None and self._camera is not None
        return following(
            self._view,
            self._faulted.at(self._time_s),
            self._mirror.at(self._time_s),
            float(self._mirror.values[0, 2]),
            geometry.wingspan_km(self._camera),
        )

    def _refuse_strangers(self) -> None:
        """Close what viser leaves open: its public share tunnel, and its port to other programs.

        viser takes a socket from any web page and any local user. It offers no hook for that, so
        this reaches into its (pinned) internals: a connection without our key is closed before
        anything is sent to it.
        """
        server = self._server._websock_server
        server.unregister_handler(viser_messages.ShareUrlRequest)
        server.unregister_handler(viser_messages.ShareUrlDisconnect)

        async def check_key(client: WebsockClientConnection) -> None:
            connection = server._live_connections[client.client_id]
            assert connection.request is not None
            offered = connection.request.headers.get(KEY_HEADER, "")
            if not secrets.compare_digest(offered.encode(), self.key.encode()):
                await connection.close(1008, "not for you")

        server.on_client_connect(check_key)


def _aspect(camera: viser.CameraHandle) -> float:
    """Width over height of a page's view, as far as a camera can be set for it."""
    if camera.image_width == 0 or camera.image_height == 0:
        return geometry.ASPECT
    return float(np.clip(camera.image_width / camera.image_height, 0.5, 3.0))
