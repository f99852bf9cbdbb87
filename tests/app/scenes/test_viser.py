"""A viser scene belongs to one browser session, and nobody else gets near it."""

import asyncio
import secrets
import time
from typing import Any

import httpx
import msgspec
import psutil
import pytest
import viser
import zstandard
from scenes_support import Flown, Site
from viser import _messages as viser_messages
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from app.scenes.viser_proxy import ViserScenes
from app.scenes.viser_scene import ViserScene
from core.errors import InputError

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")


def new_session() -> str:
    """An id as the app makes them."""
    return secrets.token_urlsafe(16)


def read(frame: bytes) -> list[dict[str, Any]]:
    """The messages in one frame of viser's protocol."""
    size = int.from_bytes(frame[8:16], "little")
    messages = msgspec.msgpack.decode(zstandard.decompress(frame[16 : 16 + size]))["messages"]
    return list(messages)


async def received(url: str, until: str, **options: Any) -> list[dict[str, Any]]:
    """What a viser client is sent, up to a message that mentions ``until``; fails after 10 s."""
    messages: list[dict[str, Any]] = []
    async with asyncio.timeout(10.0):
        async with connect(url, subprotocols=[PROTOCOL], max_size=None, **options) as socket:
            async for frame in socket:
                assert isinstance(frame, bytes)
                messages += read(frame)
                if until in str(messages):
                    return messages
    raise AssertionError(f"closed before {until}")


def socket_url(site: Site, session: str) -> str:
    """Where a page's socket goes."""
    return f"ws://{site.host}/viser/{session}"


def nodes(messages: list[dict[str, Any]]) -> set[str]:
    """Names of the scene nodes that messages add."""
    return {m["name"] for m in messages if m["type"].endswith("Message") and "props" in m}


def test_a_session_gets_its_page_and_its_own_flight(site: Site, flown: Flown) -> None:
    mine, theirs = new_session(), new_session()
    site.scenes.open(mine).show(flown.pair, flown.fault.onset_s)
    site.scenes.open(theirs)

    page = httpx.get(f"{site.url}/viser/{mine}", follow_redirects=True)
    assert page.status_code == 200
    assert page.url.path == f"/viser/{mine}/"
    assert "hasFocus" in page.text

    mine_sent = asyncio.run(received(socket_url(site, mine), "ReplayDone", origin=site.url))
    drawn = {"/faulted/path", "/mirror/path", "/faulted/aircraft", "/mirror/aircraft"}
    assert drawn <= nodes(mine_sent)
    theirs_sent = asyncio.run(received(socket_url(site, theirs), "ReplayDone", origin=site.url))
    assert nodes(theirs_sent) & drawn == set()
    assert "/ground" in nodes(theirs_sent)


def test_an_unknown_session_has_neither_page_nor_socket(site: Site) -> None:
    nobody = new_session()
    assert httpx.get(f"{site.url}/viser/{nobody}/").status_code == 404
    with pytest.raises(InvalidStatus) as refused:
        asyncio.run(received(socket_url(site, nobody), "ReplayDone", origin=site.url))
    assert refused.value.response.status_code == 403


def test_the_viser_port_itself_answers_nobody_else(site: Site, flown: Flown) -> None:
    scene = site.scenes.open(new_session())
    scene.show(flown.pair, flown.fault.onset_s)
    with pytest.raises((ConnectionClosed, AssertionError)):
        asyncio.run(received(f"ws://127.0.0.1:{scene.port}/", "ReplayDone"))


def test_scenes_listen_on_loopback_only(site: Site) -> None:
    ports = {site.scenes.open(new_session()).port for _ in range(3)}
    listening = {
        connection.laddr.port: connection.laddr.ip
        for connection in psutil.Process().net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN
    }
    assert {listening[port] for port in ports} == {"127.0.0.1"}


def test_the_public_share_tunnel_is_shut(site: Site) -> None:
    session = new_session()
    scene = site.scenes.open(session)
    request = msgspec.msgpack.encode({"type": "ShareUrlRequest"})
    assert viser_messages.Message.deserialize(request) == viser_messages.ShareUrlRequest()

    async def ask() -> None:
        url = socket_url(site, session)
        async with connect(url, subprotocols=[PROTOCOL], origin=Origin(site.url)) as socket:
            await socket.send(request)
            await asyncio.sleep(0.5)

    asyncio.run(ask())
    assert scene._server._share_tunnel is None


def test_closing_a_session_ends_its_server_and_its_page(site: Site) -> None:
    session = new_session()
    port = site.scenes.open(session).port
    site.scenes.close(session)
    assert httpx.get(f"{site.url}/viser/{session}/").status_code == 404
    deadline = time.monotonic() + 5.0
    while port in {c.laddr.port for c in psutil.Process().net_connections("tcp")}:
        assert time.monotonic() < deadline, "the viser server still listens"
        time.sleep(0.05)
    site.scenes.close(session)  # and again: nothing to do


def test_an_idle_scene_is_given_up_and_a_used_one_kept() -> None:
    scenes = ViserScenes(idle_s=0.2)
    idle, used = new_session(), new_session()
    scenes.open(idle)
    time.sleep(0.3)
    scene = scenes.open(used)
    assert scenes.find(idle) is None
    time.sleep(0.3)
    assert scenes.open(used) is scene, "idle too, but wanted again"
    assert scenes.find(used) is scene
    scenes.close_all()
    assert scenes.find(used) is None


@pytest.mark.parametrize("session", ["", "short", "../../etc/passwd", "a" * 65, "ä" * 20])
def test_an_id_that_could_be_guessed_opens_nothing(session: str) -> None:
    with pytest.raises(InputError, match="session"):
        ViserScenes().open(session)


@pytest.fixture
def scene() -> ViserScene:
    """A scene of its own that somebody looks at; the test stops it."""
    return looked_at()


def looked_at() -> ViserScene:
    scene = ViserScene()
    scene.watch()
    return scene


def test_a_streamed_flight_ends_as_the_whole_one_would(scene: ViserScene, flown: Flown) -> None:
    scene.reset(flown.plan.duration_s, flown.fault.onset_s)
    for samples in flown.samples():
        scene.extend(samples)
    handles = scene._server.scene._handle_from_node_name
    streamed = handles["/faulted/path"].points.copy()
    assert "/onset/post" in handles
    whole = looked_at()
    whole.show(flown.pair, flown.fault.onset_s)
    shown = whole._server.scene._handle_from_node_name["/faulted/path"].points
    # The whole one ends a few hundredths of a second later, at 50 Hz.
    assert streamed[-1] == pytest.approx(shown[-1], abs=0.02)
    assert streamed[0] == pytest.approx(shown[0], abs=0.02)
    scene.stop()
    whole.stop()


def test_a_second_attempt_starts_the_flight_again(scene: ViserScene, flown: Flown) -> None:
    batches = flown.samples()
    for samples in [*batches[:6], batches[0]]:
        scene.extend(samples)
    assert scene._faulted is not None
    assert len(scene._faulted) == len(batches[0].time_s)
    scene.reset(onset_s=1.0)
    for samples in [*batches[:2], batches[0]]:
        scene.extend(samples)
    scene.show(flown.pair[:500], None)
    nodes = scene._server.scene._handle_from_node_name
    assert "/faulted/path" in nodes
    assert "/onset/post" not in nodes, "a mark of an earlier flight"
    scene.stop()


def test_seeking_moves_both_aircraft_and_survives_the_theme(
    scene: ViserScene, flown: Flown
) -> None:
    scene.seek(10.0)  # in an empty scene: nothing
    scene.show(flown.pair, flown.fault.onset_s)
    handles = scene._server.scene._handle_from_node_name
    end = handles["/mirror/aircraft"].position.copy()
    scene.seek(20.0)
    for dark in (False, True):
        scene.dark = dark
        both = [handles[f"/{name}/aircraft"].position for name in ("faulted", "mirror")]
        assert both[0] == pytest.approx(both[1]), "before the onset they fly together"
        assert abs(both[0] - end).max() > 1.0
    scene.stop()


def test_a_new_run_empties_the_scene(scene: ViserScene, flown: Flown) -> None:
    scene.show(flown.pair, flown.fault.onset_s)
    scene.reset()
    assert set(scene._server.scene._handle_from_node_name) <= {"/WorldAxes", "/ground"}
    scene.stop()


def test_nothing_is_drawn_while_nobody_looks_and_a_newcomer_sees_the_moment(
    site: Site, flown: Flown
) -> None:
    session = new_session()
    scene = site.scenes.open(session)
    sent_before = scene._server._websock_server._broadcast_buffer.message_counter

    def n_sent() -> int:
        buffer = scene._server._websock_server._broadcast_buffer
        return int(buffer.message_counter - sent_before)

    scene.reset(flown.plan.duration_s, flown.fault.onset_s)
    batches = flown.samples()
    for samples in batches[:-1]:
        scene.extend(samples)
    scene.seek(30.0)
    scene.dark = True
    assert n_sent() == 0
    assert scene._server.scene._handle_from_node_name.keys() <= {"/WorldAxes"}

    came = asyncio.run(received(socket_url(site, session), "ReplayDone", origin=site.url))
    assert {"/faulted/path", "/mirror/aircraft", "/onset/post", "/apart"} <= nodes(came)
    place = scene._server.scene._handle_from_node_name["/mirror/aircraft"].position
    deadline = time.monotonic() + 5.0
    while scene.viewers:
        assert time.monotonic() < deadline, "the page has gone"
        time.sleep(0.01)
    drawn = n_sent()
    scene.extend(batches[-1])
    assert n_sent() == drawn
    moved = asyncio.run(received(socket_url(site, session), "ReplayDone", origin=site.url))
    assert "/mirror/aircraft" in nodes(moved)
    now = scene._server.scene._handle_from_node_name["/mirror/aircraft"].position
    assert abs(now - place).max() > 1.0, "where it has come to since, not where it was left"


def test_nothing_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    opened = ViserScene()
    opened.stop()
    captured = capfd.readouterr()
    assert captured.out + captured.err == ""
