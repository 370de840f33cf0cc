"""Who may ask: the page of this server, in the browser that was handed its token.

Another page of the same browser can send requests to this machine, and can give its own name this machine's address.
So the name that was asked for is checked, everything but the first page needs a cookie that no other page has, and what
changes something must come from the own page.
"""

import secrets
import time
from collections.abc import Awaitable, Callable

from starlette.middleware.base import BaseHTTPMiddleware
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.types import ASGIApp

COOKIE = "gonio"
USUAL = 80  # the port that a browser does not name
LOOPBACK = ("127.0.0.1", "localhost")
CHANGING = ("POST", "DELETE", "PUT", "PATCH")
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class Guard(BaseHTTPMiddleware):
    """Refuses what is not from the own page: 421 a foreign name, 403 no token or a foreign origin, 415 a form."""

    def __init__(self, app: ASGIApp, token: str, port: int, hosts: tuple[str, ...] = LOOPBACK) -> None:
        super().__init__(app)
        self.token = token
        self.hosts = {f"{host}:{port}" for host in hosts} | (set(hosts) if port == USUAL else set())
        # Cookies know no ports: the name does, so that two servers do not take each other's.
        self.cookie = f"{COOKIE}-{port}"

    async def dispatch(self, request: Request, call_next: Callable[[Request], Awaitable[Response]]) -> Response:
        """Answer, or say why not."""
        refused = self._refused(request)
        if refused is None:
            request.app.state.asked = time.monotonic()
        response = refused or await call_next(request)
        for name, value in HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    def _refused(self, request: Request) -> Response | None:
        host = request.headers.get("host", "").lower()
        if host not in self.hosts:
            return _said(421, "this server answers to its own address alone")
        if request.url.path == "/" and "token" in request.query_params and request.method == "GET":
            return self._entered(request)
        if not self._is_known(request.cookies.get(self.cookie, "")):
            return _said(403, "no token: open the address that gonio view printed")
        if request.method in CHANGING:
            origin = request.headers.get("origin", "")
            if origin != f"http://{host}":
                return _said(403, "this request comes from another page")
            kind = request.headers.get("content-type", "").partition(";")[0].strip()
            if request.method != "DELETE" and kind not in ("application/json", "application/octet-stream"):
                return _said(415, "send JSON, or bytes as application/octet-stream")
        return None

    def _entered(self, request: Request) -> Response:
        if not self._is_known(request.query_params["token"]):
            return _said(403, "this token is not that of this server: open the address that gonio view printed")
        response = RedirectResponse("/", status_code=303)
        response.set_cookie(self.cookie, self.token, httponly=True, samesite="strict", path="/")
        return response

    def _is_known(self, token: str) -> bool:
        return secrets.compare_digest(token.encode(), self.token.encode())


def _said(status: int, words: str) -> JSONResponse:
    return JSONResponse({"error": words}, status_code=status)
