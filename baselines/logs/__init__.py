"""Logs: series of named numbers with units, as CSV, Parquet and MCAP."""
