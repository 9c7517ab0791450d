"""A controller that runs in Python for a rig in somebody's browser (``page/worker/remote.js``).

A socket is one controller, from its making to its end, in a thread of its own, so that one that hangs stops nothing else that
is served. In each control period the page sends numbers: 1 where positions are
samples, else 0, and the rows of ``Signals``; the answer are the openings of the four valves. Where the controller gives up the
answer is a line of text, and the end.
"""

import asyncio
import contextlib
import traceback
from collections.abc import Callable, Collection
from concurrent.futures import Future
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray
from starlette.types import Message
from starlette.websockets import WebSocket, WebSocketDisconnect

from baselines.controller import Controller, checked_command
from birthsim_env.loop.rows import ASKED, REFERENCE, measurement_of
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem, shown

BYTES = 8 * (1 + ASKED)
"""Of a question."""


def made(name: str, rig: Parameters) -> Controller:
    """The controller ``name``."""
    from baselines.named import make_controller  # which takes a third of a second to load

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
            sampled, rows = measured(await socket.receive())
            await socket.send_bytes(await asked(openings, law, name, rig, sampled, rows))
    except WebSocketDisconnect:
        return
    except UnreadableError as error:
        await _refuse(socket, f"ValueError: {error}", 1003)
    except Exception as error:
        traceback.print_exc()
        await _refuse(socket, "".join(traceback.format_exception_only(error)).strip().splitlines()[-1], 1000)
    finally:
        questions.put(None)


async def _refuse(socket: WebSocket, words: str, code: int) -> None:
    """Say why there is no answer, and end, where somebody is still there to hear it."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        await socket.send_text(words)
        await socket.close(code)


class UnreadableError(ValueError):
    """A message that is no measurement: the client's fault, of which the author of a controller need not know."""


def measured(message: Message) -> tuple[bool, NDArray[np.float64]]:
    """Whether positions are samples, and the rows ``Signals`` (ASKED, 1), in a message of the socket.

    Raises ``WebSocketDisconnect`` at its end, and ``UnreadableError`` for one that is no measurement.
    """
    if message["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(message.get("code", 1005), message.get("reason"))
    content = message.get("bytes")
    if content is None:
        raise UnreadableError(f"a message of text, {shown(message.get('text'))}; allowed: {1 + ASKED} float64, {BYTES} bytes")
    if len(content) != BYTES:
        raise UnreadableError(f"a message of {len(content)} bytes; allowed: {1 + ASKED} float64, {BYTES} bytes")
    numbers = np.frombuffer(content)
    if numbers[0] not in (0.0, 1.0):
        raise UnreadableError(f"the first number is {numbers[0]:g}; allowed: 1 where positions are samples, else 0")
    return bool(numbers[0]), numbers[1:, None].copy()


def _answer(questions: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None]) -> None:
    """Answer questions in turn until there is None."""
    while (question := questions.get()) is not None:
        answer, function = question
        if answer.set_running_or_notify_cancel():
            try:
                answer.set_result(function())
            except Exception as error:
                answer.set_exception(error)
            except BaseException as error:  # a user's own code that ends Python, which would end the server
                answer.set_exception(RuntimeError(f"it ends Python: {problem(error)}"))


def openings(law: Controller, name: str, rig: Parameters, sampled: bool, rows: NDArray[np.float64]) -> bytes:
    """What a controller answers to ``measured``, as four numbers."""
    has_acceleration = sampled and rig.electronics.acceleration_bandwidth > 0.0
    measurement = measurement_of(rows, sampled, has_acceleration)
    return checked_command(name, law.command(measurement, Reference(rows[REFERENCE:])), 1).tobytes()
