"""What the server answers: the page, its files, and what is shown."""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from gonio.viewing.assembled import TYPES, parts, served
from gonio.viewing.described import module, shader
from gonio.viewing.serving import answers, jobs, uploads
from gonio.viewing.serving.guard import LOOPBACK, Guard
from gonio.viewing.serving.jobs import Jobs
from gonio.viewing.session import Opened, Session
from gonio.viewing.sparse import table_of


def application(
    session: Session, token: str, port: int, hosts: tuple[str, ...], working: Jobs, upload_limit: int
) -> Starlette:
    """The server of a session; requests without its token, or by another name than those of `hosts`, are refused.

    working: the fits, whose processes do all other long work as well. upload_limit: bytes of a file.
    """
    routes = [
        Route("/", _page),
        Route("/page/{name:path}", _part),
        Route("/api/session", _session),
        Route("/api/set/{place:int}.bin", _columns),
        Route("/api/set/{place:int}/table.bin", _table),
        Route("/api/set/{place:int}/findings", _findings),
        Route("/api/model/{name}.js", _model(module, "text/javascript")),
        Route("/api/model/{name}.glsl", _model(shader, "text/plain")),
        *jobs.ROUTES,
        *uploads.ROUTES,
        *answers.ROUTES,
    ]
    made = Starlette(
        routes=routes,
        middleware=[Middleware(Guard, token=token, port=port, hosts=hosts or LOOPBACK)],
        exception_handlers={HTTPException: _refused, ValueError: _wrong, OSError: _wrong},
    )
    made.state.session = session
    made.state.jobs = working
    made.state.upload_limit = upload_limit
    made.state.asked = time.monotonic()
    return made


async def _page(_: Request) -> Response:
    text, policy = served()
    return Response(text, media_type="text/html", headers={"Content-Security-Policy": policy})


async def _part(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in parts():
        raise HTTPException(404, "the page has no such file")
    return Response(parts()[name], media_type=TYPES[name[name.rfind(".") :]])


async def _session(request: Request) -> Response:
    described = await asyncio.to_thread(request.app.state.session.described)
    return JSONResponse(described | {"upload_limit": request.app.state.upload_limit})


async def _columns(request: Request) -> Response:
    found = await asyncio.to_thread(lambda: opened_in(request).columns.encoded())
    return Response(found, media_type="application/octet-stream")


async def _findings(request: Request) -> Response:
    opened = opened_in(request)
    return JSONResponse(await asyncio.to_thread(lambda: opened.findings))


async def _table(request: Request) -> Response:
    table = table_of(opened_in(request).scan)
    if table is None:
        raise HTTPException(404, "this scan is no table that the page draws")
    return Response(await asyncio.to_thread(table.encoded), media_type="application/octet-stream")


def _model(text: Callable[[Any], str], kind: str) -> Callable[[Request], Any]:
    async def answer(request: Request) -> Response:
        models = request.app.state.session.models
        if (name := request.path_params["name"]) not in models:
            raise HTTPException(404, "there is no such model")
        # The page has then what it draws first: what its fits need is imported meanwhile.
        warm = BackgroundTask(request.app.state.jobs.bench.warm)
        return Response(await asyncio.to_thread(text, models[name]), media_type=kind, background=warm)

    return answer


def opened_in(request: Request) -> Opened:
    """The scan that a request names by its place; HTTPException 404 where there is none."""
    opened: list[Opened] = request.app.state.session.opened
    place = request.path_params["place"]
    if not 0 <= place < len(opened):
        raise HTTPException(404, "there is no such scan")
    return opened[place]


async def _refused(_: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    return JSONResponse({"error": error.detail}, status_code=error.status_code, headers=error.headers)


async def _wrong(_: Request, error: Exception) -> Response:
    return JSONResponse({"error": str(error)}, status_code=422)
