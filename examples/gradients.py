"""A policy of one's own by gradients through the closed loop, with a loss of one's own: about a minute.

The head is to give way to a hand as a spring does, and the valves are to open little. Nothing here is reinforcement learning:
PyTorch differentiates 64 rigs that are drawn at random.

    python examples/gradients.py [updates]
"""

import sys

import gymnasium
import torch

import birthsim_env  # noqa: F401  registers the ids
from agents.gradients.rollouts import Worlds

LANES, HORIZON = 64, 12
"""Rigs side by side; policy steps of 10 ms that a gradient goes back."""

NOISE = 0.08
"""Of the actions at first; an update takes 2 % of it. A valve within its overlap lets nothing through, whatever little it
opens: a policy that begins with shut valves would have no gradient."""


def make_policy(inputs: int, outputs: int) -> torch.nn.Module:
    """A small network that begins with shut valves."""
    last = torch.nn.Linear(32, outputs)
    torch.nn.init.zeros_(last.weight)
    torch.nn.init.zeros_(last.bias)
    return torch.nn.Sequential(torch.nn.Linear(inputs, 32), torch.nn.Tanh(), last, torch.nn.Tanh())


def train(updates: int) -> list[float]:
    """Distance from the compliant target (19) at the end of each update's horizon, mm, median over the rigs."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=LANES, randomize=True, autoreset_mode="SameStep")
    worlds = Worlds(env)
    policy = make_policy(env.single_observation_space.shape[0], env.single_action_space.shape[0])
    adam = torch.optim.Adam(policy.parameters(), lr=1e-2, betas=(0.9, 0.99))
    now, errors = worlds.reset(seed=0, options={"staggered": True}), []
    for update in range(updates):
        now, loss = now.detached(), 0.0  # gradients begin anew
        for _ in range(HORIZON):
            action = policy(now.observation)
            noise = NOISE * 0.98**update * torch.randn_like(action)
            now = worlds.step(now, (action + noise).clamp(-1.0, 1.0))
            target = env.unwrapped.reference.compliant_target(env.unwrapped.simulation.force)
            error = 1e3 * (now.motion[:2] - torch.from_numpy(target))
            loss = loss + torch.sqrt(0.25 + (error**2).sum(0)).mean() + 0.02 * (action**2).mean()
        adam.zero_grad()
        loss.backward()  # through plant, valves, air and friction
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        adam.step()
        errors.append(float((error.detach() ** 2).sum(0).sqrt().median()))
        if update % 50 == 49:
            print(f"update {update + 1}: {errors[-1]:.2f} mm")
    return errors


if __name__ == "__main__":
    train(int(sys.argv[1]) if len(sys.argv) > 1 else 400)
