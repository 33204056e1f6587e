"""The page as an ASGI application: who may ask, and what each address does."""

from __future__ import annotations

import json
import math
import os
import secrets
import tempfile
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from markupsafe import Markup
from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    PlainTextResponse,
    RedirectResponse,
    Response,
)
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pamrs import rigs
from pamrs._arrays import Array
from pamrs._files import MOST_BYTES, MOST_TOML_BYTES
from pamrs._progress import duration_words
from pamrs._views import decimate
from pamrs.channels import laboratory_unit
from pamrs.errors import PamrsError, ParameterError
from pamrs.report.page import render_page
from pamrs.studio._folder import LogTable, Studio
from pamrs.studio._run import FILES

_OWN: Final = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "frame-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
# the report has its script and pictures inside, and must not reach this page
_REPORT: Final = (
    "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; "
    "style-src 'unsafe-inline'; img-src data:; frame-ancestors 'self'"
)
_HEADERS: Final = {
    "content-security-policy": _OWN,
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cache-control": "no-store",
}
_ASSETS: Final = {"studio.js": "text/javascript", "studio.css": "text/css"}
_STYLE: Final = Path(__file__).parents[1] / "report" / "style.css"


class _Guard:
    """Middleware that answers only with the token, at an address of this computer."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app, self._token = app, token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = Headers(raw=message["headers"])
                more = {k: v for k, v in _HEADERS.items() if k not in headers}
                pairs = [(k.encode(), v.encode()) for k, v in more.items()]
                message["headers"] = [*message["headers"], *pairs]
            await send(message)

        answer = self._refused(Request(scope)) or self._app
        await answer(scope, receive, guarded)

    def _refused(self, request: Request) -> Response | None:
        port = (request.scope.get("server") or ("", 0))[1]
        hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        host, origin = request.headers.get("host", ""), request.headers.get("origin")
        if host not in hosts or (origin is not None and origin not in {f"http://{host}"}):
            return PlainTextResponse("this page answers on this computer alone", 403)
        cookie = f"pamrs_studio_{port}"
        if request.url.path == "/" and self._is_token(request.query_params.get("token")):
            answer = RedirectResponse("/", 303)
            answer.set_cookie(cookie, self._token, httponly=True, samesite="strict")
            return answer
        known = self._is_token(request.cookies.get(cookie))
        if request.method != "GET":
            known = known and self._is_token(request.headers.get("x-pamrs-token"))
        needed = "open the address that pamrs studio printed, with its token"
        return None if known else PlainTextResponse(needed, 403)

    def _is_token(self, given: str | None) -> bool:
        return secrets.compare_digest((given or "").encode(), self._token.encode())


async def _received(request: Request, file: Path) -> None:
    """Write the body of a request to a new file; a part of it never has that name."""
    size = 0
    part_file = file.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with part_file.open("xb") as stream:
            async for part in request.stream():
                size += len(part)
                if size > MOST_BYTES:
                    raise ParameterError(
                        f"{file.name}: more than {MOST_BYTES >> 20} MB, and at most that is read; "
                        "cut it into parts"
                    )
                await run_in_threadpool(stream.write, part)
        if os.path.lexists(file):  # since it was asked
            raise ParameterError(f"{file.name}: is there already; give the new log another name")
        part_file.rename(file)
    finally:
        part_file.unlink(missing_ok=True)


async def _upload(studio: Studio, request: Request) -> None:
    target = studio.new_log(request.query_params.get("name", ""))
    await _received(request, target)
    await run_in_threadpool(studio.take, target)


def _did(studio: Studio, what: str, given: dict[str, Any]) -> None:
    """Carry out the action of a button."""
    done: dict[str, Callable[[], object]] = {
        "rig": lambda: studio.put_rig(str(given.get("text", ""))),
        "packaged": lambda: studio.put_packaged(str(given.get("name", ""))),
        "confirm": lambda: studio.confirm(given.get("logs", [])),
        "case": lambda: studio.put_case(str(given.get("text", ""))),
        "check": studio.check,
        "run": studio.start,
        "cancel": studio.close,
    }
    with studio.lock:
        if what not in ("check", "cancel") and studio.run is not None and studio.run.running:
            raise ParameterError("a diagnosis goes on: wait for it, or cancel it")
        done[what]()


async def _given(request: Request) -> dict[str, Any]:
    """The JSON of a request, of a size that no honest one comes near."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > 2 * MOST_TOML_BYTES:
            raise ParameterError(f"more than {2 * MOST_TOML_BYTES >> 20} MB of text is not allowed")
    found = json.loads(body or b"{}")
    if not isinstance(found, dict):
        raise ParameterError("the request is no table")
    return found


def _zipped(studio: Studio) -> Path:
    """The case folder as one file, outside of it."""
    handle, name = tempfile.mkstemp(suffix=".zip")
    with os.fdopen(handle, "wb") as stream, zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as z:
        for file in studio.files():
            z.write(file, Path(studio.folder.name) / file.relative_to(studio.folder))
    return Path(name)


def make_app(studio: Studio, token: str) -> ASGIApp:
    """The page of a case folder.

    Parameters
    ----------
    studio : Studio
        The case folder.
    token : str
        What who asks must know: in the address first, in a cookie from then on.

    Returns
    -------
    ASGI application
    """

    def home(request: Request) -> Response:
        with studio.lock:
            return HTMLResponse(page(studio, token))

    def asset(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in _ASSETS:
            return PlainTextResponse("not here", 404)
        text = Path(__file__).with_name(name).read_text(encoding="utf-8")
        shared = _STYLE.read_text(encoding="utf-8") if name.endswith(".css") else ""
        return Response(shared + text, media_type=_ASSETS[name])

    def progress(request: Request) -> Response:
        run = studio.run
        if run is None:
            return JSONResponse({"running": False})
        left = "" if run.left is None else f"about {duration_words(run.left)} left"
        state = {"running": run.running, "share": run.share or 0.0, "left": left}
        state["leading"] = run.leading
        return JSONResponse(state | {"lines": run.lines[-6:], "error": studio.said_of_run()})

    def result(request: Request) -> Response:
        name = request.path_params["name"]
        file = studio.result_file(name) if name in FILES else None
        if file is None:
            return PlainTextResponse("not here", 404)
        if name == "report.html" and "save" not in request.query_params:
            return FileResponse(file, headers={"content-security-policy": _REPORT})
        return FileResponse(file, filename=name)

    def take_away(request: Request) -> Response:
        file = _zipped(studio)
        name = f"{studio.folder.name}.zip"
        return FileResponse(file, filename=name, background=BackgroundTask(file.unlink))

    async def act(what: str, request: Request) -> Response:
        try:
            if what == "upload":
                await _upload(studio, request)
            else:
                await run_in_threadpool(_did, studio, what, await _given(request))
        except (PamrsError, OSError, ValueError, TypeError) as error:
            return JSONResponse({"error": studio.said(error)}, 400)
        except Exception as error:  # a page has no terminal that shows where it was
            words = f"that failed ({type(error).__name__}: {error}); please report it"
            return JSONResponse({"error": studio.said(words)}, 400)
        return JSONResponse({})

    acts = ("rig", "packaged", "upload", "confirm", "case", "check", "run", "cancel")
    routes = [
        Route("/", home),
        Route("/static/{name}", asset),
        Route("/progress", progress),
        Route("/result/{name}", result),
        Route("/case.zip", take_away),
        *(Route(f"/{what}", partial(act, what), methods=["POST"]) for what in acts),
    ]
    return _Guard(Starlette(routes=routes), token)


_TEMPLATE: Final = Path(__file__).with_name("page.html.j2")
_UNITS: Final = "bar bar(a) mbar kPa kPa(a) MPa Pa psi deg rad mm m V mV mA N kN kg K degC 1 %"


def page(studio: Studio, token: str) -> str:
    """The page as HTML.

    Parameters
    ----------
    studio : Studio
        The case folder.
    token : str
        What its script sends back with each press of a button.

    Returns
    -------
    str
    """
    rig, rig_error = studio.rig()
    tables, data_error = studio.tables()
    found, result_error = studio.result()
    return render_page(
        _TEMPLATE,
        token=token,
        folder=str(studio.folder),
        rig=rig,
        rig_error=rig_error,
        rig_text=studio.text("rig.toml"),
        most_bytes=MOST_BYTES,
        case_text=studio.text("case.toml"),
        foreign=studio.foreign,
        packaged=rigs.names(),
        logs=[_log(table) for table in tables],
        data_error=data_error,
        channels={name: laboratory_unit(name)[0] or "1" for name in studio.channels()},
        units=_UNITS.split(),
        check=studio.checked,
        green=studio.green,
        running=studio.run is not None and studio.run.running,
        run_error=studio.said_of_run(),
        found=found,
        result_error=result_error,
        stale=found is not None and studio.stale(found),
        has_experiment=studio.result_file("experiment.csv") is not None,
    )


def _log(table: LogTable) -> dict[str, Any]:
    """A log: its columns with curves, what is proposed, what to look at."""
    item, first = table.item, table.entries[0]
    rows = []
    for each in item.listed:
        channel, entry = table.channel(each.name)
        series = item.log.series[each.name]
        clock = series.stamps or each.name == item.time.get("column")
        rows.append(
            {
                "name": each.name,
                "curve": sparkline(np.asarray(series.values, dtype=float)),
                "low": f"{each.low:.5g}" if math.isfinite(each.low) else "–",
                "high": f"{each.high:.5g}" if math.isfinite(each.high) else "–",
                "rate": f"{each.rate:.4g} Hz" if math.isfinite(each.rate) else "–",
                "clock": clock,
                "channel": channel,
                "unit": entry.get("unit", each.unit),
                "calibrated": "from" in entry,
                "assumed": entry.get("assumed", ""),
            }
        )
    return {
        "file": first["file"],
        "name": first.get("name", ""),
        "role": table.role,
        "roles": table.roles,
        "clockless": "sample_time" in first
        or any(row["channel"] and row["rate"] == "–" for row in rows),
        "spacing": f"{first['sample_time']:g} s" if "sample_time" in first else "",
        "rows": rows,
        "remarks": [*item.log.remarks, *item.remarks],
        "unread": item.log.unread,
    }


_WIDTH: Final = 240
_HEIGHT: Final = 36


def sparkline(values: Array) -> Markup:
    """A curve over the samples, from the smallest to the largest value of each stretch.

    Parameters
    ----------
    values : (n,) array
        Numbers; what is not finite is left out.

    Returns
    -------
    Markup
        An ``svg`` element; empty where no number is.
    """
    rows = np.flatnonzero(np.isfinite(values))
    if not rows.size:
        return Markup("")
    ends, drawn = decimate(rows, values[rows], 2 * _WIDTH)
    low, high = float(drawn.min()), float(drawn.max())
    scale = (_HEIGHT - 4) / (high - low) if high > low else 0.0
    x = ends * (_WIDTH / max(1, values.size - 1))
    y = _HEIGHT - 2 - (drawn - low) * scale if scale else np.full(x.size, _HEIGHT / 2)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y, strict=True))
    return Markup(
        '<svg class="spark" viewBox="0 0 {} {}" preserveAspectRatio="none" aria-hidden="true">'
        '<polyline points="{}"/></svg>'
    ).format(_WIDTH, _HEIGHT, points)
