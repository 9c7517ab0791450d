"""Policies of other libraries and of users, as controllers: Stable-Baselines3's archives and models, ONNX, functions."""
