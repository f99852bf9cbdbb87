"""Client of OpenAI-compatible chat endpoints, streaming over httpx; every failure is one error.

The one place that speaks the protocol, which DeepSeek, Ollama, vLLM and llama.cpp's server share.
Replies are not trusted: they are bounded in size and time, and read as text.
"""

import json
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import httpx

from core.errors import InputError, MirrorTwinError
from core.report.write.constraints import RESPONSE_FORMAT, SentenceReader
from core.report.write.prompts import Message

URL, MODEL, KEY = "MIRRORTWIN_LLM_URL", "MIRRORTWIN_LLM_MODEL", "MIRRORTWIN_LLM_KEY"
"""The environment variables that configure an endpoint."""

MAX_REPLY_CHARS = 20_000
"""The longest reply that is read; a section has a few hundred characters."""

MAX_LINE_CHARS = 100_000
"""The longest line of a stream that is read."""

MAX_WAIT_S = 8.0
"""The longest wait for a busy endpoint (429, 503) that says when to try again."""


class WriterError(MirrorTwinError):
    """Failure of a language model to write what was asked. ``final``: asking again is pointless."""

    def __init__(self, message: str, *, final: bool = False) -> None:
        """Describe the failure for the reader of the report."""
        super().__init__(message)
        self.final = final


@dataclass(frozen=True, slots=True)
class Limits:
    """How long an endpoint may take, in seconds.

    ``connect_s`` to accept a connection, ``silence_s`` between two pieces (the first included),
    ``reply_s`` for one whole reply.
    """

    connect_s: float = 5.0
    silence_s: float = 20.0
    reply_s: float = 90.0


@dataclass(frozen=True, slots=True)
class Endpoint:
    """Where a model is asked. ``url`` is the base (``https://api.deepseek.com/v1``).

    ``key`` is sent as a bearer token and appears nowhere else, neither in ``repr`` nor in errors.
    ``extra``: further fields of the request, such as a grammar. ``constrained``: whether to hold
    replies to a JSON schema, until the endpoint is found to refuse that.
    """

    url: str
    model: str
    key: str = field(default="", repr=False)
    limits: Limits = Limits()
    extra: Mapping[str, Any] = field(default_factory=dict)
    constrained: bool = True

    @classmethod
    def from_environment(cls, environment: Mapping[str, str] = os.environ) -> "Endpoint | None":
        """The endpoint that the environment names, None where it names none.

        Raises `InputError` for a URL that is not http(s) or without a model.
        """
        url = environment.get(URL, "").strip()
        if not url:
            return None
        try:
            parsed = httpx.URL(url)
        except httpx.InvalidURL:
            parsed = httpx.URL()
        if parsed.userinfo:
            raise InputError(URL, f"must not contain a password: put the key in {KEY}")
        if parsed.scheme not in ("http", "https") or not parsed.host:
            raise InputError(URL, "must be an address such as http://127.0.0.1:11434/v1")
        model = environment.get(MODEL, "").strip()
        if not model:
            raise InputError(MODEL, f"must name a model served by {parsed.host}")
        return cls(url.rstrip("/"), model, environment.get(KEY, "").strip())

    def stream(self, messages: list[Message], max_tokens: int) -> Iterator[str]:
        """The reply piece by piece; raises `WriterError`. Closing the iterator disconnects."""
        waited = False
        while True:
            constrained = self.constrained and (self.url, self.model) not in _REFUSED
            reader = SentenceReader()
            try:
                for piece in self._once(messages, max_tokens, constrained):
                    yield reader.push(piece) if constrained else piece
                return
            except _NoSchemaError:
                _REFUSED.add((self.url, self.model))
            except _BusyError as busy:
                if waited or busy.wait_s is None or busy.wait_s > MAX_WAIT_S:
                    raise WriterError(str(busy), final=True) from None
                waited = True
                time.sleep(busy.wait_s)

    def _once(self, messages: list[Message], max_tokens: int, constrained: bool) -> Iterator[str]:
        limits = self.limits
        timeout = httpx.Timeout(limits.silence_s, connect=limits.connect_s)
        deadline = time.monotonic() + limits.reply_s
        body = {
            "model": self.model,
            "messages": messages,
            "max_tokens": max_tokens,
            "temperature": 0.0,
            "stream": True,
            **({"response_format": RESPONSE_FORMAT} if constrained else {}),
            **self.extra,
        }
        # Uncompressed, so that a small reply cannot unfold into a large one.
        headers = {"Accept-Encoding": "identity"}
        if self.key:
            headers["Authorization"] = f"Bearer {self.key}"
        address = f"{self.url}/chat/completions"
        # The environment may name proxies; an endpoint on this machine must not go through them.
        local = httpx.URL(self.url).host in ("127.0.0.1", "localhost", "::1")
        try:
            with (
                httpx.Client(
                    timeout=timeout, trust_env=not local, follow_redirects=False
                ) as client,
                client.stream("POST", address, json=body, headers=headers) as response,
            ):
                if constrained and response.status_code in (400, 422):
                    raise _NoSchemaError
                _check_status(response)
                said = False
                for piece in _pieces(response, deadline):
                    said = said or bool(piece.strip())
                    yield piece
                if not said:
                    raise WriterError("the language model returned an empty reply")
        except httpx.HTTPError as error:
            raise _translated(error, limits) from None


class _BusyError(Exception):
    """429 or 503, with the seconds to wait if it said."""

    def __init__(self, message: str, wait_s: float | None) -> None:
        super().__init__(message)
        self.wait_s = wait_s


class _NoSchemaError(Exception):
    """The endpoint does not take the request with a schema in it."""


_REFUSED: set[tuple[str, str]] = set()
"""Endpoints (address, model) that refused a schema: DeepSeek does, Ollama and vLLM take it."""


def _check_status(response: httpx.Response) -> None:
    status = response.status_code
    if status in (429, 503):
        wait_s = _retry_after(response.headers.get("Retry-After", ""))
        when = f"; it asks to wait {wait_s:.0f} s" if wait_s is not None else ""
        raise _BusyError(f"the language model is busy (HTTP {status}){when}", wait_s)
    if status in (401, 403):
        raise WriterError(f"the language model rejected the API key (HTTP {status})", final=True)
    if status == 404:
        raise WriterError("the endpoint has no such address or model (HTTP 404)", final=True)
    if status != 200:
        raise WriterError(
            f"the language model returned an error (HTTP {status})", final=300 <= status < 500
        )
    if "Content-Encoding" in response.headers:
        raise WriterError("the endpoint sent compressed data that was not requested", final=True)
    if "html" in response.headers.get("Content-Type", ""):
        raise WriterError("the endpoint returned a web page instead of a reply", final=True)


def _retry_after(value: str) -> float | None:
    """Seconds; a date is not parsed, since it is hardly within `MAX_WAIT_S`."""
    try:
        return max(0.0, float(value))
    except ValueError:
        return None


def _translated(error: httpx.HTTPError, limits: Limits) -> WriterError:
    if isinstance(error, httpx.ConnectTimeout):
        return WriterError(
            f"the language model did not accept a connection in {limits.connect_s:g} s", final=True
        )
    if isinstance(error, httpx.ConnectError):
        return WriterError("the language model cannot be reached", final=True)
    if isinstance(error, httpx.TimeoutException):
        return WriterError(
            f"the language model sent nothing for {limits.silence_s:g} s", final=True
        )
    return WriterError("the connection to the language model was lost")


def _pieces(response: httpx.Response, deadline: float) -> Iterator[str]:
    """The text of a reply: server-sent events, or one JSON document where streaming is ignored."""
    if "json" in response.headers.get("Content-Type", ""):
        yield _whole(response, deadline)
        return
    total, unreadable = 0, 0
    for line in _lines(response, deadline):
        if not line.startswith("data:"):
            continue
        data = line.removeprefix("data:").strip()
        if data == "[DONE]":
            return
        piece = _delta(data)
        if piece is None:
            unreadable += 1
            if unreadable > 3:
                raise WriterError("the language model sent an invalid response stream")
            continue
        total += len(piece)
        if total > MAX_REPLY_CHARS:
            raise WriterError(f"the language model sent more than {MAX_REPLY_CHARS} characters")
        yield piece
    if unreadable:
        raise WriterError("the language model sent an invalid response stream")


def _lines(response: httpx.Response, deadline: float) -> Iterator[str]:
    """Lines of a body of any size, never holding more than one of them."""
    rest = ""
    for text in response.iter_text():
        if time.monotonic() > deadline:
            raise WriterError("the language model took too long")
        rest += text
        *lines, rest = rest.split("\n")
        yield from (line.strip("\r") for line in lines)
        if len(rest) > MAX_LINE_CHARS:
            raise WriterError("the language model sent an invalid response stream", final=True)
    if rest:
        yield rest


def _whole(response: httpx.Response, deadline: float) -> str:
    text = ""
    for piece in response.iter_text():
        text += piece
        if len(text) > 5 * MAX_LINE_CHARS or time.monotonic() > deadline:
            raise WriterError("the language model sent too much or took too long")
    try:
        content = json.loads(text)["choices"][0]["message"]["content"]
    except (ValueError, KeyError, IndexError, TypeError):
        raise WriterError("the reply of the language model cannot be read") from None
    return str(content or "")[:MAX_REPLY_CHARS]


def _delta(data: str) -> str | None:
    """The text in one event, "" where it has none, None where it is not an event of a chat."""
    try:
        event = json.loads(data)
    except ValueError:
        return None
    match event:
        case {"error": _}:
            raise WriterError("the language model reported an error")
        case {"choices": [{"delta": {"content": str(content)}}, *_]}:
            return content
        case {"choices": list()}:
            return ""
        case _:
            return None
