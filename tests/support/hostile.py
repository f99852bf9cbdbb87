"""A real HTTP server on a real socket that behaves like a chat endpoint, well or badly."""

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

Reply = Callable[["Handler"], None]


class Handler(BaseHTTPRequestHandler):
    """One request; what happens is the server's ``reply``."""

    server: "ChatServer"

    def do_POST(self) -> None:
        """Take a request and answer it with the reply of the server."""
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        self.server.requests.append(json.loads(body))
        self.server.headers.append(dict(self.headers))
        with suppress(BrokenPipeError, ConnectionResetError):
            self.server.reply(self)

    def begin(self, status: int = 200, kind: str = "text/event-stream", **headers: str) -> None:
        """Send the head of a response."""
        self.send_response(status)
        self.send_header("Content-Type", kind)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.end_headers()

    def say(self, text: str) -> None:
        """Send one event with a piece of text."""
        event = {"choices": [{"index": 0, "delta": {"content": text}}]}
        self.wfile.write(f"data: {json.dumps(event)}\n\n".encode())
        self.wfile.flush()

    def log_message(self, format: str, *args: Any) -> None:
        """Say nothing on the terminal."""


class ChatServer(ThreadingHTTPServer):
    """The server; ``requests`` and ``headers`` are what it was sent."""

    daemon_threads = True

    def __init__(self, reply: Reply) -> None:
        """Listen on a free port of the loopback interface."""
        super().__init__(("127.0.0.1", 0), Handler)
        self.reply = reply
        self.requests: list[dict[str, Any]] = []
        self.headers: list[dict[str, str]] = []

    @property
    def url(self) -> str:
        """The base address of the endpoint."""
        return f"http://127.0.0.1:{self.server_address[1]}/v1"


@contextmanager
def chat_server(reply: Reply) -> Iterator[ChatServer]:
    """A running server."""
    server = ChatServer(reply)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()


def title_of(request: dict[str, Any]) -> str:
    """Which section a request asks for."""
    asked = request["messages"][-1]["content"]
    return asked.rpartition('the section "')[2].partition('"')[0]


def says(texts: dict[str, str], default: str = "") -> Reply:
    """A well-behaved model that says these texts, word by word."""

    def reply(handler: Handler) -> None:
        text = texts.get(title_of(handler.server.requests[-1]), default)
        handler.begin()
        for word in text.split(" "):
            handler.say(f"{word} ")
        handler.wfile.write(b"data: [DONE]\n\n")

    return reply


def hangs(handler: Handler) -> None:
    """Accepts and never answers."""
    time.sleep(30)


def hangs_in_the_middle(handler: Handler) -> None:
    """Begins well, then falls silent."""
    handler.begin()
    handler.say("This is ")
    time.sleep(30)


def drops(handler: Handler) -> None:
    """Breaks the connection in the midst of a sentence."""
    handler.begin(Transfer_Encoding="chunked")
    event = json.dumps({"choices": [{"delta": {"content": "CHT 3 rose by 18.3 °F. Then it"}}]})
    data = f"data: {event}\n\n".encode()
    handler.wfile.write(f"{len(data):x}\r\n".encode() + data + b"\r\n")
    handler.wfile.flush()
    handler.connection.shutdown(socket.SHUT_RDWR)


def sends_malformed_events(handler: Handler) -> None:
    """Server-sent events that hold no chat."""
    handler.begin()
    for junk in ("{not json", "[]", '{"choices": 7}', "null", '{"a": {"b": 1}}', "\x00\x01"):
        handler.wfile.write(f"data: {junk}\nevent: x\n: comment\n\n".encode())


def sends_one_endless_line(handler: Handler) -> None:
    """No newline, ever."""
    handler.begin()
    for _ in range(2000):
        handler.wfile.write(b"data: " + b"x" * 65536)


def never_stops(handler: Handler) -> None:
    """Well-formed, but without end."""
    handler.begin()
    for _ in range(100_000):
        handler.say("CHT 3 rose by 18.3 °F. ")


def sends_html(handler: Handler) -> None:
    """A captive portal."""
    handler.begin(kind="text/html; charset=utf-8")
    handler.wfile.write(b"<html><body>Please log in</body></html>")


def sends_html_as_events(handler: Handler) -> None:
    """A portal that lies about what it sends."""
    handler.begin()
    handler.wfile.write(b"<html><body>Please log in</body></html>\n" * 3)


def sends_zipped(handler: Handler) -> None:
    """Compressed data that nobody asked for."""
    handler.begin(Content_Encoding="gzip")
    handler.wfile.write(b"\x1f\x8b" + b"\x00" * 100)


def redirects(handler: Handler) -> None:
    """Sends us elsewhere."""
    handler.begin(302, Location="http://127.0.0.1:9/")


def refuses_the_key(handler: Handler) -> None:
    """401, and repeats the key that it was sent."""
    handler.begin(401, "application/json")
    handler.wfile.write(json.dumps({"error": handler.headers.get("Authorization")}).encode())


def fails(handler: Handler) -> None:
    """A server error."""
    handler.begin(500, "application/json")


def is_busy(wait: str) -> Reply:
    """429 with Retry-After, always."""

    def reply(handler: Handler) -> None:
        handler.begin(429, "application/json", Retry_After=wait)

    return reply


@dataclass
class BusyOnce:
    """429 for the first request, then well."""

    then: Reply
    asked: int = field(default=0)

    def __call__(self, handler: Handler) -> None:
        """Answer a request."""
        self.asked += 1
        if self.asked == 1:
            is_busy("0.2")(handler)
        else:
            self.then(handler)


def says_json(sentences: list[str]) -> Reply:
    """A model that keeps to the JSON schema it is sent, in pieces that cut across everything."""

    def reply(handler: Handler) -> None:
        assert handler.server.requests[-1]["response_format"]["type"] == "json_schema"
        text = json.dumps({"sentences": sentences})
        handler.begin()
        for start in range(0, len(text), 3):
            handler.say(text[start : start + 3])
        handler.wfile.write(b"data: [DONE]\n\n")

    return reply


def refuses_schemas(then: Reply) -> Reply:
    """400 to a request with a schema in it, as DeepSeek does."""

    def reply(handler: Handler) -> None:
        if "response_format" in handler.server.requests[-1]:
            handler.begin(400, "application/json")
        else:
            then(handler)

    return reply


def answers_nothing(handler: Handler) -> None:
    """A stream that ends at once."""
    handler.begin()
    handler.wfile.write(b"data: [DONE]\n\n")


def reports_an_error(handler: Handler) -> None:
    """An error inside a stream."""
    handler.begin()
    handler.wfile.write(b'data: {"error": {"message": "out of memory"}}\n\n')


def ignores_streaming(text: str) -> Reply:
    """One JSON document instead of a stream."""

    def reply(handler: Handler) -> None:
        handler.begin(kind="application/json")
        document = {"choices": [{"message": {"content": text}}]}
        handler.wfile.write(json.dumps(document).encode())

    return reply
