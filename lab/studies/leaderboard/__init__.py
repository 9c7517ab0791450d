"""The leaderboard of the benchmark's suites: its entries, whether they repeat, and the tables that show them."""
