"""A server of a page in a thread of the tests, and a client that asks it over a real socket, as a browser does."""

import http.client
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from urllib.parse import urlsplit

import uvicorn

from gonio.processes.worker import Bench, WorkerError
from gonio.viewing.serving.jobs import MODULES, Jobs
from gonio.viewing.serving.routes import application

TOKEN = "token-of-tests"


class Client:
    """Asks with the cookie of the token, from the own page, unless a request says otherwise."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self.host, self.port = parts.hostname, parts.port
        entered = self.ask("GET", f"/?{parts.query}", Cookie="")
        self.cookie = entered.headers["set-cookie"].partition(";")[0]

    def ask(self, method, path, body=None, **headers):
        """The answer to a request; `Content_Type` and other headers by keyword."""
        connection = http.client.HTTPConnection(self.host, self.port, timeout=60)
        sent = {"Origin": f"http://{self.host}:{self.port}", "Cookie": getattr(self, "cookie", "")}
        if isinstance(body, dict):
            body = json.dumps(body).encode()
            sent["Content-Type"] = "application/json"
        elif body is not None:
            sent["Content-Type"] = "application/octet-stream"
        sent |= {name.replace("_", "-"): value for name, value in headers.items()}
        with closing(connection):
            connection.request(method, path, body, {n: v for n, v in sent.items() if v})
            return Answer(connection.getresponse())

    def events(self, number):
        """What is said of a job, one object an event, until it ends."""
        text = self.ask("GET", f"/api/job/{number}").body.decode()
        return [json.loads(line.removeprefix("data: ")) for line in text.splitlines() if line.startswith("data: ")]


class Answer:
    """Status, headers and body of an answer."""

    def __init__(self, answer: http.client.HTTPResponse) -> None:
        self.status = answer.status
        self.headers = {name.lower(): value for name, value in answer.getheaders()}
        self.body = answer.read()

    @property
    def json(self):
        """The body as an object."""
        return json.loads(self.body)


class Inline:
    """Does what a process would do in the thread that asks: what is computed is the same, and nothing is started."""

    def take(self):
        """Itself, as a worker."""
        return self

    def call(self, function, *arguments, tell=None, seconds=0.0):
        """What the function gives; what is wrong is worded as a worker words it."""
        try:
            return function(*arguments, **({"tell": tell} if tell else {}))
        except (ValueError, OSError) as error:
            raise WorkerError(str(error)) from None

    def give(self, worker, used_up=False):
        """Nothing."""

    limit = warm = end = close = lambda *_: None


@contextmanager
def served(session, upload_limit: int = 2**20, processes: bool = False) -> Iterator[Client]:
    """A client of a server of the session, in a thread of this process; its fits in processes where that is asked."""
    with socket.socket() as listening, closing(Bench(MODULES) if processes else Inline()) as bench:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        port = listening.getsockname()[1]
        app = application(session, TOKEN, port, (), Jobs(bench), upload_limit)
        server = uvicorn.Server(uvicorn.Config(app, log_level="error", lifespan="off", timeout_graceful_shutdown=1))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listening]}, daemon=True)
        thread.start()
        while not server.started:
            time.sleep(0.01)
        yield Client(f"http://127.0.0.1:{port}/?token={TOKEN}")
        server.should_exit = True
        thread.join()
