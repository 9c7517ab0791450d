"""PPO in one file, in the style and with the settings of CleanRL's ppo_continuous_action.py, on the native vector environment.

    python examples/cleanrl_ppo.py [id] [steps] [seed]         needs pip install 'birthsim[agents]'
"""

import sys

import gymnasium as gym
import numpy as np
import torch
from torch import nn

import birthsim_env

environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v1"
steps = int(float(sys.argv[2])) if len(sys.argv) > 2 else 1_000_000
lanes, rollout, batch, gamma, trace = 16, 128, 64, 0.99, 0.95
torch.manual_seed(int(sys.argv[3]) if len(sys.argv) > 3 else 0), torch.set_num_threads(1)
worlds = gym.wrappers.vector.RecordEpisodeStatistics(gym.make_vec(environment, num_envs=lanes, randomize=True))
worlds = gym.wrappers.vector.NormalizeReward(gym.wrappers.vector.NormalizeObservation(worlds), gamma=gamma)
inputs, outputs = worlds.single_observation_space.shape[0], worlds.single_action_space.shape[0]

def network(size):
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, size))


actor, critic, log_std = network(outputs), network(1), nn.Parameter(torch.zeros(outputs))
parameters = [*actor.parameters(), *critic.parameters(), log_std]
optimizer = torch.optim.Adam(parameters, lr=3e-4, eps=1e-5)
seen, anew = torch.as_tensor(worlds.reset(seed=0)[0]), torch.zeros(lanes)  # anew: a step that only begins an episode
for update in range(steps // (lanes * rollout)):
    optimizer.param_groups[0]["lr"] = 3e-4 * (1 - update * lanes * rollout / steps)
    rows = []
    for _ in range(rollout):
        with torch.no_grad():
            policy = torch.distributions.Normal(actor(seen), log_std.exp())
            action = policy.sample()
            row = [seen, action, policy.log_prob(action).sum(1), critic(seen)[:, 0], 1 - anew]
        after, reward, dead, cut, infos = worlds.step(action.clamp(-1, 1).numpy())
        rows.append([*row, torch.as_tensor(reward), torch.as_tensor(dead)])
        seen, anew = torch.as_tensor(after, dtype=torch.float32), torch.as_tensor(dead | cut, dtype=torch.float32)
    stacked = (torch.stack(column).float() for column in zip(*rows, strict=True))
    observations, actions, likelihood, values, counts, rewards, died = stacked
    advantage, following, last = torch.zeros_like(values), critic(seen)[:, 0].detach(), 0.0
    for k in reversed(range(rollout)):
        last = rewards[k] + gamma * (1 - died[k]) * following - values[k] + gamma * trace * (1 - died[k]) * last
        last, following = last * counts[k], values[k]
        advantage[k] = last
    columns = [x.flatten(0, 1) for x in (observations, actions, likelihood, advantage, advantage + values, counts)]
    for some in (part for _ in range(10) for part in torch.randperm(lanes * rollout).split(batch)):
        o, a, old, better, worth, one = (column[some] for column in columns)
        policy = torch.distributions.Normal(actor(o), log_std.exp())
        ratio, better = (policy.log_prob(a).sum(1) - old).exp(), (better - better.mean()) / (better.std() + 1e-8)
        gain = torch.minimum(ratio * better, ratio.clamp(0.8, 1.2) * better)
        loss = ((0.25 * (critic(o)[:, 0] - worth) ** 2 - gain) * one).mean()
        optimizer.zero_grad(), loss.backward(), nn.utils.clip_grad_norm_(parameters, 0.5), optimizer.step()
    if update % 20 == 19 and worlds.env.env.return_queue:
        paid, length = np.mean(worlds.env.env.return_queue), np.mean(worlds.env.env.length_queue)
        score = birthsim_env.normalized_score(environment, paid)
        print(f"{(update + 1) * lanes * rollout:9,} steps: episodes of {length:.0f} steps, score {score:.0f}", flush=True)
