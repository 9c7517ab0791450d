"""Training by Stable-Baselines3: what PPO, recurrent PPO, SAC and TQC have in common."""
