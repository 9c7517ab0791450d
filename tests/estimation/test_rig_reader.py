"""The network that reads a rig: what it sees, its arithmetic in the loop against NumPy's, what it tells, and its file."""

from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest

from agents.reader.rounds import Watched, blank
from baselines.admittance.controller import AdmittanceController
from baselines.driving import driving
from baselines.estimation import rig_filter, rig_reader
from baselines.estimation.readers import load_reader, reader_names, save_reader
from baselines.estimation.rig_filter import CERTAIN, EVERY, REACH, SIZE, TOLD, RigFilter, spread_of
from baselines.estimation.rig_reader import FAR, INPUTS, READ, SUMS, SURE, RigReader
from baselines.named import make_controller
from baselines.network import PolicyNetwork
from birthsim_env.physics.rig.parameters import Parameters, value_of

CELLS = 5
SPREAD = spread_of(Parameters())


def network(seed: int = 0, size: float = 0.3) -> PolicyNetwork:
    """A reader whose weights are drawn."""
    rng = np.random.default_rng(seed)

    def pair(out: int, into: int) -> Any:
        return tuple((size * rng.normal(size=shape)).astype(np.float32) for shape in ((out, into), (out,)))

    layers = pair(CELLS, INPUTS), pair(2 * READ, 2 * CELLS)
    memory = pair(3 * CELLS, CELLS), pair(3 * CELLS, CELLS)
    return PolicyNetwork(rng.normal(size=INPUTS), rng.uniform(0.5, 2.0, size=INPUTS), layers, memory=memory)


def test_it_sees_what_measurements_say_and_they_begin_anew():
    own, rng = RigFilter(rig_filter.fresh(Parameters())[:, None].copy()), np.random.default_rng(1)
    own.score[:, 0], own.information[:, 0] = rng.normal(size=2 * SIZE), rng.uniform(0.0, 9.0, size=2 * SIZE)
    own.mean[:, 0], own.believed[:, 0] = 0.1 * rng.normal(size=(2, SIZE))
    score, information, seen = own.score[SUMS, 0].copy(), own.information[SUMS, 0].copy(), np.zeros(INPUTS, dtype=np.float32)
    rig_reader.look(own, 0, 0.25, SPREAD, seen)
    deviation = np.sqrt(own.covariance[:: SIZE + 1, 0])
    parts = (
        score / np.sqrt(information + 1.0),
        np.log1p(information),
        own.mean[:, 0] / SPREAD,
        np.log(deviation / SPREAD),
        own.believed[:READ, 0] / SPREAD[:READ],
        [0.25],
    )
    np.testing.assert_allclose(seen, np.concatenate(parts), rtol=1e-6, atol=1e-6)
    assert not own.score[SUMS].any()
    assert not own.information[SUMS].any()


def test_sums_that_it_reads_are_those_that_measurements_have():
    """A chamber depends on no mass and no friction, a balance on neither supply, lag nor dead volume."""
    names = [*TOLD, "index"]
    read = [("balance" if place >= SIZE else "chamber", names[place % SIZE].split(".")[-1]) for place in SUMS]
    assert not {("chamber", "mass"), ("balance", "supply_pressure")} & {*read}
    assert {name for _, name in read} == {name.split(".")[-1] for name in names}


def driven(law: AdmittanceController, lanes: int, steps: int, seed: int = 4) -> Any:
    env: Any = gymnasium.make_vec(
        "BirthSIM/Circle-v2",
        num_envs=lanes,
        sensors="honest",
        randomize=TOLD,
        policy_period=EVERY,
        actuation=driving(law, None),
    ).unwrapped
    env.reset(seed=seed)
    nothing = np.zeros(env.action_space.shape, dtype=np.float32)
    with closing(env):
        for _ in range(steps):
            env.step(nothing)
            yield env


def reader_of(law: AdmittanceController) -> RigReader:
    return RigReader(law._memories[-1][law.rows_of_law() + RigFilter.size :])


class Read(Watched):
    """``Watched`` with a network of its own."""

    own = network()

    def _all(self, lanes: int) -> tuple[Any, ...]:
        self.inputs, *others = rig_reader.tables(self.own, lanes)
        return self.inputs, *others


def test_the_loop_says_what_the_network_says():
    """NumPy's network on what the kernel saw, reading by reading."""
    law, memory, readings = Read(reader=network()), np.zeros((3, CELLS)), 0
    for _ in driven(law, 3, 60):
        if law.finder().age.max() < 0.16:
            continue
        readings += 1
        said = Read.own.actions(law.inputs, memory).T
        reader, own = reader_of(law), law.finder()
        np.testing.assert_array_equal(reader.said, said)
        np.testing.assert_array_equal(reader.cells[:CELLS], memory.T)
        spread = SPREAD[:READ, None]
        np.testing.assert_allclose(
            reader.mean,
            np.clip(spread * (law.inputs[:, 2 * len(SUMS) :][:, :READ].T + FAR * said[:READ]), -REACH * spread, REACH * spread),
            atol=1e-5,
        )
        unsure = np.exp(law.inputs[:, 2 * len(SUMS) + SIZE :][:, :READ].T + SURE * said[READ:])
        np.testing.assert_allclose(reader.deviation, spread * np.minimum(unsure, 1.0), rtol=1e-4)
        filtered = np.exp(law.inputs[:, 2 * len(SUMS) + SIZE :][:, :READ].T) * spread
        share = np.clip(2.0 - np.minimum(reader.deviation, filtered) / CERTAIN, 0.0, 1.0)
        np.testing.assert_allclose(own.told[:READ], share * reader.mean, rtol=1e-4, atol=1e-5)
    assert readings > 40


def openings(law: AdmittanceController, lanes: int) -> list[Any]:
    return [env.simulation.plant.state.copy() for env in driven(law, lanes, 40)]


def test_a_reader_that_corrects_nothing_tells_what_the_filter_finds():
    filtered, read = AdmittanceController(finds_rig=True), AdmittanceController(reader=blank())
    for own, others in zip(openings(filtered, 4), openings(read, 4), strict=True):
        np.testing.assert_allclose(own, others, rtol=1e-6, atol=1e-9)


def test_found_rig_is_what_the_reader_has_said():
    law = AdmittanceController(reader=network())
    assert law.found_rig == {}
    for _ in driven(law, 2, 30):
        pass
    reader = reader_of(law)
    for k, (name, (value, deviation)) in enumerate(law.found_rig.items()):
        np.testing.assert_allclose(value, value_of(Parameters(), name) * np.exp(reader.mean[k]), rtol=1e-12)
        np.testing.assert_array_equal(deviation, reader.deviation[k])


def test_before_its_first_reading_a_reader_is_as_unsure_as_rigs_are_spread():
    law = AdmittanceController(reader=network())
    next(driven(law, 2, 1))
    deviations = np.stack([deviation for _, deviation in law.found_rig.values()])
    np.testing.assert_array_equal(deviations, np.repeat(SPREAD[:READ, None], 2, axis=1))


def test_a_file_has_the_network(tmp_path):
    own = network(3)
    save_reader(own, tmp_path / "reader.npz")
    read, seen = load_reader(tmp_path / "reader.npz"), np.random.default_rng(0).normal(size=(2, INPUTS)).astype(np.float32)
    np.testing.assert_array_equal(read.actions(seen), own.actions(seen))
    by_name = make_controller(f"admittance[reader={tmp_path / 'reader.npz'}]")
    assert by_name.controller_stages(True)[-1].tables is not None


def another_network() -> PolicyNetwork:
    weight, bias = np.zeros((2, 3), dtype=np.float32), np.zeros(2, dtype=np.float32)
    return PolicyNetwork(np.zeros(3), np.ones(3), ((weight, bias),))


def test_what_is_no_reader_is_refused(tmp_path):
    for content in (b"", b"nothing", b"PK\x03\x04 damaged"):
        (tmp_path / "reader.npz").write_bytes(content)
        with pytest.raises(ValueError, match=r"reader = .*reader\.npz.* is damaged .*allowed: "):
            load_reader(tmp_path / "reader.npz")
    np.savez(tmp_path / "pickled.npz", mean=np.array([{}], dtype=object))
    with pytest.raises(ValueError, match=r"reader = .*pickled\.npz.* is damaged .*allowed: "):
        load_reader(tmp_path / "pickled.npz")
    for name in ("widee", str(tmp_path)):
        with pytest.raises(ValueError, match=r"reader = .* is no file.*allowed: .*reader\.npz"):
            AdmittanceController(reader=name)
    for value in (5.0, True, None):
        with pytest.raises(ValueError, match=rf"reader = {value}; allowed: a name, a file's path, or a network"):
            AdmittanceController(reader=value)
    with pytest.raises(ValueError, match=rf"reader maps 3 to 2 .*allowed: {INPUTS} to {2 * READ} by 2, with a memory"):
        AdmittanceController(reader=another_network())
    with pytest.raises(ValueError, match=r"without a force sensor; allowed: .*force_sensor is True"):
        AdmittanceController(reader=network(), force_sensor=False)


@pytest.mark.parametrize("name", reader_names())
def test_readers_that_come_with_the_package_have_at_most_ten_thousand_weights(name):
    own = load_reader(name)
    assert sum(array.size for pair in (*own.layers, *own.memory) for array in pair) <= 10_000
