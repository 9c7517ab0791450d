"""Files of networks that read a rig (``rig_reader``), and those that come with the package."""

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.estimation.rig_reader import INPUTS, LAYERS, READ
from baselines.network import PolicyNetwork
from birthsim_env.files import whole_file
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import near, problem, shown

READERS = Path(__file__).resolve().parent
"""Where those are that come with the package."""

NETWORK = ("mean", "variance", "enter.weight", "enter.bias", "leave.weight", "leave.bias")
MEMORY = ("enters.weight", "enters.bias", "own.weight", "own.bias")
"""Arrays in a file: those of the network, and those of its memory."""


def reader_names() -> list[str]:
    """Readers that come with the package."""
    return sorted(path.stem for path in READERS.glob("*.npz"))


def save_reader(network: PolicyNetwork, path: Path) -> None:
    """Write a reader's file, which appears whole or not at all."""
    (enter, leave), (enters, own) = network.layers, network.memory
    arrays: tuple[NDArray[Any], ...] = (network.mean, network.variance, *enter, *leave, *enters, *own)
    content: dict[str, Any] = dict(zip(NETWORK + MEMORY, arrays, strict=True))
    with whole_file(path) as file:
        np.savez(file, **content)


def reader_of(reader: object) -> PolicyNetwork | None:
    """The network of a controller's option ``reader``: a name, a file's path, or a network; None for "".

    Raises ``ValueError`` for anything else, and for a network that reads no rig."""
    if isinstance(reader, PolicyNetwork):
        return _required(reader, "reader")
    if not isinstance(reader, (str, Path)):
        raise ValueError(f"reader = {shown(reader)}; allowed: a name, a file's path, or a network")
    return load_reader(reader) if reader != "" else None


def load_reader(name: str | Path) -> PolicyNetwork:
    """The network of a reader by name, or of a reader's file. Nothing is unpickled.

    Raises ``ValueError`` for a name that is unknown, and a file that is damaged or of another network."""
    path = READERS / f"{name}.npz" if str(name) in reader_names() else Path(name)
    allowed = f"allowed: {', '.join([*reader_names(), 'a file reader.npz that birthsim train wrote'])}"
    if not path.is_file():
        raise ValueError(f"reader = {named(path)} is no file{near(str(name), reader_names())}; {allowed}")
    try:
        with path.open("rb") as raw, np.load(raw) as file:
            mean, variance, *arrays = (file[key] for key in NETWORK + MEMORY)
        pairs = tuple(zip(arrays[::2], arrays[1::2], strict=True))
        network = PolicyNetwork(mean, variance, pairs[:2], memory=pairs[2:])
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise ValueError(f"reader = {str(path)!r} is damaged ({problem(error)}); {allowed}") from error
    return _required(network, f"reader = {str(path)!r}")


def _required(network: PolicyNetwork, name: str) -> PolicyNetwork:
    """The network; ``ValueError`` where it is none that reads a rig."""
    if (network.inputs, network.outputs, len(network.layers)) != (INPUTS, 2 * READ, LAYERS) or not network.memory:
        shape = f"{network.inputs} to {network.outputs} numbers by {len(network.layers)} layers, {network.cells} cells"
        raise ValueError(f"{name} maps {shape}; allowed: {INPUTS} to {2 * READ} by {LAYERS}, with a memory")
    return network
