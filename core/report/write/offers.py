"""The writers on offer here: which there are, which can write now, and why one cannot."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Literal

from core.errors import InputError, MirrorTwinError
from core.report.write.endpoint import URL, Endpoint
from core.report.write.local_model import HOW_TO_INSTALL, local_model, model_file
from core.report.write.writers import ModelWriter, TemplateWriter, Writer

WriterKind = Literal["template", "model", "local"]
"""The offline template, the endpoint that the environment names, the model on this machine."""


@dataclass(frozen=True, slots=True)
class Offer:
    """A kind of writer: its name for people, and why it cannot write (None if it can)."""

    kind: WriterKind
    name: str
    problem: str | None = None


def offers() -> tuple[Offer, ...]:
    """All kinds of writers, as this process is configured and installed."""
    return (Offer("template", "Template"), _endpoint_offer(), _local_offer())


def _endpoint_offer() -> Offer:
    try:
        endpoint = Endpoint.from_environment()
    except InputError as error:
        return Offer("model", "Endpoint", str(error))
    if endpoint is None:
        return Offer("model", "Endpoint", f"no language model is configured: set {URL}")
    return Offer("model", endpoint.model)


def _local_offer() -> Offer:
    try:
        path = model_file()
    except InputError as error:
        return Offer("local", "Local model", str(error))
    if path is None:
        return Offer("local", "Local model", f"not installed: {HOW_TO_INSTALL}")
    return Offer("local", f"{path.stem} (local)")


@contextmanager
def open_writer(kind: str) -> Iterator[Writer]:
    """A writer of that kind, ready for as long as the context.

    Raises `InputError` if it is not on offer, and `WriterError` if the local model does not start.
    """
    if kind == "template":
        yield TemplateWriter()
        return
    with ExitStack() as stack:
        if kind == "local":
            yield ModelWriter(stack.enter_context(local_model()))
            return
        endpoint = Endpoint.from_environment() if kind == "model" else None
        if endpoint is None:
            raise InputError(URL, "is not set: where is the language model?")
        yield ModelWriter(endpoint)


def offered(kind: str) -> Offer:
    """The offer of that kind; raises `InputError` if it is unknown, or cannot write now."""
    found = next((offer for offer in offers() if offer.kind == kind), None)
    if found is None:
        raise InputError("writer", f"must be template, model or local, got {kind!r:.40}")
    if found.problem is not None:
        raise MirrorTwinError(f"{found.name}: {found.problem}")
    return found
