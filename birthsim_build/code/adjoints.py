"""The way back through a program: what ``threads.advance`` keeps of a lane on a tape, and what walks that tape.

The code of both is made by one call, for a processor, PTX or WebAssembly alike, and needs nothing from elsewhere:

    recorder = Recorder(simulation)            # of lanes that have begun
    recorder.prepare()
    pieces, like = pieces_of(simulation), pieces_of(the same with another number of lanes)
    program = program_of(pieces, like, pieces.functions, recorder.loop)
    compile_object(pieces.functions, "wasm", out, threads=program.threads)    # or building.write_wasm, which links

The object has ``birthsim_place``, ``_fill``, ``_advance`` and ``_backward``. After the first two ``birthsim_advance(thread,
block, width, program, periods, tape)`` runs a lane, and where the address ``tape`` is not 0, writes ``tape`` (words, lanes):
the rig, room for bars, and what adjoints read, ``program.tape(periods)`` words in all. Gradients to the live rows at the end
are then written into the bars; ``birthsim_backward`` with the same arguments takes them to the beginning, with the bits of
``TapedLoop``. Bars of a row of the loop stand in row ``PARAMETERS + recorder.loop.live.index(row)`` of the tape.
"""

from birthsim_build.code.advance import words
from birthsim_build.code.tape import ABOUT, ENTRY, KEEP, column
from birthsim_build.code.threads import HEAD, LANES, WAY_BACK
from birthsim_env.loop.stage import call, numbers
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS


@kernel
def backward(program: int, lane: int, periods: int, tape: int, space: int, dispatch: int) -> int:
    """Take the bars of a lane to the beginning of the ``periods`` on its tape, with its memory at the address ``space``.

    ``dispatch`` is the address of what calls an adjoint by its number."""
    head = words(program, HEAD)
    lanes, about = head[LANES], program + 8 * head[WAY_BACK]
    if lane >= lanes:
        return 0
    live, keeps, entries, of_period, of_closing, takes, gives = words(about, ABOUT)
    place, first = PARAMETERS + live + periods * of_period + of_closing, about + 8 * (ABOUT + KEEP * keeps)
    bars_at, given_at = space + 8 * PARAMETERS, space + 8 * (PARAMETERS + live)
    result_at, read_at = given_at + 8 * takes, given_at + 8 * (takes + gives)
    kept, own = column(tape, lanes, place), numbers(space, PARAMETERS + live)
    for row in range(PARAMETERS + live):
        own[row] = kept[row, lane]
    for period in range(periods - 1, -1, -1):
        for e in range(entries - 1, -1, -1):
            number, constants, reads, touched, count, closes = words(first + 8 * ENTRY * e, ENTRY)
            if closes == 0 or period == periods - 1:
                place -= reads
                read, rows = numbers(read_at, reads), words(program + 8 * touched, count)
                bars, given, result = numbers(bars_at, live), numbers(given_at, count), numbers(result_at, count)
                for k in range(reads):
                    read[k] = kept[place + k, lane]
                for k in range(count):
                    given[k] = bars[rows[k]]
                call(dispatch, number, read_at, given_at, result_at, space, program + 8 * constants, lane)
                for k in range(count):
                    bars[rows[k]] = result[k]
    for row in range(PARAMETERS, PARAMETERS + live):
        kept[row, lane] = own[row]
    return 0
