"""The hub of a rig in motion: drags, settings, resets and recordings."""

from __future__ import annotations

import asyncio
import contextlib
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from baselines.controller import Controller
from baselines.work.files import LEFTOVERS, remove_leftovers
from birthsim_live.rig.clock import LOG
from birthsim_live.rig.controllers import build_controller
from birthsim_live.rig.hand import PATIENCE, Hold, Push
from birthsim_live.rig.recorder import Recorder
from birthsim_live.rig.recording import SUFFIX
from birthsim_live.rig.session import Session
from birthsim_live.rig.settings import NOTHING, combined
from birthsim_live.server import protocol
from birthsim_live.server.clients import Client
from birthsim_live.server.hub import Hub


class LiveHub(Hub):
    """All clients see and push the rig of one session; recordings go to ``folder``."""

    mode = "live"

    def __init__(self, session: Session, folder: Path) -> None:
        super().__init__(session, session.rig, session.choices)
        self.folder = folder
        self._session = session
        self._holder: Client | None = None
        self._heard = 0.0
        self._pending: dict[str, Any] = {}
        self._askers: set[Client] = set()
        self._wake, self._idle = asyncio.Event(), asyncio.Event()
        self._idle.set()
        self._settling: asyncio.Task[None] | None = None
        self._last: str | None = None
        self._paths, self._path = session.paths, session.path()

    async def open(self) -> None:
        await super().open()
        self._settling = asyncio.create_task(self._settle())

    async def close(self) -> None:
        if self._settling is not None:
            self._settling.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._settling
        await super().close()

    def finish(self) -> None:
        """Stop the clock; a running recording is finished."""
        super().finish()
        recorder = self._take_recorder()
        if recorder is not None:
            try:
                recorder.finish()
            except OSError as error:
                print(_ends_early(recorder, error), file=sys.stderr)
            else:
                print(f"recording finished: {recorder.path}", flush=True)

    def leave(self, client: Client) -> None:
        super().leave(client)
        self._askers.discard(client)
        self._release(client)

    async def act(self, client: Client, message: protocol.Message) -> None:
        match message:
            case protocol.Drag(position=position, id=identity):
                self._hold(client, Hold(np.array(position), identity))
            case protocol.Push(force=force, id=identity):
                self._hold(client, Push(np.array(force), identity))
            case protocol.Release():
                self._release(client)
            case protocol.Set(settings=settings):
                self._set(client, settings)
            case protocol.Reset():
                await self._idle.wait()
                await self.ask(self._reset)
            case protocol.Record(on=True):
                await self._idle.wait()
                path = await asyncio.to_thread(_new_file, self.folder)
                await self._begin_recording(path)
            case protocol.Record(on=False):
                await self._end_recording()
            case _:
                raise ValueError(f"{type(message).__name__.lower()} in a live session; allowed: in a replay")

    def news(self) -> dict[str, dict[str, Any]]:
        session, clock = self._session, self.clock
        recorder = session.recorder
        if recorder is not None and recorder.full and self._loop is not None:
            self._loop.call_soon_threadsafe(lambda: asyncio.ensure_future(self._end_recording()))
        recording = None if recorder is None else {"file": recorder.path.name, "seconds": int(recorder.seconds)}
        state = {
            "type": "state",
            "paused": clock.paused,
            "speed": clock.speed,
            "recording": recording,
            "last_recording": self._last,
            "dragging": session.hands.hold is not None,
            "duration": session.duration,
        }
        if self._paths != session.paths:
            self._paths, self._path = session.paths, session.path()
        return {
            "settings": {"type": "settings", "settings": session.shown_settings()},
            "state": state,
            "path": {"type": "path", "points": self._path},
        }

    def _publish(self, texts: list[tuple[str, str]], frame: str) -> None:
        if self._holder is not None and time.monotonic() - self._heard > PATIENCE:
            self._release(self._holder)
        super()._publish(texts, frame)

    def _hold(self, client: Client, hold: Hold | Push) -> None:
        self._holder, self._heard = client, time.monotonic()
        self._session.hands.hold = hold

    def _release(self, client: Client) -> None:
        if self._holder is client:
            self._holder = self._session.hands.hold = None

    def _reset(self) -> None:
        self._session.reset()
        self.clock.restart()

    def _set(self, client: Client, settings: Mapping[str, Any]) -> None:
        self._pending = combined(self._pending, self._session.choices.checked(settings))
        self._askers.add(client)
        self._idle.clear()
        self._wake.set()

    async def _settle(self) -> None:
        """Apply what is set, all at once what came in since the last time: a flood of events is one change."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            changes, self._pending = self._pending, {}
            askers, self._askers = self._askers, set()
            try:
                await self._change(changes)
            except Exception as error:
                if not isinstance(error, ValueError):
                    LOG.exception("settings %s", changes)
                for client in askers:
                    client.answer(protocol.error(str(error)))
            if not self._pending:
                self._idle.set()

    async def _change(self, changes: dict[str, Any]) -> None:
        session, built = self._session, []
        for role, now in (("controller", session.settings.controller), ("compare", session.settings.compare)):
            name = changes.get(role, now)
            # Some take a while to build; the rig runs on with the one it has.
            new = name not in (now, NOTHING)
            built.append(await asyncio.to_thread(build_controller, name, session.rig) if new else None)
        await self.ask(lambda: self._apply(changes, *built))

    def _apply(self, changes: dict[str, Any], controller: Controller | None, compared: Controller | None) -> None:
        time = self._session.time
        self._session.change(changes, controller, compared)
        if self._session.time < time:  # what is compared starts anew
            self.clock.restart()

    async def _begin_recording(self, path: Path) -> None:
        recorder = await self.ask(lambda: self._put_recorder(path))
        if recorder is None:
            return
        try:
            while True:
                try:
                    await asyncio.to_thread(recorder.open)
                    break
                except FileExistsError:  # another server has the name since a moment
                    recorder.path = await asyncio.to_thread(_new_file, self.folder)
        except OSError:
            await self.ask(self._take_recorder)
            raise

    def _put_recorder(self, path: Path) -> Recorder | None:
        if self._session.recorder is not None:
            return None
        self._session.recorder = Recorder(self._session, path)
        return self._session.recorder

    async def _end_recording(self) -> None:
        recorder = await self.ask(self._take_recorder)
        if recorder is None:
            return
        try:
            await asyncio.to_thread(recorder.finish)
        except OSError as error:
            self.announce(protocol.error(_ends_early(recorder, error)))
        self._last = recorder.path.name

    def _take_recorder(self) -> Recorder | None:
        recorder, self._session.recorder = self._session.recorder, None
        return recorder


def _ends_early(recorder: Recorder, error: OSError) -> str:
    return f"recording {recorder.path} ends early: {error.strerror or error}; what came before is kept"


def _new_file(folder: Path) -> Path:
    """A name in ``folder`` that no file has; the folder is made if it is missing."""
    folder.mkdir(parents=True, exist_ok=True)
    remove_leftovers(folder.glob(LEFTOVERS))
    stem, k = time.strftime("birthsim-%Y%m%d-%H%M%S"), 1
    while (path := folder / f"{stem}{'' if k == 1 else f'-{k}'}{SUFFIX}").exists():
        k += 1
    return path
