"""A controller that runs in Python for a rig in somebody's browser (``page/worker/remote.js``).

A socket is one controller, from its making to its end, in a thread of its own, so that one that hangs stops nothing else that
is served. In each control period the page sends numbers: 1 where positions are
samples, else 0, and the rows of ``Signals``; the answer are the openings of the four valves. Where the controller gives up the
answer is a line of text, and the end.
"""

import asyncio
import traceback
from collections.abc import Callable, Collection
from concurrent.futures import Future
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np
from starlette.websockets import WebSocket, WebSocketDisconnect

from baselines.controller import Controller, checked_command
from birthsim_env.loop.rows import ASKED, REFERENCE, measurement_of
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.rig.parameters import Parameters


def made(name: str, rig: Parameters) -> Controller:
    """The controller ``name``."""
    from baselines.registry import make_controller  # which takes a third of a second to load

    return make_controller(name, rig)


async def command(socket: WebSocket, rig: Parameters, names: Collection[str]) -> None:
    """Run the controller that the socket's address names, one of ``names``, until the page leaves or it gives up."""
    name = socket.query_params.get("name", "")
    if name not in names:
        await socket.close(1008)
        return
    await socket.accept()
    questions = SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None]()
    Thread(target=_answer, args=(questions,), daemon=True).start()

    def asked(function: Callable[..., Any], *arguments: Any) -> asyncio.Future[Any]:
        answer = Future[Any]()
        questions.put((answer, partial(function, *arguments)))
        return asyncio.wrap_future(answer)

    try:
        law = await asked(made, name, rig)
        while True:
            numbers = np.frombuffer(await socket.receive_bytes())
            await socket.send_bytes(await asked(openings, law, name, rig, numbers))
    except WebSocketDisconnect:
        return
    except Exception as error:
        traceback.print_exc()
        await socket.send_text("".join(traceback.format_exception_only(error)).strip().splitlines()[-1])
        await socket.close()
    finally:
        questions.put(None)


def _answer(questions: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None]) -> None:
    """Answer questions in turn until there is None."""
    while (question := questions.get()) is not None:
        answer, function = question
        if answer.set_running_or_notify_cancel():
            try:
                answer.set_result(function())
            except BaseException as error:  # a user's own code may also end Python
                answer.set_exception(error)


def openings(law: Controller, name: str, rig: Parameters, numbers: Any) -> bytes:
    """What a controller answers, as four numbers."""
    if numbers.shape != (1 + ASKED,):
        raise ValueError(f"{numbers.size} numbers; allowed: {1 + ASKED}")
    sampled, rows = bool(numbers[0]), numbers[1:, None].copy()
    has_acceleration = sampled and rig.electronics.acceleration_bandwidth > 0.0
    measurement = measurement_of(rows, sampled, has_acceleration)
    return checked_command(name, law.command(measurement, Reference(rows[REFERENCE:])), 1).tobytes()
