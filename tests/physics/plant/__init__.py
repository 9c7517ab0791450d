"""The whole plant: its motion, balances, limits and options."""
