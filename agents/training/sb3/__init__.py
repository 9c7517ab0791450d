"""Training by Stable-Baselines3: PPO, SAC and TQC."""
