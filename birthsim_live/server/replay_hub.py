"""The hub of a recording: it waits for its first viewer; pause, slow motion, seek."""

from __future__ import annotations

from typing import Any

from birthsim_live.rig.player import Player
from birthsim_live.rig.settings import Choices
from birthsim_live.server import protocol
from birthsim_live.server.clients import Client
from birthsim_live.server.hub import Hub
from birthsim_live.server.past import whole


class ReplayHub(Hub):
    """All clients see one recording, the file ``name``."""

    mode = "replay"

    def __init__(self, player: Player, name: str) -> None:
        super().__init__(player, player.recording.rig, Choices(player.recording.rig))
        self._player, self._name = player, name
        self._whole = whole(player)
        self._waits = self.clock.paused = True

    async def join(self, client: Client) -> None:
        """Tell a new client everything; with the first one the recording begins."""
        await super().join(client)
        if self._waits:
            self._waits = False
            await self.ask(lambda: self.pause(False))

    def past(self) -> dict[str, Any]:
        """The whole recording."""
        return self._whole

    def pause(self, paused: bool) -> None:
        """Stand still or go on; from the end on, from the start."""
        if not paused and self._player.halted:
            self._player.seek(0.0)
        super().pause(paused)

    async def act(self, client: Client, message: protocol.Message) -> None:
        match message:
            case protocol.Seek(time=time):
                await self.ask(lambda: self._seek(time))
            case _:
                raise ValueError(f"{type(message).__name__.lower()} in a replay; allowed: pause, speed, seek, ping")

    def news(self) -> dict[str, dict[str, Any]]:
        player, clock = self._player, self.clock
        state = {
            "type": "state",
            "paused": clock.paused or player.halted,
            "speed": clock.speed,
            "recording": None,
            "last_recording": None,
            "dragging": player.frame()["pointer"] is not None,
            "duration": player.recording.duration,
            "file": self._name,
        }
        return {
            "settings": {"type": "settings", "settings": player.event("settings") or {}},
            "state": state,
            "path": {"type": "path", "points": player.event("path") or []},
        }

    def _seek(self, time: float) -> None:
        self._player.seek(time)
        self.clock.restart()
