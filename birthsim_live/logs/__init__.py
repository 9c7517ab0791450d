"""Logs from what the commands of this project write."""
