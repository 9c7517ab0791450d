"""Learned residuals on top of a control law; importing this package registers the environments of ``birthsim_env``."""

import birthsim_env as birthsim_env

BELONGS_TO_BIRTHSIM = True
"""Tells this package from others of its name: see ``birthsim_env.learned``."""
