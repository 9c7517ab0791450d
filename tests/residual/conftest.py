"""What several tests share."""

import pytest

from agents.policy.files import save_policy
from tests.residual.policies import policy


@pytest.fixture
def folder(tmp_path):
    """Where a policy is."""
    save_policy(policy(), tmp_path / "policy")
    return tmp_path / "policy"
