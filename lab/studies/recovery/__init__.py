"""How well identification finds rigs that are known."""
