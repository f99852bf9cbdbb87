"""Someone else on this machine, who tries to run code in whatever Dask listens here.

    python tests/jobs/intruder.py UID [PORT...]

As user UID (which takes root, unless it is one's own) it finds the ports that listen on loopback in
/proc/net/tcp, or takes those given, and asks each for its page and, as Dask's clients do, plainly
and with certificates of its own, to run a function in the scheduler, the worker or the nanny there.
Prints what was answered, a line each, and how much was tried.
"""

import asyncio
import logging
import os
import sys
from collections.abc import Awaitable, Iterator
from pathlib import Path

from distributed import Security
from distributed.comm.core import connect
from distributed.core import send_recv
from distributed.protocol.pickle import dumps

LISTENING, LOOPBACK = "0A", "0100007F"
PATIENCE_S = 15.0
WAYS = ("run_function", "run")  # of a scheduler; of a worker or nanny


def listening() -> Iterator[int]:
    """The ports that anyone on this machine can see."""
    for line in Path("/proc/net/tcp").read_text().splitlines()[1:]:
        _, local, _, state, *_ = line.split()
        host, port = local.split(":")
        if state == LISTENING and host in (LOOPBACK, "00000000"):
            yield int(port, 16)


async def ran(address: str, way: str, security: Security) -> object:
    """What came of running ``os.getpid`` there: the number of a process, if it was run."""
    async with asyncio.timeout(PATIENCE_S):
        comm = await connect(address, timeout=PATIENCE_S, **security.get_connection_args("client"))
        try:
            nothing = dumps(()), dumps({})
            return await send_recv(
                comm, op=way, function=dumps(os.getpid), args=nothing[0], kwargs=nothing[1]
            )
        finally:
            comm.abort()


async def page(port: int, path: str) -> str:
    """The first line that a web server there answers."""
    async with asyncio.timeout(PATIENCE_S):
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(f"GET {path} HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n".encode())
        line = await reader.readline()
        writer.close()
        if not line.startswith(b"HTTP"):
            raise ValueError("no web server")
        return line.decode("latin-1").strip()


async def said_of(what: str, answer: Awaitable[object]) -> str | None:
    """A line of what was answered; None if nothing."""
    try:
        return f"{what}: {await answer}"
    except Exception:
        return None


async def break_in(ports: list[int]) -> None:
    own = Security.temporary()
    tries = []
    for port in ports:
        for scheme, security in (("tcp", Security()), ("tls", own)):
            address = f"{scheme}://127.0.0.1:{port}"
            tries += [said_of(f"RAN {address} {way}", ran(address, way, security)) for way in WAYS]
        for path in ("/info/main/workers.html", "/health", "/metrics"):
            tries.append(said_of(f"PAGE {port} {path}", page(port, path)))
    for line in await asyncio.gather(*tries):
        if line is not None:
            print(line)
    print(f"{len(tries)} tries at {len(ports)} ports as user {os.getuid()}")


if __name__ == "__main__":
    logging.disable()
    uid, *given = map(int, sys.argv[1:])
    if uid != os.getuid():
        os.setgroups([])
        os.setgid(uid)
        os.setuid(uid)
    seen = set(listening())
    asyncio.run(break_in([port for port in given if port in seen] if given else sorted(seen)))
