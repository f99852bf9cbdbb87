"""Export and import of runs over plain HTTP.

    GET  /runs/files?id=...&id=...        a zip of these runs (`core.exchange.run_archive`)
    GET  /runs/<id>/<side>.csv?rate=1     one flight as a Garmin G1000 log
    POST /runs/import                     such a zip, as the body of the request

An upload goes to the disk as it comes, up to a limit that is counted here, whatever it announces.
Other sites' pages cannot send one: for this content type browsers ask first, and the answer is no.
"""

import asyncio
import tempfile
from pathlib import Path
from typing import Annotated

from fastapi import FastAPI, Query, Request, Response
from fastapi.responses import FileResponse, JSONResponse, PlainTextResponse
from starlette.background import BackgroundTask
from starlette.requests import ClientDisconnect

from app.archives import export_runs, import_runs
from app.kit.words import run_title, sentence
from core.errors import InputError, MirrorTwinError, StoreError
from core.exchange.g1000_writer import RATE_HZ, SIDES, g1000_csv, log_name
from core.exchange.run_archive import MAX_PACKED, MAX_PACKED_RUNS
from core.store.store import RunStore

IMPORT_PATH = "/runs/import"
EXPORT_PATH = "/runs/files"
ZIP = "application/zip"

_MAX_UPLOADS = 2


def mount(app: FastAPI, store: RunStore) -> None:
    """Add the routes. Call it before any catch-all route."""
    uploads = asyncio.Semaphore(_MAX_UPLOADS)

    # Not async: FastAPI then runs them on a thread, since packing and writing take their time.
    @app.get(EXPORT_PATH, include_in_schema=False)
    def exported(
        ids: Annotated[list[str], Query(alias="id", max_length=MAX_PACKED_RUNS)],
    ) -> Response:
        folder = tempfile.TemporaryDirectory(prefix="mirrortwin-")
        path = Path(folder.name) / "runs.zip"
        try:
            export_runs(store, ids, path)
        except MirrorTwinError as error:
            folder.cleanup()
            return _problem(error)
        name = f"mirrortwin-{ids[0]}.zip" if len(ids) == 1 else f"mirrortwin-{len(ids)}-runs.zip"
        return FileResponse(
            path, media_type=ZIP, filename=name, background=BackgroundTask(folder.cleanup)
        )

    @app.get("/runs/{run_id}/{side}.csv", include_in_schema=False)
    def log(run_id: str, side: str, rate: int = RATE_HZ) -> Response:
        which = next((known for known in SIDES if known == side), None)
        if which is None:
            return PlainTextResponse(f"Logs are of {' or '.join(SIDES)}.", 404)
        try:
            record = store.get(run_id)
            text = g1000_csv(record, getattr(store.load_pair(run_id), side), rate, side=which)
        except MirrorTwinError as error:
            return _problem(error)
        name = f'attachment; filename="{log_name(record, which)}"'
        return Response(text, media_type="text/csv", headers={"Content-Disposition": name})

    @app.post(IMPORT_PATH, include_in_schema=False)
    async def imported(request: Request) -> Response:
        if request.headers.get("content-type") != ZIP:
            return _refusal(f"Send one file, as {ZIP}.", 415)
        if uploads.locked():
            return _refusal("Other files are being imported; try again in a moment.", 429)
        async with uploads:
            return await _receive(store, request)


async def _receive(store: RunStore, request: Request) -> Response:
    try:
        with tempfile.TemporaryDirectory(prefix="mirrortwin-") as folder:
            path = Path(folder) / "upload.zip"
            if not await _save_body(request, path):
                return _refusal(f"The file is larger than {MAX_PACKED >> 20} MB.", 413)
            records = await asyncio.to_thread(import_runs, store, path)
    except ClientDisconnect:
        return _refusal("The upload was interrupted.", 400)
    except OSError as error:
        return _refusal(f"The upload could not be stored: {error.strerror}.", 507)
    except MirrorTwinError as error:
        return _refusal(_message(error), 422 if isinstance(error, InputError) else 507)
    done = [{"id": record.id, "title": run_title(record)} for record in records]
    return JSONResponse({"imported": done})


async def _save_body(request: Request, path: Path) -> bool:
    """Write the body to ``path`` as it comes; False once it is too large, announced or not."""
    announced = request.headers.get("content-length", "0")
    size = int(announced) if announced.isdigit() else 0
    if size > MAX_PACKED:
        return False
    size = 0
    with path.open("wb") as file:
        async for chunk in request.stream():
            size += len(chunk)
            if size > MAX_PACKED:
                return False
            await asyncio.to_thread(file.write, chunk)
    return True


def _problem(error: MirrorTwinError) -> Response:
    return PlainTextResponse(_message(error), 404 if isinstance(error, StoreError) else 422)


def _message(error: MirrorTwinError) -> str:
    """The error as a sentence."""
    text = str(error)
    if isinstance(error, InputError) and error.field == "file":
        text = f"The file {error.problem}"
    return sentence(text)


def _refusal(message: str, status: int) -> Response:
    return JSONResponse({"problem": message}, status)
