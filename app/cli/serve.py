"""``mirrortwin serve``: the web app."""

import argparse
from pathlib import Path

from app.cli.options import add_scheduler_options, requested_scheduler

DESCRIPTION = "Start the web app and keep it running until Ctrl-C."
EXAMPLES = """\
examples:
  mirrortwin serve
  mirrortwin serve --port 9000 --store ~/flights
  mirrortwin serve --host 0.0.0.0                      for other machines, with a token
  mirrortwin serve --scheduler tls://10.0.0.5:8786 --tls-ca ca.pem --tls-cert cert.pem \\
    --tls-key key.pem                                  runs fly on that Dask cluster
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--host",
        default="127.0.0.1",
        help="address to listen on: 127.0.0.1 (default), this machine only; 0.0.0.0 or one of its "
        "own addresses, with a token in the link that is printed (or in $MIRRORTWIN_TOKEN)",
    )
    parser.add_argument(
        "--port", type=int, default=8050, help="port to listen on, 1 to 65535 (default 8050)"
    )
    parser.add_argument(
        "--store",
        type=Path,
        metavar="DIR",
        help="where runs are kept (default: $MIRRORTWIN_HOME, else .mirrortwin)",
    )
    add_scheduler_options(parser)


def run(args: argparse.Namespace) -> None:
    """Serve until stopped; raises `InputError`, `WorkerError` or `StoreError` if it cannot."""
    scheduler = requested_scheduler(args)  # before what takes a second to load
    from app.server import serve

    serve(host=args.host, port=args.port, scheduler=scheduler, store_root=args.store)
