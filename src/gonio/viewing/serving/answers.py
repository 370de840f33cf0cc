"""What a page asks about its values and scans: reflectance and laws, a second scan, exports."""

import asyncio
import math
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from gonio.processes.worker import WorkerError
from gonio.viewing.serving.bodies import json_of
from gonio.viewing.sliders import Sliders, chosen, part_of, sliders

FIGURES = Path("results", "figures")  # beside where `gonio view` was started


async def _evaluate(request: Request) -> Response:
    from gonio.viewing.evaluated import evaluated

    said = await json_of(request)
    return JSONResponse(await asyncio.to_thread(lambda: evaluated(sliders(request.app.state.session, said))))


async def _pair(request: Request) -> Response:
    from gonio.viewing.pairs import pair

    opened = request.app.state.session.opened
    places = [request.path_params[key] for key in ("first", "second")]
    if not all(0 <= place < len(opened) for place in places):
        raise HTTPException(404, "there is no such scan")
    return JSONResponse(await asyncio.to_thread(pair, *(opened[place] for place in places)))


async def _targets(_: Request) -> Response:
    from gonio.viewing.exported import listed

    return JSONResponse(await asyncio.to_thread(listed))


async def _target(request: Request) -> Response:
    said = await json_of(request)
    return JSONResponse(await asyncio.to_thread(_written, request.app.state.session, said))


def _written(session: Any, said: dict[str, Any]) -> dict[str, Any]:
    from gonio.exporting.registry import targets
    from gonio.viewing.exported import written

    scale = said.get("scale")
    if scale is not None and not (isinstance(scale, int | float) and math.isfinite(scale) and scale > 0):
        raise ValueError("scale: give a positive number, the 1/sr of one unit of the data")
    return written(sliders(session, said), chosen(said, "target", tuple(targets())), scale)


async def _figure(request: Request) -> Response:
    said = await json_of(request)
    try:
        return JSONResponse(await asyncio.to_thread(_drawn, request, said))
    except WorkerError as error:
        raise HTTPException(422, str(error)) from None


def _drawn(request: Request, said: dict[str, Any]) -> dict[str, str]:
    from gonio.viewing.exported import stem
    from gonio.viewing.working import drawing

    at = sliders(request.app.state.session, said)
    header = at.opened.columns.header
    angles = _angles(at, said.get("cells"))
    scale = chosen(said, "scale", ("log", "linear"))
    kind = chosen(said, "format", drawing.KINDS)
    what = drawing.Drawing(
        part_of(at.opened, at.block),
        ", ".join([at.opened.name, *(f"{n} {v}" for n, v in header["blocks"][at.block].items())]),
        angles,
        FIGURES / f"{stem(at.opened.name)}-curves",
        kind,
        scale,
    )
    bench = request.app.state.jobs.bench
    worker = bench.take()
    try:
        if at.are_fitted:
            return {"written": worker.call(drawing.draw_fit, what, at.fit)}
        values = {cell["theta_i"]: at.at_cell(k) for k, cell in enumerate(header["cells"]) if cell["block"] == at.block}
        return {"written": worker.call(drawing.draw_values, what, at.model, values)}
    finally:
        bench.give(worker)


def _angles(at: Sliders, cells: Any) -> list[float]:
    """The incidence angles [deg] of the cells that are shown, as many as a figure has room for."""
    from gonio.viewing.working.drawing import MOST

    known = at.opened.columns.header["cells"]
    if not isinstance(cells, list) or not all(type(k) is int and 0 <= k < len(known) for k in cells):
        raise ValueError("cells: give a list of the curves that are shown")
    angles = sorted({known[k]["theta_i"] for k in cells if known[k]["block"] == at.block and known[k]["in_plane"] > 1})
    if not angles:
        raise ValueError("no curve in the plane of incidence is shown: choose an incidence angle first")
    return angles[:MOST]


ROUTES = (
    Route("/api/evaluate", _evaluate, methods=["POST"]),
    Route("/api/pair/{first:int}/{second:int}", _pair, methods=["GET"]),
    Route("/api/targets", _targets, methods=["GET"]),
    Route("/api/export/target", _target, methods=["POST"]),
    Route("/api/export/figure", _figure, methods=["POST"]),
)
