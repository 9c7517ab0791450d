"""The benchmark: suites of tasks, what is judged on them, and rows that two papers can compare."""
