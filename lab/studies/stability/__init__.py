"""Where controllers are stable, over rigs and hands."""
