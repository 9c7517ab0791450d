"""Settings of all tests: property tests draw the same examples every time and may take as long as a busy machine needs."""

from hypothesis import settings

settings.register_profile("birthsim", deadline=None, derandomize=True, database=None)
settings.load_profile("birthsim")
