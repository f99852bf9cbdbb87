"""The registry of writers: which there are, which can write now, and why one cannot.

The command line and the page offer what stands in `WRITERS`, so that a new writer is a class with
the methods of `core.report.write.writers.Writer` and a row here.
"""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass

from core.errors import InputError, MirrorTwinError
from core.report.write.endpoint import KEY, MODEL, URL, Endpoint
from core.report.write.local_model import HOW_TO_INSTALL, local_model, model_file
from core.report.write.writers import TEMPLATE, ModelWriter, TemplateWriter, Writer


@dataclass(frozen=True, slots=True)
class Offer:
    """A kind of writer as it is here and now.

    ``name``: for people; ``problem``: why it cannot write (None if it can). ``is_trusted`` as in
    `core.report.write.writers.Writer`.
    """

    kind: str
    name: str
    problem: str | None = None
    is_trusted: bool = False


@dataclass(frozen=True, slots=True)
class WriterKind:
    """One row of the registry. ``help``: for the command line.

    ``offer``: how it is offered now. ``open``: a writer, ready for as long as the context; raises
    `InputError` if it is not configured, and `WriterError` if it does not start.
    """

    kind: str
    help: str
    offer: Callable[[], Offer]
    open: Callable[[], AbstractContextManager[Writer]]


def _template_offer() -> Offer:
    return Offer(TEMPLATE, "Template", is_trusted=True)


def _endpoint_offer() -> Offer:
    try:
        endpoint = Endpoint.from_environment()
    except InputError as error:
        return Offer("model", "Endpoint", str(error))
    if endpoint is None:
        return Offer("model", "Endpoint", f"no language model is configured: set {URL}")
    return Offer("model", endpoint.model)


def _open_endpoint() -> AbstractContextManager[Writer]:
    endpoint = Endpoint.from_environment()
    if endpoint is None:
        raise InputError(URL, "is not set: give the address of a language model")
    return nullcontext(ModelWriter(endpoint))


def _local_offer() -> Offer:
    try:
        path = model_file()
    except InputError as error:
        return Offer("local", "Local model", str(error))
    if path is None:
        return Offer("local", "Local model", f"not installed: {HOW_TO_INSTALL}")
    return Offer("local", f"{path.stem} (local)")


@contextmanager
def _open_local() -> Iterator[Writer]:
    with local_model() as endpoint:
        yield ModelWriter(endpoint)


WRITERS: tuple[WriterKind, ...] = (
    WriterKind(
        TEMPLATE,
        "offline, the default",
        _template_offer,
        lambda: nullcontext(TemplateWriter()),
    ),
    WriterKind(
        "model",
        f"the endpoint in {URL}, {MODEL} and {KEY}, e.g.\n"
        "https://api.deepseek.com/v1 and deepseek-chat, or Ollama's http://127.0.0.1:11434/v1",
        _endpoint_offer,
        _open_endpoint,
    ),
    WriterKind(
        "local",
        "a small model on this machine, without a network (the local-llm extra)",
        _local_offer,
        _open_local,
    ),
)
"""Every kind of writer, the default first."""


def offers() -> tuple[Offer, ...]:
    """All kinds of writers, as this process is configured and installed."""
    return tuple(row.offer() for row in WRITERS)


def open_writer(kind: str) -> AbstractContextManager[Writer]:
    """A writer of that kind; raises as `WriterKind.open`, and `InputError` for an unknown kind."""
    return _row(kind).open()


def offered(kind: str) -> Offer:
    """The offer of that kind; raises `InputError` if it is unknown, or cannot write now."""
    found = _row(kind).offer()
    if found.problem is not None:
        raise MirrorTwinError(f"{found.name}: {found.problem}")
    return found


def _row(kind: str) -> WriterKind:
    found = next((row for row in WRITERS if row.kind == kind), None)
    if found is None:
        *kinds, last = (row.kind for row in WRITERS)
        raise InputError("writer", f"must be {', '.join(kinds)} or {last}, got {kind!r:.40}")
    return found
