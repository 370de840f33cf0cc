"""The server as a process: its address, and its end."""

import secrets
import socket
from collections.abc import Callable

import uvicorn

from gonio.viewing.serving.routes import application
from gonio.viewing.session import Session

HOST = "127.0.0.1"
WAITING = 5  # s that open connections are given at the end


def serve(session: Session, port: int, ready: Callable[[str], None]) -> None:
    """Answer until the process is interrupted; `ready` is called with the address, token included, once it listens.

    Port 0 stands for any that is free. Raises OSError where the port is in use.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
        except OSError as error:
            raise OSError(
                f"port {port} of {HOST}: {error.strerror}: choose another by --port, or leave it out"
            ) from None
        listening.listen()
        port = listening.getsockname()[1]
        token = secrets.token_urlsafe(32)
        app = application(session, token, port)
        config = uvicorn.Config(app, log_level="error", lifespan="off", timeout_graceful_shutdown=WAITING)
        server = uvicorn.Server(config)
        ready(f"http://{HOST}:{port}/?token={token}")
        server.run(sockets=[listening])
