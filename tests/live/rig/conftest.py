"""A folder with the page for the tests of its rig."""

import pytest

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig.folder import packed_page, write_page


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("worker") / "page"
    write_page(folder, packed_page(Parameters()))
    return folder
