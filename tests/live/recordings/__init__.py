"""Recordings and the logs that are written from them."""
