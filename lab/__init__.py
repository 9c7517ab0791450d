"""The laboratory: studies of the project, their results, the leaderboard, benchmarks and the paper. It stays in the clone."""
