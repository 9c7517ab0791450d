"""Loops in the text of PTX, and what memory they access."""

import re
from collections import Counter

_FUNCTION = re.compile(r"^(?:\.visible \.entry|\.func)[^{]*?(\w+)\([^{]*\{(.*?)^\}", re.MULTILINE | re.DOTALL)
_LABEL = re.compile(r"(\$\w+):")
_BRANCH = re.compile(r"(@!?%p\d+\s+)?bra(?:\.uni)?\s+(\$\w+)")
_MEMORY = re.compile(r"\b(?:ld|st|atom|red)\.\S+")


def functions_in(text):
    """Name -> body."""
    return dict(_FUNCTION.findall(text))


def loops_in(body):
    """The instructions of every loop of a function, the innermost first; a loop of several ways back is one."""
    blocks, after = _blocks(body)
    found = {}
    for end, first in _ways_back(after, next(iter(blocks))):
        inside, left = {first}, [end]
        while left:
            name = left.pop()
            if name not in inside:
                inside.add(name)
                left += [one for one, others in after.items() if name in others]
        found.setdefault(first, set()).update(inside)
    return [[line for name in one for line in blocks[name]] for one in sorted(found.values(), key=len)]


def memory_of(instructions):
    """Kind of access (``ld.shared``, ``st.local``; ``ld.generic`` where none is named) -> how many there are."""
    found = Counter()
    for line in instructions:
        for access in _MEMORY.findall(line):
            operation, *words = access.split(".")
            spaces = [word for word in words if word in ("shared", "local", "global", "param", "const")]
            found[f"{operation}.{(spaces or ['generic'])[0]}"] += 1
    return found


def _blocks(body):
    """Label -> instructions, and label -> those that may follow."""
    blocks, now = {"": []}, ""
    for line in filter(None, map(str.strip, body.splitlines())):
        label = _LABEL.match(line)
        if label:
            now = label[1]
        elif blocks[now] and _BRANCH.search(blocks[now][-1]):
            now = f"{now}'"  # behind a branch
        blocks.setdefault(now, [])
        if not label:
            blocks[now].append(line)
    names, after = list(blocks), {}
    for name, behind in zip(names, [*names[1:], None], strict=True):
        last = blocks[name][-1] if blocks[name] else ""
        branch = _BRANCH.search(last)
        others = [branch[2]] if branch else []
        if last.startswith("brx.idx"):
            (table,) = re.findall(r"\$\w+(?=;)", last)
            others += re.findall(r"\$\w+", body.split(f"{table}:", 1)[1].split(";", 1)[0])
        elif behind and not (branch and not branch[1]) and not last.startswith(("ret", "exit")):
            others.append(behind)
        after[name] = others
    return blocks, after


def _ways_back(after, first):
    """Pairs (end, first) of blocks, of every branch to a block from which the way came."""
    found, done, path = [], set(), [(first, iter(after[first]))]
    on = {first}
    while path:
        name, others = path[-1]
        other = next(others, None)
        if other is None:
            path.pop()
            on.discard(name)
            done.add(name)
        elif other in on:
            found.append((name, other))
        elif other not in done:
            on.add(other)
            path.append((other, iter(after[other])))
    return found
