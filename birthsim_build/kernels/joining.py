"""How objects become a library."""

from collections.abc import Mapping
from pathlib import Path

from birthsim_build.code.compiler import EMULATIONS, link
from birthsim_env.files import temporary_folder

_ELF = ("-shared", "--strip-all", "--gc-sections", "--hash-style=gnu", "--build-id=none", "-z", "separate-code")
_ZIG = {"x86-64-v3.dll": "x86_64-windows-gnu", "aarch64.dylib": "aarch64-macos"}


def join(name: str, objects: Mapping[str, bytes], out: Path) -> None:
    """Write the library ``name`` of objects, by their symbols, to ``out``; ``ValueError`` where the linker refuses.

    It depends on nothing but their content: no path, no time and no order of theirs stands in it.
    """
    with temporary_folder() as folder:
        places = []
        for symbol, content in sorted(objects.items()):
            places.append(str(folder / f"{symbol}.o"))
            Path(places[-1]).write_bytes(content)
        if name in _ZIG:
            link("cc", "-target", _ZIG[name], "-shared", "-s", "-o", str(out), *places)
        else:
            machine = next(emulation for processor, emulation in EMULATIONS.items() if name.startswith(processor))
            link("ld.lld", "-m", machine, *_ELF, "-o", str(out), *places)
    out.chmod(0o644)
