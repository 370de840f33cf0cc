"""Fits that a page asks for: each in a process of its own, one at a time for a scan, with progress and cancel."""

import asyncio
import itertools
import json
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.from_scan import freeing
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.processes.worker import Bench, Worker, WorkerError
from gonio.viewing.fits import record
from gonio.viewing.serving.bodies import json_of
from gonio.viewing.session import Opened, Session
from gonio.viewing.sliders import Sliders, chosen, scan_of, sliders, texts

MODULES = ("gonio.viewing.working.fitting", "gonio.viewing.working.reading")  # imported by a process that is kept warm
BEST = "best"  # the name that stands for every model
SILENCE = 15.0  # s after which a stream says that it is still there


@dataclass
class Job:
    """A fit on its way: what was said of it last, and the process that does it."""

    number: int
    opened: Opened
    loop: asyncio.AbstractEventLoop
    worker: Worker | None = None
    latest: dict[str, Any] = field(default_factory=lambda: {"fraction": 0.0, "name": ""})
    ended: bool = False
    changed: asyncio.Event = field(default_factory=asyncio.Event)

    def tell(self, event: dict[str, Any]) -> None:
        """Say how far it is, from any thread."""
        self._from_a_thread(event, False)

    def finish(self, event: dict[str, Any]) -> None:
        """Say how it ended, from any thread."""
        self._from_a_thread(event, True)

    def _from_a_thread(self, event: dict[str, Any], ended: bool) -> None:
        with suppress(RuntimeError):  # the server has ended, and its loop is closed
            self.loop.call_soon_threadsafe(self._told, event, ended)

    def _told(self, event: dict[str, Any], ended: bool) -> None:
        if self.ended:
            return
        self.latest, self.ended = event, ended
        before, self.changed = self.changed, asyncio.Event()
        before.set()

    def cancel(self) -> None:
        """End it now, in the thread of the loop."""
        self._told({"cancelled": True}, True)
        if self.worker:
            self.worker.end()

    async def events(self) -> AsyncIterator[str]:
        """What is said of it, as server-sent events, until it ends."""
        while True:
            changed, ended = self.changed, self.ended
            yield f"data: {json.dumps(self.latest)}\n\n"
            if ended:
                return
            while not changed.is_set():
                try:
                    await asyncio.wait_for(changed.wait(), SILENCE)
                except TimeoutError:
                    yield ": still at work\n\n"


class Jobs:
    """The fits of a session by their numbers."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self._numbers = itertools.count(1)
        self._jobs: dict[int, Job] = {}

    @property
    def are_running(self) -> bool:
        """Whether one is on its way."""
        return any(not job.ended for job in self._jobs.values())

    def __getitem__(self, number: int) -> Job:
        if number not in self._jobs:
            raise HTTPException(404, "there is no such job")
        return self._jobs[number]

    def start(self, opened: Opened, work: Callable[[Worker, Callable[[Any], None]], dict[str, Any]]) -> Job:
        """Begin to work in a thread that waits for the process; HTTPException 409 while another fit of the scan is."""
        if any(job.opened is opened and not job.ended for job in self._jobs.values()):
            raise HTTPException(409, "a fit of this scan is running: wait for it, or cancel it")
        self._jobs = {n: job for n, job in self._jobs.items() if not job.ended or n == max(self._jobs)}
        job = Job(next(self._numbers), opened, asyncio.get_running_loop())
        self._jobs[job.number] = job
        threading.Thread(target=self._run, args=(job, work), daemon=True).start()
        return job

    def _run(self, job: Job, work: Callable[[Worker, Callable[[Any], None]], dict[str, Any]]) -> None:
        try:
            worker = job.worker = self.bench.take()
        except (WorkerError, OSError) as error:
            job.finish({"failed": str(error)})
            return
        try:
            if not job.ended:
                job.finish(work(worker, job.tell))
        except Exception as error:  # whatever it is, the page is told: nobody else is there to hear it
            job.finish({"failed": str(error) or type(error).__name__})
        finally:
            self.bench.give(worker)


async def _fit(request: Request) -> Response:
    said = await json_of(request)
    session: Session = request.app.state.session
    jobs: Jobs = request.app.state.jobs
    weighting = chosen(said, "weighting", (AUTO, *WEIGHTINGS))
    _, opened = scan_of(session, said)
    if said.get("model") == BEST:
        work = _best(session, opened, weighting)
    else:
        work = _one(await asyncio.to_thread(sliders, session, said), weighting, texts(said, "locked"))
    return JSONResponse({"job": jobs.start(opened, work).number}, status_code=202)


def _best(session: Session, opened: Opened, weighting: str) -> Callable[..., dict[str, Any]]:
    from gonio.viewing.working.fitting import fit_best

    def work(worker: Worker, tell: Callable[[Any], None]) -> dict[str, Any]:
        models = list(session.models.values())
        found, ranking, words = worker.call(fit_best, opened.scan, models, {"weighting": weighting}, tell=tell)
        return _done(opened, found) | {"ranking": ranking, "verdict": words}

    return work


def _one(at: Sliders, weighting: str, locked: list[str]) -> Callable[..., dict[str, Any]]:
    from gonio.viewing.working.fitting import fit_one

    options = _options(at, locked) | {"weighting": weighting}
    start = {name: at.by_label(name) for name in at.groups}

    def work(worker: Worker, tell: Callable[[Any], None]) -> dict[str, Any]:
        found = worker.call(fit_one, at.opened.scan, at.model, start, options, tell=tell)
        return _done(at.opened, found)

    return work


def _options(at: Sliders, locked: list[str]) -> dict[str, Any]:
    """The groups of the fit that the values began with, and what is held, as a Problem takes them."""
    if unknown := [name for name in locked if name not in at.groups]:
        raise ValueError(f"locked: {at.model.name} has no parameter {unknown[0][:60]!r}")
    if set(locked) >= set(at.groups):
        raise ValueError("every parameter is held: free one to fit it")
    sets = tuple(dataset.sets(at.opened.columns.points))
    grouped: dict[str, tuple[str, ...]] = {}
    held: dict[str, Any] = {}
    shared = []
    smooth = at.fit.smooth if at.fit else {}
    for name, group in at.groups.items():
        is_weight = name in at.model.weights
        if name in locked:
            held[name] = at.by_label(name) if group.by else at.values[name][0]
            grouped |= {name: group.by} if group.by else {}
        elif is_weight and sets and not group.by:
            shared.append(name)
        elif own := tuple(n for n in group.by if not (is_weight and n in sets) and n != _by(smooth.get(name))):
            grouped[name] = own
    bounds = freeing(at.model, (name for name in at.groups if name not in (*locked, *grouped)))
    options: dict[str, Any] = {"held": held, "grouped": grouped, "shared": tuple(shared), "bounds": bounds}
    if at.fit is None:
        return options
    kept = {name: one for name, one in smooth.items() if name not in locked}
    return options | {"smooth": kept, "instrument": at.fit.instrument, "loss": str(at.fit.dataset.attrs["loss"])}


def _by(smooth: Any) -> str:
    return str(smooth.by) if smooth else ""


def _done(opened: Opened, solution: Solution) -> dict[str, Any]:
    """The fit as the page takes it, after it was added to those of the scan."""
    name, again = solution.model.name, 1
    while name in opened.fits:
        again += 1
        name = f"{solution.model.name} {again}"
    found = record(solution, opened.columns)
    opened.fits[name] = solution
    return {"done": {"name": name, "record": found}}


async def _events(request: Request) -> Response:
    job = request.app.state.jobs[request.path_params["number"]]
    return StreamingResponse(job.events(), media_type="text/event-stream", headers={"Cache-Control": "no-store"})


async def _cancel(request: Request) -> Response:
    job: Job = request.app.state.jobs[request.path_params["number"]]
    job.cancel()
    return JSONResponse({"cancelled": True})


ROUTES = (
    Route("/api/fit", _fit, methods=["POST"]),
    Route("/api/job/{number:int}", _events, methods=["GET"]),
    Route("/api/job/{number:int}", _cancel, methods=["DELETE"]),
)
