"""What runs a study, keeps its result, says when that is stale, and shows it."""
