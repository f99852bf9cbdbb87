"""The page's own scripts: ES modules under ``assets/web/modules``, loaded before Dash's renderer.

Dash runs functions of ``main.js`` in the browser by their names, so its renderer has to wait until
that module and all that it imports are there. Each version of the modules has an address of its
own: a browser that kept some of the last one would mix the two.
"""

import hashlib
import json
from pathlib import PurePosixPath

from fastapi import FastAPI
from starlette.staticfiles import StaticFiles

from app.figures.comparison import MAX_COMPARED
from app.kit.addresses import PRESENT_PREFIX, RUN_PREFIX
from app.pages.runs.files import IMPORT_PATH
from core.paths import WEB

FOLDER = "modules"
"""Of the files served, those that Dash must not load by itself."""

_MODULES = WEB / FOLDER

_CONSTANTS = {
    "mostCompared": MAX_COMPARED,
    "runPrefix": RUN_PREFIX,
    "presentPrefix": PRESENT_PREFIX,
    "importPath": IMPORT_PATH,
}
"""What the modules know of the server (``modules/kit/page.js``)."""


def _paths() -> list[PurePosixPath]:
    return sorted(PurePosixPath(path.relative_to(_MODULES)) for path in _MODULES.rglob("*.js"))


def _version() -> str:
    digest = hashlib.sha256()
    for path in _paths():
        digest.update(str(path).encode() + b"\0" + (_MODULES / path).read_bytes())
    return digest.hexdigest()[:16]


BASE = f"/assets/{FOLDER}-{_version()}"
"""The address of the folder of this version's modules."""

MAIN = f"{BASE}/main.js"


def mount(server: FastAPI) -> None:
    """Serve the modules; before Dash, which serves all else under ``/assets``."""
    server.mount(BASE, StaticFiles(directory=_MODULES), name="modules")


def tags() -> str:
    """What the page's head says of the modules: all are fetched at once, not each as it is met."""
    links = [f'<link rel="modulepreload" href="{BASE}/{path}">' for path in _paths()]
    constants = f'<script type="application/json" id="constants">{json.dumps(_CONSTANTS)}</script>'
    return "\n".join([constants, *links, f'<script type="module" src="{MAIN}"></script>'])


def once_loaded(script: str) -> str:
    """A script that runs once the modules have, or even if they cannot be loaded."""
    return f'import("{MAIN}").finally(() => {{ {script} }});'
