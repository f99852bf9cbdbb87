"""What surrounds every page: the header, the address, and the page that the address names."""

from dataclasses import dataclass
from typing import Literal

import dash_mantine_components as dmc
from dash import dcc, html

from app import theme
from app.figures.comparison import MAX_RUNS
from app.kit.attributes import attributes
from app.kit.words import sentence
from app.pages.fly.present import PRESENT_PREFIX
from app.pages.fly.session import new_session_id
from app.pages.help import tour
from core.errors import NoSuchRunError, StoreError
from core.experiments.registry import COMPARED, EXPERIMENTS
from core.fmea.catalogue import catalogue
from core.store.records import valid_run_id
from core.store.store import RunStore
from core.teach.classroom import has_attempt

PageKind = Literal["fly", "runs", "compare", "faults", "results", "teach", "help", "missing"]

RUN_PREFIX = "/run/"

"""The sets of runs that can be compared by a name (`app.pages.compare.page.presets`)."""

PAGES: dict[PageKind, tuple[str, str]] = {
    "fly": ("Fly", "/"),
    "runs": ("Runs", "/runs"),
    "compare": ("Compare", "/compare"),
    "faults": ("Faults", "/faults"),
    "results": ("Results", "/results"),
    "teach": ("Teach", "/teach"),
}
"""What the header leads to: name and address."""


@dataclass(frozen=True, slots=True)
class Address:
    """What a path names. ``problem`` says to a person why there is nothing there.

    ``mode`` is the failure mode that the page is about, ``run_ids`` are the runs compared or
    ``preset`` the set of them, ``result`` is the experiment shown and
    ``attempt_id`` the mystery flight.
    """

    kind: PageKind
    run_id: str | None = None
    problem: str = ""
    mode: str | None = None
    run_ids: tuple[str, ...] = ()
    preset: str | None = None
    result: str | None = None
    attempt_id: str | None = None

    @property
    def title(self) -> str:
        """What the browser's tab says."""
        name = PAGES[self.kind][0] if self.kind in PAGES else "Nothing here"
        if self.kind == "help":
            name = "Help"
        if self.mode is not None:
            name = f"{catalogue()[self.mode].name}, {name}"
        if self.result is not None:
            name = f"{EXPERIMENTS[self.result].title}, {name}"
        return f"{name} · MirrorTwin"


def run_path(run_id: str) -> str:
    """The address of a run."""
    return RUN_PREFIX + run_id


def read_address(path: str, store: RunStore) -> Address:
    """The page and the run that a path names."""
    if path in ("", "/"):
        return Address("fly")
    if path == "/runs":
        return Address("runs")
    for prefix in (RUN_PREFIX, PRESENT_PREFIX):
        if path.startswith(prefix):
            return _run_address(path.removeprefix(prefix), store)
    _, head, *rest = path.split("/", 2)
    name = rest[0] if rest else ""
    match head:
        case "fly" | "faults" if name or head == "faults":
            return _mode_address("fly" if head == "fly" else "faults", name)
        case "compare":
            return _comparison_address(name, store)
        case "results" if not name or name in EXPERIMENTS:
            return Address("results", result=name or None)
        case "help" if not name:
            return Address("help")
        case "teach" if not name or has_attempt(store, name):
            return Address("teach", attempt_id=name or None)
        case "teach":
            return Address("missing", problem=f"There is no mystery flight “{name[:60]}” here.")
        case _:
            return Address("missing", problem=f"There is no page at {path[:80]}.")


def _mode_address(kind: PageKind, mode: str) -> Address:
    """A page about a failure mode; without one, the page about all of them."""
    if mode and mode not in catalogue():
        return Address(
            "missing",
            problem=f"“{mode[:60]}” is not one of the {len(catalogue())} classes of the fault "
            "catalogue.",
        )
    return Address(kind, mode=mode or None)


def _comparison_address(name: str, store: RunStore) -> Address:
    """A comparison: nothing chosen yet, a preset, or runs by name, parted by commas."""
    if name in ("", *COMPARED):
        return Address("compare", preset=name or None)
    run_ids = tuple(dict.fromkeys(name.split(",")))
    if len(run_ids) > MAX_RUNS:
        return Address(
            "missing", problem=f"At most {MAX_RUNS} runs are compared at once, not {len(run_ids)}."
        )
    for run_id in run_ids:
        if (address := _run_address(run_id, store)).kind == "missing":
            return address
    return Address("compare", run_ids=run_ids)


def _run_address(run_id: str, store: RunStore) -> Address:
    if not valid_run_id(run_id):
        return Address(
            "missing",
            problem=f"“{run_id[:60]}” is not the name of a run. "
            "Runs are named like 20261123T061500-k3x9q2wz.",
        )
    try:
        store.get(run_id)
    except NoSuchRunError:
        return Address(
            "missing",
            problem=f"There is no run {run_id} in this store. It may belong to another server.",
        )
    except StoreError as error:
        return Address("missing", problem=sentence(str(error)))
    return Address("fly", run_id)


def layout() -> dmc.MantineProvider:
    """The shell, with a session of its own: Dash calls this for each page load."""
    return dmc.MantineProvider(
        [
            dcc.Location(id="url", refresh=False),
            dcc.Store(id="session", data=new_session_id()),
            dcc.Store(id="run-id", data=None),
            dcc.Store(id="page-kind", data=None),
            dcc.Store(id="scheme", data=None),
            dcc.Store(id="taken", data=None),
            dcc.Store(id="awake", data=None),
            dcc.Store(id="page-title", data=None),
            html.A("Skip to the page", href="#page", className="skip-link"),
            dmc.AppShell(
                [
                    dmc.AppShellHeader(_header(), className="header"),
                    dmc.AppShellMain([tour.invitation(), html.Div(id="page", tabIndex=-1)]),
                ],
                header={"height": 44},
                padding=0,
            ),
        ],
        defaultColorScheme="auto",
        theme={
            "fontFamily": theme.FONT_FAMILY,
            "fontFamilyMonospace": theme.MONO_FAMILY,
            "primaryColor": "blue",
            "primaryShade": {"light": 8, "dark": 8},
            "defaultRadius": "sm",
            "cursorType": "pointer",
            "respectReducedMotion": True,
        },
    )


def _header() -> list[object]:
    return [
        dcc.Link("MirrorTwin", href="/", className="brand"),
        html.Nav(
            [dcc.Link(name, href=path, id=f"nav-{kind}") for kind, (name, path) in PAGES.items()],
            **attributes(aria_label="Pages"),
        ),
        html.Span("Cessna 172P, simulated", className="note header-note"),
        dcc.Link(
            [html.Span("Help"), html.I("?", **attributes(aria_hidden="true"))],
            href="/help",
            id="nav-help",
            className="header-help",
        ),
        dmc.ColorSchemeToggle(
            lightIcon=_icon("☀"),
            darkIcon=_icon("☾"),
            variant="subtle",
            size="md",
            color="gray",
            **attributes(aria_label="Switch between light and dark"),
        ),
    ]


def _icon(character: str) -> html.Span:
    return html.Span(character, **attributes(aria_hidden="true"))
