"""Files that a page hands over: kept in a file that only this user can read, read by a process that may fail."""

import asyncio
import os
import re
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from gonio.files import temporary_folder
from gonio.fitting.solution import Solution
from gonio.outside import printable
from gonio.processes.portable import available_memory
from gonio.processes.worker import Bench, WorkerError
from gonio.viewing.session import Opened, Session

SECONDS = 60.0  # that a file may take to be read
ROOM = 4 * 2**30  # bytes of memory that its reader may take, or half of what there is
LONGEST = 80  # characters of its name


async def _upload(request: Request) -> Response:
    limit: int = request.app.state.upload_limit
    stated = request.headers.get("content-length", "")
    if stated.isdigit() and int(stated) > limit:
        raise _too_large(limit)
    name = _name(request.query_params.get("name", ""))
    with temporary_folder() as folder:  # of mode 0700, and removed at the end, whatever ends it
        path = folder / name
        await _received(request, path, limit)
        try:
            found = await asyncio.to_thread(_read, request.app.state.jobs.bench, path)
        except WorkerError as error:
            raise HTTPException(422, _worded(name, str(error))) from None
    return JSONResponse(await asyncio.to_thread(_added, request.app.state.session, name, found))


async def _received(request: Request, path: Path, limit: int) -> None:
    """Write what comes to a new file, chunk by chunk; HTTPException 413 where it is more than the limit [bytes]."""
    taken = 0
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:  # noqa: PTH123 - of a handle
        async for chunk in request.stream():
            taken += len(chunk)
            if taken > limit:
                raise _too_large(limit)
            await asyncio.to_thread(file.write, chunk)
    if not taken:
        raise HTTPException(422, f"{path.name}: the file is empty")


def _read(bench: Bench, path: Path) -> Any:
    from gonio.viewing.working.reading import read_uploaded

    worker = bench.take()
    try:
        worker.limit(int(min(ROOM, available_memory() / 2)))
        return worker.call(read_uploaded, path, seconds=SECONDS)
    finally:
        bench.give(worker, used_up=True)


def _added(session: Session, name: str, found: Any) -> dict[str, Any]:
    """What the page has to know of the scan that was added to the session."""
    solution = found if isinstance(found, Solution) else None
    opened = Opened(name, solution.scan if solution else found, {name: solution} if solution else {})
    described = opened.described()
    session.opened.append(opened)
    return {"place": len(session.opened) - 1, "set": described}


def _name(given: str) -> str:
    """The name of a file without its folders, of plain letters, so that no name leads anywhere."""
    plain = re.sub(r"[^\w.-]+", "_", re.split(r"[/\\]", given)[-1], flags=re.ASCII).lstrip(".-")
    return plain[-LONGEST:].lstrip(".-") or "upload"


def _worded(name: str, words: str) -> str:
    words = printable(words)
    return words if name in words else f"{name}: {words}"


def _too_large(limit: int) -> HTTPException:
    """The refusal, after which the connection is closed: nobody reads what would follow."""
    words = f"the file is larger than {limit / 2**20:g} MB, which gonio view --upload-limit sets"
    return HTTPException(413, words, {"Connection": "close"})


ROUTES = (Route("/api/upload", _upload, methods=["POST"]),)
