"""Workers behind a Dask scheduler elsewhere: reaching them, and what to do if that fails."""

import asyncio
from typing import Any

from distributed import Client
from distributed.comm.core import connect
from distributed.utils import LoopRunner

from core.errors import WorkerError
from core.workers.scheduler import RemoteScheduler

CONNECT_TIMEOUT_S = 5.0


def remote_client(scheduler: RemoteScheduler, **options: Any) -> Client:
    """A client of that scheduler; raises `WorkerError` if it does not answer soon."""
    _check_answers(scheduler)
    try:
        return Client(
            scheduler.address,
            security=scheduler.security(),
            timeout=CONNECT_TIMEOUT_S,
            set_as_default=False,
            **options,
        )
    except (OSError, ValueError) as error:
        raise WorkerError(f"scheduler {scheduler.address}: {error}") from None


def _check_answers(scheduler: RemoteScheduler) -> None:
    """Raise `WorkerError` unless Dask answers there.

    Before a `Client` is made: one that something else than Dask answers cannot even be closed.
    """
    address = scheduler.address
    arguments = scheduler.security().get_connection_args("client")

    async def connect_once() -> None:
        # A timeout of our own: Dask waits for ever for a stranger's side of the handshake.
        async with asyncio.timeout(CONNECT_TIMEOUT_S):
            comm = await connect(address, timeout=CONNECT_TIMEOUT_S, **arguments)
        comm.abort()

    try:
        LoopRunner().run_sync(connect_once)
    except Exception as error:  # whatever it is that a stranger's answer leads to
        also = (
            ", check that its certificates and ours are of one CA"
            if arguments["ssl_context"]
            else ""
        )
        raise WorkerError(
            f"no Dask scheduler answers at {address}: start one there by `dask scheduler`, correct "
            f"the address (such as tcp://HOST:8786){also}, or leave --scheduler out to fly on this "
            "machine"
        ) from error
