"""The way back through a program: what ``threads.advance`` keeps of a lane on a tape, and what walks that tape.

The code of both is made by one call, for a processor, PTX or WebAssembly alike, and needs nothing from elsewhere:

    env.reset(seed=...)                                    # a vector environment whose lanes begin
    recorder = Recorder(env.unwrapped.simulation)
    recorder.prepare()
    pieces = pieces_of(env.unwrapped.simulation)           # like: those of the same with another number of lanes
    program = program_of(pieces, like, pieces.functions, recorder.loop)
    write_wasm(pieces.functions, out, program.threads)     # or compile_object(pieces.functions, target, out, threads=...)

It has ``birthsim_place``, ``_begin``, ``_advance`` and ``_backward``, which are called with thread, block, threads a block, the
address of a copy of ``program.words``, and two numbers (``tests/build/way_back.mjs`` does it in WebAssembly):

1. ``place`` by one thread: the address of the data (``program.rows``, lanes), and how many lanes there are.
2. Write into the data what each array begins with: ``program.regions`` says where ``pieces.arrays()`` are, the action among
   them. Or ``begin`` (``threads.begin``): lanes begin as the first of ``pieces`` does, drawn where ``pieces`` begin episodes.
3. ``advance``: control periods of a policy step, and the address of a tape (``program.tape(periods)``, lanes), or 0 for none.
4. Write gradients into the bars of the tape: row ``PARAMETERS + recorder.at["reward"]``, or another name or ``carried`` of it;
   those of all other of the ``len(recorder.loop.live)`` rows are zero.
5. ``backward``: the same numbers as ``advance``. The bars at ``recorder.at["action"]`` are now gradients to the action, those
   at ``recorder.at["carried"]`` go to the same rows of the tape of the step before.

Lanes have the bits of ``TapedLoop``. Adjoints know a stage's constants: those of another rig or law are another program's.
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
