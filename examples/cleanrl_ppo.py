"""PPO in one file, in the style of CleanRL's ppo_continuous_action.py, in 64 lanes at once; then its score on the test split.

python examples/cleanrl_ppo.py [id] [steps] [seed]         needs pip install -e '.[agents]'
"""

import sys

import gymnasium as gym
import numpy as np
import torch
from torch import nn

import birthsim
import birthsim_env

environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v2"
steps, seed = int(float(sys.argv[2])) if len(sys.argv) > 2 else 1_000_000, int(sys.argv[3]) if len(sys.argv) > 3 else 0
lanes, rollout, batch, gamma, trace = 64, 64, 512, 0.96, 0.95
torch.manual_seed(seed), torch.set_num_threads(1)
worlds = gym.wrappers.vector.RecordEpisodeStatistics(gym.make_vec(environment, num_envs=lanes, randomize=True))
worlds = gym.wrappers.vector.NormalizeReward(worlds, gamma=gamma)
inputs, outputs = worlds.single_observation_space.shape[0], worlds.single_action_space.shape[0]


def network(size, gain):
    layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, size)]
    for linear, scale in zip(layers[::2], (2**0.5, 2**0.5, gain), strict=True):
        nn.init.orthogonal_(linear.weight, scale), nn.init.zeros_(linear.bias)
    return nn.Sequential(*layers)


def act(observations):
    """Actions (N, n) without exploration, for observations (N, D)."""
    with torch.no_grad():
        return actor(torch.as_tensor(observations).float().clamp(-10, 10)).clamp(-1, 1).numpy()


actor, critic, log_std = network(outputs, 0.01), network(1, 1.0), nn.Parameter(torch.zeros(outputs))
optimizer = torch.optim.Adam(parameters := [*actor.parameters(), *critic.parameters(), log_std], lr=1e-3, eps=1e-5)
first, _ = worlds.reset(seed=seed, options={"staggered": True})  # lanes at different moments of their episodes
seen, anew = torch.as_tensor(first).float().clamp(-10, 10), torch.zeros(lanes)  # anew: only begins an episode
for update in range(steps // (lanes * rollout)):
    optimizer.param_groups[0]["lr"], rows = 1e-3 * (1 - update * lanes * rollout / steps), []
    for _ in range(rollout):
        with torch.no_grad():
            policy = torch.distributions.Normal(actor(seen), log_std.exp())
            row = [seen, action := policy.sample(), policy.log_prob(action).sum(1), critic(seen)[:, 0], 1 - anew]
        after, reward, dead, cut, _ = worlds.step(action.clamp(-1, 1).numpy())
        rows.append([*row, torch.as_tensor(reward).clamp(-10, 10), torch.as_tensor(dead)])
        seen, anew = torch.as_tensor(after).float().clamp(-10, 10), torch.as_tensor(dead | cut).float()
    saw, did, likelihood, values, counts, rewards, died = (torch.stack(x).float() for x in zip(*rows, strict=True))
    advantage, following, last = torch.zeros_like(values), critic(seen)[:, 0].detach(), 0.0
    for k in reversed(range(rollout)):
        last = rewards[k] + gamma * (1 - died[k]) * (following + trace * last) - values[k]
        advantage[k], following = (last := last * counts[k]), values[k]
    columns = [x.flatten(0, 1) for x in (saw, did, likelihood, advantage, values, counts)]
    for some in (part for _ in range(10) for part in torch.randperm(lanes * rollout).split(batch)):
        o, a, old, better, was, one = (column[some] for column in columns)
        worth, value = better + was, critic(o)[:, 0]
        miss = torch.maximum((value - worth) ** 2, (was + (value - was).clamp(-0.2, 0.2) - worth) ** 2)
        new = torch.distributions.Normal(actor(o), log_std.exp()).log_prob(a).sum(1)
        ratio, better = (new - old).exp(), (better - better.mean()) / (better.std() + 1e-8)
        loss = ((0.25 * miss - torch.minimum(ratio * better, ratio.clamp(0.8, 1.2) * better)) * one).mean()
        optimizer.zero_grad(), loss.backward(), nn.utils.clip_grad_norm_(parameters, 0.5), optimizer.step()
    if update % 10 == 9 and worlds.env.return_queue:
        paid = birthsim_env.normalized_return(environment, np.mean(worlds.env.return_queue))
        length = np.mean(worlds.env.length_queue)
        print(
            f"{(update + 1) * lanes * rollout:9,} steps: episodes of {length:.0f} steps, normalised return {paid:.0f}",
            flush=True,
        )
print("on the test split, without exploration:")
print(birthsim.score(act, environment))
