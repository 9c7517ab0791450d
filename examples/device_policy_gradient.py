"""A policy learns to drive the valves by gradients through the closed loop, whose lanes, tapes and tensors stay on a GPU.

python examples/device_policy_gradient.py [cuda, host or cpu] [updates] [lanes]      needs pip install -e '.[agents,cuda]'

Nothing here is reinforcement learning: PyTorch differentiates all rigs, drawn at random. ``host`` runs the threads of a GPU on
this processor, ``cpu`` the native loop; all three have the same gradients, but for the order in which PyTorch adds.
"""

import sys

import gymnasium
import torch

import birthsim_env  # noqa: F401  registers the ids
from agents.gradients.rollouts import Now, Worlds

HORIZON = 12
"""Policy steps of 10 ms that a gradient goes back. A tape takes 4 kB a lane and step."""

NOISE = 0.08
"""Of the actions at first; an update takes 2 % of it. A valve within its overlap lets nothing through, whatever little it
opens: a policy that begins with shut valves would have no gradient."""


def make_policy(inputs: int, outputs: int) -> torch.nn.Module:
    """A small network that begins with shut valves."""
    last = torch.nn.Linear(32, outputs)
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.zeros_(last.bias)
    return torch.nn.Sequential(torch.nn.Linear(inputs, 32), torch.nn.Tanh(), last, torch.nn.Tanh())


def horizon(worlds: Worlds, policy: torch.nn.Module, now: Now, noise: float) -> tuple[torch.Tensor, torch.Tensor, Now]:
    """What a horizon costs, the distance from the compliant target at its end, mm (N,), and where it ends."""
    now, loss = now.detached(), torch.zeros((), dtype=torch.float64)  # gradients begin anew
    for _ in range(HORIZON):
        action = policy(now.observation)
        drawn = torch.randn(action.shape, device="cpu").to(action.device)  # the same numbers on all devices
        now = worlds.step(now, (action + noise * drawn).clamp(-1.0, 1.0))
        error = 10.0 * now.observation[:, :2]  # mm: an entry is in units of 0.01 m
        loss = loss + torch.sqrt(0.25 + (error**2).sum(1)).mean() + 0.02 * (action**2).mean()
    return loss, error.detach().norm(dim=1), now


def train(device: str, updates: int, lanes: int) -> list[float]:
    """Distance from the compliant target (19) at the end of each update's horizon, mm, median over the rigs."""
    torch.manual_seed(0)
    torch.set_default_device("cuda" if device == "cuda" else "cpu")
    env = gymnasium.make_vec(
        "BirthSIM/Circle-v2",
        num_envs=lanes,
        randomize=True,
        autoreset_mode="SameStep",
        device=device,
    )
    worlds = Worlds(env)
    policy = make_policy(env.single_observation_space.shape[0], env.single_action_space.shape[0])
    adam = torch.optim.Adam(policy.parameters(), lr=1e-2, betas=(0.9, 0.99))
    now, errors = worlds.reset(seed=0, options={"staggered": True}), []
    for update in range(updates):
        loss, error, now = horizon(worlds, policy, now, NOISE * 0.98**update)
        adam.zero_grad()
        loss.backward()  # through plant, valves, air and friction
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        adam.step()
        errors.append(float(error.median()))
        if update % 50 == 49:
            print(f"update {update + 1}: {errors[-1]:.2f} mm", flush=True)
    return errors


if __name__ == "__main__":
    given = dict(enumerate(sys.argv))
    chosen = given.get(1, "cuda")
    train(chosen, int(given.get(2, 400)), int(given.get(3, 16384 if chosen == "cuda" else 64)))
