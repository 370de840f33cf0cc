"""What a request brings: JSON of at most 1 MB, its numbers finite."""

import json
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request

MOST = 1_000_000  # bytes of JSON


async def json_of(request: Request) -> dict[str, Any]:
    """The object that a request brings; HTTPException 413 for more than MOST bytes, 400 for what is no such object."""
    held = bytearray()
    async for chunk in request.stream():
        held += chunk
        if len(held) > MOST:
            raise HTTPException(413, f"a request holds at most {MOST // 1_000_000} MB of JSON")
    try:
        value = json.loads(held.decode("utf-8"), parse_constant=_no_constant)
    except (ValueError, RecursionError):
        raise HTTPException(400, "the request is no JSON of finite numbers") from None
    if not isinstance(value, dict):
        raise HTTPException(400, "the request is JSON, but no object")
    return value


def _no_constant(name: str) -> float:
    raise ValueError(name)
