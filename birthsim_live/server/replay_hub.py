"""The hub of a recording: pause, slow motion, seek."""

from __future__ import annotations

from typing import Any

from birthsim_live.rig.player import Player
from birthsim_live.rig.settings import Choices
from birthsim_live.server import protocol
from birthsim_live.server.clients import Client
from birthsim_live.server.hub import Hub


class ReplayHub(Hub):
    """All clients see one recording."""

    mode = "replay"

    def __init__(self, player: Player) -> None:
        super().__init__(player, player.recording.rig, Choices(player.recording.rig))
        self._player = player

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
        }
        return {
            "settings": {"type": "settings", "settings": player.event("settings") or {}},
            "state": state,
            "path": {"type": "path", "points": player.event("path") or []},
        }

    def _seek(self, time: float) -> None:
        self._player.seek(time)
        self.clock.restart()
