"""Console commands of the baselines."""
