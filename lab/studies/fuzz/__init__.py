"""Fuzzing of everything that reads what a user wrote: files, arguments of constructors, command lines."""
