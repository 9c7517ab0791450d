"""Arrays on the stack of the kernel that asks for them. LLVM sees all that happens to them: nothing else points into them, so
loops over lanes vectorise without a check, and what is read where it was written stays in registers.
"""

from typing import TYPE_CHECKING

import numpy as np

from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import Late
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.plain import DEBUG

if TYPE_CHECKING or DEBUG:

    def scratch(rows: int) -> Array:
        """A block of ``rows`` rows, a constant; NaN in plain Python until something is written."""
        return np.full((rows, BLOCK), np.nan)

    def column(rows: int) -> Array:
        """``rows`` numbers of one lane, a constant; NaN in plain Python until something is written."""
        return np.full(rows, np.nan)

else:
    scratch, column = (Late("birthsim_env.physics.compiled.on_stack", name) for name in ("scratch", "column"))
