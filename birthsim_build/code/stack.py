"""How much stack code for ARM takes, from its assembly: frames of functions, and which function calls which."""

import re

_LABEL = re.compile(r"^([\w.$]+):")
_FUNCTION = re.compile(r"\.type\s+([\w.$]+),%function")
_SAVED = re.compile(r"^\s+(v?)push(?:\.w)?\s+\{([^}]*)\}")
_MOVED = re.compile(r"^\s+subw?(?:\.w)?\s+sp,(?:\s*sp,)?\s*#(\d+)")
_CALL = re.compile(r"^\s+(?:bl|b|b\.w)\s+([\w.$]+)\s*$")
POINTER = "*"
"""Stands for whatever a pointer calls."""
_POINTED = re.compile(r"^\s+blx\s+r")


def stack_bytes(assembly: str, entry: str, pointed: str) -> int:
    """Bytes of stack of ``entry`` with all that it calls; a call by a pointer may reach whatever begins with ``pointed``."""
    frames, calls = _functions(assembly)

    def deepest(name: str) -> int:
        called = {other for other in calls[name] if other in frames and other != name}
        if POINTER in calls[name]:
            called |= {other for other in frames if other.startswith(pointed)}
        return frames[name] + max((deepest(other) for other in called), default=0)

    return deepest(entry)


def _functions(assembly: str) -> tuple[dict[str, int], dict[str, set[str]]]:
    """Bytes of each function's frame, and what it calls."""
    functions = set(_FUNCTION.findall(assembly))
    frames: dict[str, int] = dict.fromkeys(functions, 0)
    calls: dict[str, set[str]] = {name: set() for name in functions}
    now = ""
    for line in assembly.splitlines():
        label = _LABEL.match(line)
        if label:
            now = label[1] if label[1] in functions else now
        elif saved := _SAVED.match(line):
            frames[now] += (8 if saved[1] else 4) * len(saved[2].split(","))
        elif moved := _MOVED.match(line):
            frames[now] += int(moved[1])
        elif call := _CALL.match(line):
            calls[now].add(call[1])
        elif _POINTED.match(line):
            calls[now].add(POINTER)
    return frames, calls
