"""FMU files: a description and binaries in a ZIP archive, without Python inside."""

import zipfile
from collections.abc import Sequence
from pathlib import Path

from birthsim_build.code.compiler import compile_object, link
from birthsim_build.fmu.description import model_description
from birthsim_build.fmu.model import Model
from birthsim_env.files import temporary_folder, whole_file

HERE = Path(__file__).parent

VERSIONS = (2, 3)
"""Of the FMI standard."""

BINARIES = {
    "x86-64": ("linux64", "x86_64-linux", "so", "x86_64-linux-gnu.2.17"),
    "aarch64": ("aarch64-linux", "aarch64-linux", "so", "aarch64-linux-gnu.2.17"),
    "x86-64-windows": ("win64", "x86_64-windows", "dll", "x86_64-windows-gnu"),
}
"""Folder of a target's binary in FMI 2.0 and 3.0, its ending, and what zig calls the target."""


def write_fmu(model: Model, version: int, path: Path, targets: Sequence[str] = ("x86-64",)) -> None:
    """Write the FMU of a model for version 2 or 3 of the standard, whole or not at all."""
    name = model.description.identifier
    with temporary_folder() as place, whole_file(path) as file:
        (place / "model.h").write_text(model.header)
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            _put(archive, "modelDescription.xml", model_description(model.description, version))
            for target in targets:
                two, three, ending, name_of_zig = BINARIES[target]
                compile_object(model.functions, target, place / f"{target}.o", {"birthsim_image": model.image})
                # A library for Windows knows the name that it was written under.
                binary = place / target / f"{name}.{ending}"
                binary.parent.mkdir()
                sources = [HERE / "c" / f"fmi{version}.c", *([HERE / "c" / "fmi3_refused.c"] if version == 3 else [])]
                link(
                    *("cc", "-target", name_of_zig, "-shared", "-fPIC", "-O2", "-std=c99", "-fno-strict-aliasing"),
                    *("-ffp-contract=off", "-fvisibility=hidden", "-s"),
                    *(f"-I{headers}" for headers in (HERE / "fmi_headers", HERE / "c", place)),
                    *map(str, sources),
                    str(place / f"{target}.o"),
                    "-lm",
                    "-o",
                    str(binary),
                )
                _put(archive, f"binaries/{three if version == 3 else two}/{binary.name}", binary.read_bytes())


def _put(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    """Add a file whose date says nothing, so that equal models have equal archives."""
    entry = zipfile.ZipInfo(name)
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    archive.writestr(entry, content)
