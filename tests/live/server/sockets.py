"""A server in this process, and what its windows say and are told."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from starlette.testclient import TestClient, WebSocketTestSession

from birthsim_live.server.app import create_app

HERE = "http://127.0.0.1:8000"
SOCKET = "ws://127.0.0.1:8000/ws"
MESSAGES = 100_000
"""That are waited through, for half an hour and more: frames come on all the while."""


def client(hub: Any, folder: Path | None = None, **options: Any) -> TestClient:
    return TestClient(create_app(hub, recordings=folder, **options), base_url=HERE)


def until(ws: WebSocketTestSession, wanted: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    """The first message that is ``wanted``."""
    for _ in range(MESSAGES):
        message: dict[str, Any] = json.loads(ws.receive_text())
        if wanted(message):
            return message
    raise AssertionError("it never came")


def of(kind: str, **values: Any) -> Callable[[dict[str, Any]], bool]:
    """Messages of a kind with these values, themselves or in their settings."""
    return lambda m: m["type"] == kind and all({**m, **m.get("settings", {})}.get(k) == v for k, v in values.items())


def say(ws: WebSocketTestSession, kind: str, **fields: Any) -> None:
    ws.send_text(json.dumps({"type": kind, **fields}))
