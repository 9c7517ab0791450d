"""LLVM code that Numba makes, without what belongs to this processor or to Python; and the machine that it is emitted for."""

import re
from typing import Any

import llvmlite.binding as llvm

from birthsim_build.code.targets import Target


def machine_of(target: Target) -> Any:
    """LLVM's machine for a target."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    chosen = llvm.Target.from_triple(target.triple)
    return chosen.create_target_machine(
        cpu=target.processor, features=target.features, opt=3, reloc=target.reloc, codemodel="default"
    )


def head_of(target: Target, machine: Any) -> str:
    """The first lines of code for a target."""
    return f'target datalayout = "{machine.target_data}"\ntarget triple = "{target.triple}"\n'


def cleaned(code: str) -> str:
    """Code for any target."""
    code = re.sub(r"^target .*$|^source_filename.*$", "", code, flags=re.MULTILINE)
    code = re.sub(r'"target-(cpu|features)"="[^"]*"', "", code).replace("= common ", "= internal ")
    # Nothing is raised, so that no target needs tables to unwind.
    code = re.sub(r"^(define [^{]*)\{$", r"\1nounwind {", code, flags=re.MULTILINE)
    # IEEE's own operations: processors that have an instruction for them need no library.
    for operation, numbers in (("sqrt", 1), ("floor", 1), ("fabs", 1), ("copysign", 2)):
        intrinsic = f"@llvm.{operation}.f64("
        code = code.replace(f"@{operation}(", intrinsic)
        code = re.sub(rf"^declare .*{re.escape(intrinsic)}.*$", "", code, flags=re.MULTILINE)
        code += f"\ndeclare double {intrinsic}{', '.join(['double'] * numbers)})"
    return code


def hide(module: Any, exported: str) -> None:
    """Make all internal that is defined, but for names that begin with ``exported``."""
    for one in [*module.functions, *module.global_variables]:
        if not one.is_declaration and not one.name.startswith(exported):
            one.linkage = llvm.Linkage.internal
