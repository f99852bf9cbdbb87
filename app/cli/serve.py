"""``mirrortwin serve``: the web app."""

import argparse
import errno
import os
import socket
from pathlib import Path

from app.cli.output import note
from core.errors import InputError

DESCRIPTION = "Start the web app and keep it running until Ctrl-C."
EXAMPLES = """\
examples:
  mirrortwin serve
  mirrortwin serve --port 9000 --store ~/flights
  mirrortwin serve --scheduler tcp://10.0.0.5:8786     runs fly on that Dask cluster
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on (default 127.0.0.1: this machine only)",
    )
    parser.add_argument(
        "--port", type=int, default=8050, help="port to listen on, 1 to 65535 (default 8050)"
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="Dask scheduler that runs the flights (default: workers of our own)",
    )
    parser.add_argument(
        "--store",
        type=Path,
        metavar="DIR",
        help="where runs are kept (default: $MIRRORTWIN_HOME, else .mirrortwin)",
    )


def run(args: argparse.Namespace) -> None:
    """Serve until stopped; raises `InputError` if the address cannot be had."""
    _check_address(args.host, args.port)
    note("Starting MirrorTwin ...")
    from app.server import serve

    serve(host=args.host, port=args.port, scheduler=args.scheduler, store_root=args.store)


def _check_address(host: str, port: int) -> None:
    """Raise `InputError` now, in one line, rather than after the workers have started."""
    if not 1 <= port <= 65535:
        raise InputError("port", f"must lie in 1 to 65535, got {port}")
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
    except OSError:
        raise InputError("host", f"{host!r} is not an address of this machine") from None
    try:
        socket.create_server((host, port), family=family).close()
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        if error.errno == errno.EADDRNOTAVAIL:
            raise InputError("host", f"cannot listen on {host}: {reason}") from None
        raise InputError(
            "port", f"cannot listen on {host}:{port}: {reason}; choose another with --port"
        ) from None
