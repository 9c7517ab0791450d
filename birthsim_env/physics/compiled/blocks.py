"""How many lanes a kernel takes at a time."""

import os

BLOCK = int(os.environ.get("BIRTHSIM_BLOCK", "32"))
"""Lanes per block: the scratch rows of one block fit the first-level cache, and their constant stride lets LLVM vectorise.

``birthsim_build`` compiles for one lane alone, in a process of its own with this variable; no lane's bits depend on it."""

WARP = int(os.environ.get("BIRTHSIM_WARP", "0"))
"""Threads of a block on a graphics processor, each with a lane of its own; 0 where no code for threads is compiled."""
