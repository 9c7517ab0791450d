"""A bill of materials (CycloneDX, JSON): the installed environment, and the files of others that the wheel itself carries.

``sbom.py PYTHON OUT``: PYTHON is the interpreter of the environment, OUT the file to write. cyclonedx-py must stand beside the
interpreter that runs this.
"""

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
VENDOR = ROOT / "birthsim_live" / "page" / "vendor"


def uplot() -> dict[str, Any]:
    """The chart library of the page, with the version that it names itself and the hashes of its files."""
    found = re.search(r"\(v([\d.]+)\)", (VENDOR / "uPlot.esm.js").read_text(encoding="utf-8")[:500])
    if found is None:
        raise ValueError(f"{VENDOR / 'uPlot.esm.js'} names no version")
    reference = f"pkg:npm/uplot@{found[1]}"
    files = [
        {
            "type": "file",
            "bom-ref": f"{reference}#{path.name}",
            "name": path.relative_to(ROOT).as_posix(),
            "hashes": [{"alg": "SHA-256", "content": hashlib.sha256(path.read_bytes()).hexdigest()}],
        }
        for path in sorted(VENDOR.iterdir())
    ]
    licence = [{"license": {"id": "MIT"}}]
    return {
        "type": "library",
        "bom-ref": reference,
        "purl": reference,
        "name": "uplot",
        "version": found[1],
        "licenses": licence,
        "components": files,
    }


def main(python: str, out: str) -> None:
    """Writes the bill."""
    tool = Path(sys.executable).with_name("cyclonedx-py")
    command = [str(tool), "environment", python, "--pyproject", str(ROOT / "pyproject.toml"), "--output-reproducible"]
    done = subprocess.run([*command, "--gather-license-texts"], check=True, capture_output=True, text=True)
    bill = json.loads(done.stdout)
    vendored = uplot()
    bill["components"].append(vendored)
    project = bill["metadata"]["component"]["bom-ref"]
    for dependency in bill["dependencies"]:
        if dependency["ref"] == project:
            dependency.setdefault("dependsOn", []).append(vendored["bom-ref"])
    bill["dependencies"].append({"ref": vendored["bom-ref"]})
    Path(out).write_text(json.dumps(bill, indent=1) + "\n", encoding="utf-8")
    print(f"{out}: {len(bill['components'])} components")


if __name__ == "__main__":
    main(*sys.argv[1:])
