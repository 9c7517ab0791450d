"""PPO of TorchRL in 64 lanes at once; then its score on the test split.

python examples/torchrl_ppo.py [id] [steps]                needs pip install -e '.[agents]' torchrl
"""

import sys

import gymnasium as gym
import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import Compose, DoubleToFloat, GymWrapper, RewardSum, StepCounter, TransformedEnv
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor, TanhNormal, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import birthsim
import birthsim_env

environment = sys.argv[1] if len(sys.argv) > 1 else "BirthSIM/Circle-v2"
steps, lanes, batch = int(float(sys.argv[2])) if len(sys.argv) > 2 else 400_000, 64, 4096
torch.manual_seed(0), torch.set_num_threads(1)
native = gym.make_vec(environment, num_envs=lanes, randomize=True, autoreset_mode="Disabled")
worlds = TransformedEnv(GymWrapper(native), Compose(DoubleToFloat(), RewardSum(), StepCounter()))
inputs, outputs = native.single_observation_space.shape[0], native.single_action_space.shape[0]


def network(size):
    return nn.Sequential(nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, size))


actor = ProbabilisticActor(
    TensorDictModule(nn.Sequential(network(2 * outputs), NormalParamExtractor()), ["observation"], ["loc", "scale"]),
    in_keys=["loc", "scale"],
    distribution_class=TanhNormal,
    return_log_prob=True,
)
critic = ValueOperator(network(1), in_keys=["observation"])
advantage = GAE(gamma=0.96, lmbda=0.95, value_network=critic, average_gae=True)
loss = ClipPPOLoss(actor, critic, clip_epsilon=0.2)
optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)
done = 0
for data in Collector(worlds, actor, frames_per_batch=batch, total_frames=steps):
    for _ in range(10):
        advantage(data)
        flat = data.reshape(-1)
        for some in torch.randperm(len(flat)).split(512):
            losses = loss(flat[some])
            optimizer.zero_grad()
            sum(value for key, value in losses.items() if key.startswith("loss_")).backward()
            nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
            optimizer.step()
    done += batch
    ended = data["next", "done"].squeeze(-1)
    if ended.any():
        paid = birthsim_env.normalized_return(environment, data["next", "episode_reward"][ended].mean().item())
        length = data["next", "step_count"][ended].float().mean()
        print(f"{done:9,} steps: episodes of {length:.0f} steps, normalised return {paid:.0f}", flush=True)


def act(observations):
    """Actions (N, n) without exploration, for observations (N, D)."""
    with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
        return actor(TensorDict({"observation": torch.as_tensor(observations)}, [len(observations)]))["action"].numpy()


print("on the test split, without exploration:")
print(birthsim.score(act, environment))
