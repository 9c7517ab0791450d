"""What the memory of a policy's network computes, against PyTorch; its layers: ``tests/training/test_algorithms.py``."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from tests.residual.policies import INPUTS, network


def unit(torch_unit, hidden, inputs, outputs, seed=0):
    """A policy whose memory is a unit of PyTorch, in double precision, with weights that are singles."""
    made = network(inputs, outputs, (hidden,), seed, cells=torch_unit.hidden_size)
    enters, own = made.memory
    values = {"weight_ih_l0": enters[0], "bias_ih_l0": enters[1], "weight_hh_l0": own[0], "bias_hh_l0": own[1]}
    torch_unit.load_state_dict({name: torch.as_tensor(value, dtype=torch.float64) for name, value in values.items()})
    return made


def observations(steps, lanes, inputs, scale=2.0):
    return np.random.default_rng(1).normal(size=(steps, lanes, inputs), scale=scale).astype(np.float32)


def ran(policy, seen):
    """Actions (T, N, size) and memories (T, N, cells) from the beginning of an episode on."""
    memory, actions, memories = np.zeros((seen.shape[1], policy.cells)), [], []
    for rows in seen:
        actions.append(policy.actions(rows, memory))
        memories.append(memory.copy())
    return np.array(actions), np.array(memories)


@pytest.mark.parametrize("squashed", [False, True])
def test_a_memory_is_pytorchs_gated_recurrent_unit(squashed):
    gru = torch.nn.GRU(7, 5, dtype=torch.float64)
    made = replace(unit(gru, 7, 9, 2), squashed=squashed)
    seen = observations(30, 4, 9)
    actions, memories = ran(made, seen)
    (enter, bias), (leave, offset) = made.layers
    with torch.no_grad():
        entered = torch.tanh(
            torch.from_numpy(made.normalized(seen)) @ torch.from_numpy(enter).double().T + torch.from_numpy(bias)
        )
        held = gru(entered)[0].numpy()
    # Some twenty operations of 1e-16 each, which a memory below one does not magnify.
    np.testing.assert_allclose(memories, held, rtol=0, atol=1e-14)
    last = np.concatenate([entered.numpy(), held], axis=-1) @ leave.astype(float).T + offset
    np.testing.assert_allclose(actions, np.tanh(last) if squashed else np.clip(last, -1, 1), rtol=0, atol=6e-8)
    assert np.ptp(memories, axis=0).max() > 0.5


def test_a_reset_forgets_the_lanes_that_it_names():
    made = network(INPUTS, 2, (8,), 4, cells=6)
    seen, lanes = observations(30, 5, INPUTS, scale=0.3), np.array([False, True, False, False, True])
    never, reset = made.acting(), made.acting()
    for rows in seen[:10]:
        never(rows), reset(rows)
    reset.reset(lanes)
    begun, differs = made.acting(), 0
    for rows in seen[10:]:
        goes_on, again, anew = never(rows), reset(rows), begun(rows)
        np.testing.assert_array_equal(again[~lanes], goes_on[~lanes])
        np.testing.assert_array_equal(again[lanes], anew[lanes])
        differs += (again[lanes] != goes_on[lanes]).any()
    assert differs > 5
    reset.reset()
    np.testing.assert_array_equal(reset(seen[0]), made.acting()(seen[0]))
    np.testing.assert_array_equal(reset(seen[1, :2]), made.acting()(seen[1, :2]), "another number of lanes begins anew")
    np.testing.assert_array_equal(made.actions(seen[0]), made.acting()(seen[0]))


@pytest.mark.parametrize("cells", [0, 6])
def test_after_a_reset_of_all_lanes_a_mask_of_another_number_counts(cells):
    made = network(INPUTS, 2, (8,), 4, cells=cells)
    seen, act = observations(2, 5, INPUTS), made.acting()
    act(seen[0, :2])
    act.reset()
    act.reset(np.array([True, False, False, True, False]))
    np.testing.assert_array_equal(act(seen[1]), made.acting()(seen[1]))
