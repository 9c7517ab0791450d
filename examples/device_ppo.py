"""PPO in one file whose data never leave the device: observations, rewards and actions are PyTorch's tensors there.

python examples/device_ppo.py [cuda or host] [id] [steps] [seed] [lanes]      needs pip install -e '.[agents,cuda]'
"""

import sys

import gymnasium as gym
import torch
from torch import nn

import agents as agents  # registers ids with a controller inside

given = dict(enumerate(sys.argv))
device, environment = given.get(1, "cuda"), given.get(2, "BirthSIM/CircleResidual-v2")
steps, seed = int(float(given.get(3, 5e7 if device == "cuda" else 2e5))), int(given.get(4, 0))
lanes, rollout, batches, passes, gamma, trace = int(given.get(5, 16384 if device == "cuda" else 64)), 64, 16, 6, 0.98, 0.95
torch.manual_seed(seed), torch.set_default_device("cuda" if device == "cuda" else "cpu")
worlds = gym.make_vec(environment, num_envs=lanes, randomize=True, device=device)
inputs, outputs = worlds.single_observation_space.shape[0], worlds.single_action_space.shape[0]


def network(size):
    layers = [nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, size)]
    nn.init.zeros_(layers[-1].weight), nn.init.zeros_(layers[-1].bias)  # it begins as the law alone
    return nn.Sequential(*layers)


actor, critic, log_std = network(outputs), network(1), nn.Parameter(torch.full((outputs,), -1.5))
optimizer = torch.optim.Adam(parameters := [*actor.parameters(), *critic.parameters(), log_std], lr=1e-3)
seen, anew = torch.from_dlpack(worlds.reset(seed=seed, options={"staggered": True})[0]), torch.zeros(lanes)
for update in range(steps // (lanes * rollout)):
    rows, error = [], 0.0
    for _ in range(rollout):
        with torch.no_grad():
            policy = torch.distributions.Normal(actor(seen), log_std.exp())
            row = [seen, action := policy.sample(), policy.log_prob(action).sum(1), critic(seen)[:, 0], 1 - anew]
            after, reward, dead, cut, info = worlds.step(action.clamp(-1, 1))
        seen, reward, dead, cut = (torch.from_dlpack(one) for one in (after, reward, dead, cut))
        rows.append([*row, reward.float(), dead.float()])
        anew = (dead | cut).float()  # the next step only begins an episode
        error += torch.from_dlpack(info["tracking_error"]).norm(dim=1).mean() / rollout
    saw, did, likelihood, values, counts, rewards, died = (torch.stack(x) for x in zip(*rows, strict=True))
    advantage, following, last = torch.zeros_like(values), critic(seen)[:, 0].detach(), 0.0
    for k in reversed(range(rollout)):
        last = rewards[k] + gamma * (1 - died[k]) * (following + trace * last) - values[k]
        advantage[k], following = (last := last * counts[k]), values[k]
    columns = [x.flatten(0, 1) for x in (saw, did, likelihood, advantage, advantage + values, counts)]
    for some in (part for _ in range(passes) for part in torch.randperm(lanes * rollout).chunk(batches)):
        o, a, old, better, worth, one = (column[some] for column in columns)
        new = torch.distributions.Normal(actor(o), log_std.exp()).log_prob(a).sum(1)
        ratio, better = (new - old).exp(), (better - better.mean()) / (better.std() + 1e-8)
        gain = torch.minimum(ratio * better, ratio.clamp(0.8, 1.2) * better)
        loss = ((0.5 * (critic(o)[:, 0] - worth) ** 2 - gain) * one).mean()
        optimizer.zero_grad(), loss.backward(), nn.utils.clip_grad_norm_(parameters, 0.5), optimizer.step()
    print(f"{(update + 1) * lanes * rollout:11,} steps: {1000 * error:.2f} mm off the compliant target", flush=True)
