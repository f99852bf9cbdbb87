"""Reports for download: ``/runs/<id>/report.html``, ``.pdf`` and ``.md``."""

from fastapi import FastAPI, Response
from fastapi.responses import PlainTextResponse

from core.errors import MirrorTwinError, StoreError
from core.exchange.report_file import report_file, stored_report
from core.store.store import RunStore

MEDIA_TYPES = {
    "html": "text/html; charset=utf-8",
    "md": "text/markdown; charset=utf-8",
    "pdf": "application/pdf",
}


def mount(app: FastAPI, store: RunStore) -> None:
    """Add the route. Call it before any catch-all route."""

    # Not async: FastAPI then runs it on a thread, since drawing the plots is slow.
    @app.get("/runs/{run_id}/report.{kind}", include_in_schema=False)
    def file(run_id: str, kind: str) -> Response:
        if kind not in MEDIA_TYPES:
            return PlainTextResponse(f"Reports come as {', '.join(MEDIA_TYPES)}.", 404)
        try:
            content = report_file(stored_report(store, run_id), kind)
        except StoreError as error:
            return PlainTextResponse(str(error), 404)
        except MirrorTwinError as error:
            return PlainTextResponse(str(error), 500)
        # An attachment: opened in place, the policy of this server would block the file's scripts.
        name = f'attachment; filename="mirrortwin-{run_id}.{kind}"'
        headers = {"Content-Disposition": name, "Cache-Control": "no-cache"}
        return Response(content, media_type=MEDIA_TYPES[kind], headers=headers)
