"""How many operations of each kind code executes: counters put into its LLVM code."""

import re

KINDS = {
    "fadd": "sum", "fsub": "sum", "fneg": "sum", "fmul": "product", "fdiv": "quotient", "fcmp": "comparison",
    "load": "memory", "store": "memory", "call": "call", "sitofp": "conversion", "uitofp": "conversion",
    "fptosi": "conversion", "fptoui": "conversion", "br": "branch", "switch": "branch",
}  # fmt: skip
ROOT, FREE = re.compile(r"@llvm\.sqrt"), re.compile(r"@llvm\.(?!sqrt|floor|fabs|copysign|minnum|maxnum)")
OPERATIONS = ("sum", "product", "quotient", "root", "comparison", "conversion", "memory", "whole", "branch", "call")
"""Kinds of operations; ``whole`` are those of whole numbers and addresses, and choices."""

COUNTS = "birthsim_counts"
_LABEL = re.compile(r'^[\w.$"-]+:')


def counted(code: str) -> str:
    """LLVM code that adds up its operations in an array of 64-bit numbers, ``COUNTS``, in the order of ``OPERATIONS``."""
    lines, block, inside = [], [], False  # type: list[str], list[str], bool
    number = 0
    for line in code.splitlines():
        starts = line.startswith("define ")
        if inside and (_LABEL.match(line) or line == "}"):
            lines += _with_counters(block, number)
            number, block, inside = number + 1, [], line != "}"
            lines.append(line)
        elif inside:
            block.append(line)
        else:
            lines.append(line)
            inside = starts
    size = len(OPERATIONS)
    return "\n".join([*lines, f"@{COUNTS} = global [{size} x i64] zeroinitializer", ""])


def _with_counters(block: list[str], number: int) -> list[str]:
    """A block of code, with counters behind its phi instructions."""
    counts = dict.fromkeys(OPERATIONS, 0)
    phis = 0
    for line in block:
        kind = _kind(line)
        if " = phi " in line:
            phis = block.index(line) + 1
        if kind:
            counts[kind] += 1
    added = []
    for k, (kind, count) in enumerate(counts.items()):
        if count:
            place = f"getelementptr inbounds ([{len(OPERATIONS)} x i64], ptr @{COUNTS}, i64 0, i64 {k})"
            name = f"%count.{number}.{kind}"
            added += [
                f"  {name} = load i64, ptr {place}",
                f"  {name}.more = add i64 {name}, {count}",
                f"  store i64 {name}.more, ptr {place}",
            ]
    return [*block[:phis], *added, *block[phis:]]


def _kind(line: str) -> str | None:
    words = line.strip().split(" = ")[-1].split()
    if not words or line.strip().startswith((";", "]", "i32 ", "i64 ")):
        return None
    operation = words[1] if words[0] in ("tail", "musttail", "notail") else words[0]
    if operation in ("phi", "ret", "unreachable", "alloca", "bitcast", "freeze", "ptrtoint", "inttoptr"):
        return None
    if operation == "call":
        return "root" if ROOT.search(line) else None if FREE.search(line) else "sum" if "@llvm." in line else "call"
    return KINDS.get(operation, "whole")
