"""What an episode's seed decides: rigs, starts, noise."""
