"""What all clients share: one clock, its news, and what they ask for."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import asdict
from typing import Any, TypeVar

import numpy as np

from birthsim_build.layout import DRAG_LIMIT
from birthsim_env.physics.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.clock import Clock, Source
from birthsim_live.rig.settings import NOTHING, Choices, opening_settings
from birthsim_live.server import protocol
from birthsim_live.server.clients import Client
from birthsim_live.server.past import Past
from birthsim_live.server.shapes import shapes
from birthsim_live.server.words import CHOICES, described, words

T = TypeVar("T")

EDGE = 33
"""Points along each long edge of the workspace."""


class Hub(ABC):
    """All clients' messages in, news out. It lives in the event loop, its source in the clock's thread."""

    mode: str

    def __init__(self, source: Source, rig: Parameters, choices: Choices) -> None:
        self.clock = Clock(source, self._from_clock)
        self._surroundings = surroundings(rig, choices)
        self._clients: set[Client] = set()
        self._told: dict[str, Any] = {}
        self._past = Past()
        self._loop: asyncio.AbstractEventLoop | None = None

    async def open(self) -> None:
        """Start the clock."""
        self._loop = asyncio.get_running_loop()
        self.clock.start()

    async def close(self) -> None:
        """Stop the clock and finish what is unfinished."""
        await asyncio.to_thread(self.finish)

    def finish(self) -> None:
        """What ``close`` does, outside the event loop; once is enough."""
        self.clock.stop()

    async def join(self, client: Client) -> None:
        """Tell a new client everything, and from then on the news."""
        loop = asyncio.get_running_loop()
        # From the clock's thread, like all news: what changes meanwhile comes after, not before.
        await self.ask(lambda: loop.call_soon_threadsafe(self._welcome, client, self.news(), self.past()))

    def _welcome(self, client: Client, news: dict[str, dict[str, Any]], past: dict[str, Any]) -> None:
        if client.closed:
            return
        hello = {"type": "hello", "protocol": protocol.VERSION, "mode": self.mode, **self._surroundings}
        hello["settings"], hello["state"] = news["settings"]["settings"], news["state"]
        client.tell("hello", protocol.encode(hello))
        for kind, message in news.items():
            client.tell(kind, protocol.encode(message))
        client.tell("history", protocol.encode(past))
        self._clients.add(client)

    def leave(self, client: Client) -> None:
        """Forget a closed client."""
        client.closed = True
        self._clients.discard(client)

    async def receive(self, client: Client, text: str | bytes) -> None:
        """Act on what a client has sent; what is wrong is answered by an error."""
        try:
            message = protocol.parse(text)
            match message:
                case protocol.Ping(id=identity):
                    client.answer({"type": "pong", "id": identity})
                case protocol.Pause(paused=paused):
                    await self.ask(lambda: self.pause(paused))
                case protocol.Speed(speed=speed):
                    await self.ask(lambda: self.clock.set_speed(speed))
                case _:
                    await self.act(client, message)
        except (ValueError, OSError) as error:
            client.answer(protocol.error(str(error)))

    async def ask(self, action: Callable[[], T]) -> T:
        """Let the clock's thread do something; its result."""
        return await asyncio.wrap_future(self.clock.ask(action))

    def pause(self, paused: bool) -> None:
        """In the clock's thread: stand still or go on."""
        self.clock.pause(paused)

    @abstractmethod
    async def act(self, client: Client, message: protocol.Message) -> None:
        """Act on a message that is not common to all hubs."""

    @abstractmethod
    def news(self) -> dict[str, dict[str, Any]]:
        """In the clock's thread: kind -> message, of all that a client must know beside the frames."""

    def past(self) -> dict[str, Any]:
        """In the clock's thread: news of what plots show of the time before."""
        return self._past.message()

    def _from_clock(self, frame: dict[str, Any]) -> None:
        self._past.take(frame)
        texts = []
        for kind, message in self.news().items():
            if self._told.get(kind) != message:
                self._told[kind] = message
                texts.append((kind, protocol.encode(message)))
        shown = protocol.encode(frame)
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._publish, texts, shown)

    def announce(self, message: dict[str, Any]) -> None:
        """Send a message to every client, in the event loop."""
        for client in self._clients:
            client.answer(message)

    def _publish(self, texts: list[tuple[str, str]], frame: str) -> None:
        for client in self._clients:
            for kind, text in texts:
                client.tell(kind, text)
            client.show(frame)


def surroundings(rig: Parameters, choices: Choices) -> dict[str, Any]:
    """What a page must know of a rig and of what can be set."""
    g, air = rig.geometry, rig.air
    pivot1 = [g.d3 * math.cos(g.gamma3), g.d3 * math.sin(g.gamma3)]
    return {
        "choices": {
            "controller": choices.controllers,
            "compare": [{"name": NOTHING, "title": NOTHING, "about": "One rig alone."}, *choices.controllers],
            **{name: described(choices.words[name], about) for name, about in CHOICES.items()},
        },
        "defaults": opening_settings(rig).model_dump(),
        "ranges": {name: asdict(slider) for name, slider in choices.sliders.items()},
        "geometry": {
            "pivot1": pivot1,
            "pivot2": [0.0, 0.0],
            "d3": g.d3,
            "d6": g.d6,
            "k1": g.k1,
            "k2": g.k2,
            "half_stroke1": rig.cylinder1.stroke / 2,
            "half_stroke2": rig.cylinder2.stroke / 2,
            "workspace": workspace(rig),
            **shapes(rig),
        },
        "air": {"supply": air.supply_pressure, "atmosphere": air.atmospheric_pressure},
        "areas": [area for one in (rig.cylinder1, rig.cylinder2) for area in (one.area_p, one.area_n)],
        "drag_limit": DRAG_LIMIT,
        "words": words(),
    }


def workspace(rig: Parameters) -> list[list[float]]:
    """Outline of where the end effector can be, m: out along cylinder 2's shortest length, back along its longest."""
    y1 = np.linspace(-rig.cylinder1.stroke / 2, rig.cylinder1.stroke / 2, EDGE)
    half2 = np.full(EDGE, rig.cylinder2.stroke / 2)
    near, far = end_effector(np.stack([y1, -half2]), rig), end_effector(np.stack([y1, half2]), rig)
    return [[round(float(x), 6), round(float(y), 6)] for x, y in np.concatenate([near, far[:, ::-1]], axis=1).T]
