"""The ``mirrortwin`` command.

Each subcommand is a module of this package with ``configure(parser)`` and ``run(args)``. Only the
one that was named is imported, and it imports the twin, torch or the app inside ``run``: help
answers at once.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from core.errors import InputError, MirrorTwinError

COMMANDS: dict[str, str] = {
    "serve": "start the web app",
    "faults": "list the engine faults that can be flown",
    "simulate": "fly one flight twice, with a fault and without, into a folder",
    "diagnose": "name the fault in a folder that simulate wrote",
    "report": "write, check and export the report on a run; answer questions about it",
    "export": "write a stored run to a file: zip, Garmin G1000 log or Rerun recording",
    "import": "import runs exported by another MirrorTwin",
    "dataset": "fly the labelled flights for training",
    "train": "train the diagnosis network on a data set",
    "bench": "measure the speed of the twin and of the server",
    "experiment": "reproduce a result of the paper",
}

_MODULES = {"import": "take_in"}
"""Commands whose name no module can have."""

_EPILOG = """\
first steps:
  mirrortwin serve                                  the app, on http://127.0.0.1:8050
  mirrortwin simulate --fault baffle_crack --severity 0.8 --onset 60 --seed 7 --out flight
  mirrortwin diagnose flight

`mirrortwin COMMAND --help` describes one command.
"""


class Parser(argparse.ArgumentParser):
    """A parser whose error messages are one line, like every other error of this command."""

    def error(self, message: str) -> NoReturn:
        """Print ``message`` and leave with status 2."""
        self.exit(2, f"mirrortwin: {message} (see {self.prog} --help)\n")


def _parser(chosen: str | None) -> Parser:
    """The parser of the whole command, with the options of ``chosen`` alone filled in."""
    parser = Parser(
        prog="mirrortwin",
        description="Fly a Cessna 172P twice, once with an engine fault and once without, "
        "and diagnose the difference.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="store_true", help="print the version and stop")
    commands = parser.add_subparsers(title="commands", dest="command", metavar="COMMAND")
    for name, summary in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=summary,
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        if name == chosen:
            module = import_module(f"app.cli.{_MODULES.get(name, name)}")
            command.description, command.epilog = module.DESCRIPTION, module.EXAMPLES
            module.configure(command)
            command.set_defaults(run=module.run)
    return parser


def _fail(message: object, status: int) -> int:
    print(f"mirrortwin: {message}", file=sys.stderr)
    return status


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line ``argv`` (default: the process's own) and return its exit status.

    0: done. 1: the work failed. 2: the request cannot be carried out as written. 130: interrupted.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    chosen = next((word for word in arguments if not word.startswith("-")), None)
    parser = _parser(chosen)
    args = parser.parse_args(arguments)
    if args.version:
        from importlib.metadata import version

        print(f"mirrortwin {version('mirrortwin')}")
        return 0
    if args.command is None:
        parser.print_help()
        return 0
    try:
        args.run(args)
        sys.stdout.flush()
    except InputError as error:
        return _fail(error, 2)
    except MirrorTwinError as error:
        return _fail(error, 1)
    except KeyboardInterrupt:
        return _fail("interrupted", 130)
    except BrokenPipeError:
        # The reader (`head`, say) has what it wanted; Python must not complain at exit either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0
