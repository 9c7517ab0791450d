"""Console commands of the agents."""
