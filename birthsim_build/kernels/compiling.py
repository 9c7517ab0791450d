"""Objects of one kernel for every library: Numba's code as it is before LLVM sees it, optimised for each processor by itself.

Numba's passes are run in Numba's order, but for the library's processor. Code that was optimised already, and is once more for
another processor, is slower by a tenth.
"""

import re
from collections.abc import Sequence
from functools import cache
from typing import Any

import llvmlite.binding as llvm
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from birthsim_build.code.llvm_code import cleaned, head_of, hide, machine_of
from birthsim_build.kernels.entry import entry_code
from birthsim_build.kernels.kinds import result_of, types_of
from birthsim_build.kernels.libraries import LIBRARIES
from birthsim_build.kernels.runtime import RUNTIME, without_counts
from birthsim_env.physics.compiled import with_numba


def objects_of(kernel: Any, kinds: Sequence[str], symbol: str, libraries: Sequence[str]) -> tuple[str, dict[str, bytes]]:
    """The kind of a kernel's result, and its object for each of the ``libraries``, which exports ``symbol``."""
    native, code, arguments, result = _numbas_code(kernel, kinds)
    entry = entry_code(symbol, native, kinds, arguments, result)
    return result, {name: _object(code, entry, name, symbol) for name in libraries}


@global_compiler_lock  # type: ignore[untyped-decorator]
def _numbas_code(kernel: Any, kinds: Sequence[str]) -> tuple[str, str, tuple[Any, ...], str]:
    """Symbol and code of what Numba makes, not optimised; with the types of its arguments and the kind of its result."""
    _set_up()
    arguments = types_of(kernel, kinds)
    # As a helper its code is that of all it calls, and is not optimised.
    inlined = with_numba.helper(kernel.py_func)
    inlined.compile(arguments)
    made = inlined.overloads[arguments]
    code = without_counts(cleaned(str(made.library._get_module_for_linking())))
    return made.fndesc.mangled_name, code, arguments, result_of(made.signature.return_type)


@cache
def _set_up() -> None:
    """Numba optimises functions for the processor that it runs on as it adds them; and it tells users to wait."""
    event.unregister("numba:compile", with_numba.ANNOUNCER)  # type: ignore[no-untyped-call]
    codegen = cpu_target.target_context.codegen()
    builder = codegen._pass_builder()
    codegen._function_pass_manager = lambda: (llvm.create_new_function_pass_manager(), builder)


def _object(code: str, entry: str, library: str, symbol: str) -> bytes:
    target = LIBRARIES[library]
    machine = machine_of(target)
    head = head_of(target, machine)
    module = llvm.parse_assembly(head + entry + RUNTIME)
    module.link_in(llvm.parse_assembly(head + code))
    hide(module, symbol)
    _optimise(module, machine)
    module.verify()
    _rename(module, symbol)
    return bytes(machine.emit_object(module))


def _optimise(module: Any, machine: Any) -> None:
    """What ``numba.core.codegen`` does to a function, before what it calls is known, and to a library."""

    def passes(speed: int, vectorise: bool) -> Any:
        tuning = llvm.create_pipeline_tuning_options(speed_level=speed)
        tuning.loop_vectorization = tuning.slp_vectorization = vectorise
        return llvm.create_pass_builder(machine, tuning)

    full = passes(3, True)
    each = full.getFunctionPassManager()
    each.add_refprune_pass()
    for function in module.functions:
        if not function.is_declaration:
            each.run(function, full)
    # First as much as possible into one function, so that counts of references are seen to cancel.
    cheap = passes(0, False)
    first = cheap.getModulePassManager()
    first.add_loop_rotate_pass()
    first.add_instruction_combine_pass()
    first.add_jump_threading_pass()
    first.add_refprune_pass()
    first.run(module, cheap)
    whole = full.getModulePassManager()
    whole.add_refprune_pass()
    whole.run(module, full)


def _rename(module: Any, symbol: str) -> None:
    """Names that Numba gave hold numbers that depend on what else was compiled."""
    inside = [one for one in (*module.functions, *module.global_variables) if not one.is_declaration and one.name != symbol]
    for k, one in enumerate(inside):
        one.name = f"inside{k}"
    if any(re.search(r"pickle|NumbaEnv", str(one)) for one in inside):
        raise ValueError(f"{symbol} keeps an object of Python; allowed: kernels that raise nothing but for want of memory")
