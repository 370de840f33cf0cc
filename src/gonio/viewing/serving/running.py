"""The server as a process: its address, and its end."""

import contextlib
import ipaddress
import secrets
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import uvicorn
from starlette.applications import Starlette

from gonio.processes.worker import Bench
from gonio.viewing.serving.guard import LOOPBACK
from gonio.viewing.serving.jobs import MODULES, Jobs
from gonio.viewing.serving.routes import application
from gonio.viewing.session import Session

UPLOAD = 256 * 2**20  # bytes of a file that a page hands over
LOOKED = 0.5  # s between two looks at the clock
EXPOSED = (
    "whoever can reach this machine by that name and has the address with its token can read these scans and use this "
    "computer to fit; nothing on the way is encrypted"
)


@dataclass(frozen=True)
class Serving:
    """Where the server listens, and what it allows.

    port: 0 for any that is free. expose: whether `host` may be other than loopback. idle: seconds without a request
    after which it ends, 0 for never. upload_limit: bytes of a file.
    Raises ValueError for a host that others can reach, unless `expose` is set.
    """

    port: int = 0
    host: str = "127.0.0.1"
    expose: bool = False
    idle: float = 0.0
    upload_limit: int = UPLOAD

    def __post_init__(self) -> None:
        if not self.is_private and not self.expose:
            raise ValueError(
                f"--host {self.host} lets other machines in: leave it out, or add --expose if that is what you want"
            )

    @property
    def is_private(self) -> bool:
        """Whether only this machine can reach it."""
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return self.host.lower() == "localhost"


class _Server(uvicorn.Server):
    """Uvicorn's server, which leaves signals to the program: that ends at once, and in order (`processes.ending`)."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def serve(
    session: Session,
    serving: Serving,
    ready: Callable[[str], None],
    warn: Callable[[str], None] = lambda words: None,
) -> None:
    """Answer until the process is interrupted, or nobody asked for as long as `serving.idle`.

    ready: called with the address, token included, once it listens. warn: called with what a user has to know.
    Raises OSError where the port is in use, and ValueError for a host without an address.
    """
    with _listening(serving) as socket_, contextlib.closing(Bench(MODULES)) as bench:
        port = socket_.getsockname()[1]
        token = secrets.token_urlsafe(32)
        names = hosts(serving)
        app = application(session, token, port, names, Jobs(bench), serving.upload_limit)
        config = uvicorn.Config(app, log_level="error", lifespan="off", timeout_graceful_shutdown=1)
        server = _Server(config)
        if serving.idle:
            threading.Thread(target=_end_idle, args=(server, app, serving.idle), daemon=True).start()
        if not serving.is_private:
            warn(f"--expose: {EXPOSED}")
        ready(f"http://{names[0]}:{port}/?token={token}")
        threading.Thread(target=session.prepare, daemon=True).start()
        server.run(sockets=[socket_])


def hosts(serving: Serving) -> tuple[str, ...]:
    """The names by which a browser may ask, the one to open first."""
    if serving.is_private:
        own = _bracketed(serving.host.lower())
        return tuple(dict.fromkeys((own, *LOOPBACK)))
    try:
        anywhere = ipaddress.ip_address(serving.host).is_unspecified
    except ValueError:
        anywhere = False
    names = [socket.gethostname(), socket.getfqdn()] if anywhere else [serving.host]
    with contextlib.suppress(OSError):
        names += [str(found[4][0]) for found in socket.getaddrinfo(names[0], None)]
    return tuple(dict.fromkeys([*(_bracketed(name.lower()) for name in names), *LOOPBACK]))


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host else host


@contextlib.contextmanager
def _listening(serving: Serving) -> Iterator[socket.socket]:
    """A socket that listens; OSError with the remedy where the port is in use."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            serving.host, serving.port, type=socket.SOCK_STREAM, proto=socket.IPPROTO_TCP
        )[0]
    except OSError as error:
        raise ValueError(f"--host {serving.host}: {error.strerror}") from None
    # With its protocol named, asyncio sends each answer at once; else the kernel waits 40 ms for more to send (Nagle).
    with socket.socket(family, kind, protocol) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(address)
        except OSError as error:
            raise OSError(
                f"port {serving.port} of {serving.host}: {error.strerror}: choose another by --port, or leave it out"
            ) from None
        listening.listen()
        yield listening


def _end_idle(server: uvicorn.Server, app: Starlette, idle: float) -> None:
    """End the server when nobody has asked for so many seconds and no fit is running."""
    while not server.should_exit:
        time.sleep(min(LOOKED, idle))
        if app.state.jobs.are_running:
            app.state.asked = time.monotonic()
        server.should_exit = time.monotonic() - app.state.asked > idle
