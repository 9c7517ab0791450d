"""Files that appear whole or not at all."""

import errno
import os

import pytest

from birthsim_env.files import whole_file, write_json


def test_what_is_raised_leaves_the_file_as_it_was_and_nothing_beside_it(tmp_path):
    path = tmp_path / "one.json"
    write_json(path, {"a": [1.0, float("nan"), (float("inf"), "b")]})
    before = path.read_text()
    assert before == '{\n "a": [\n  1.0,\n  null,\n  [\n   null,\n   "b"\n  ]\n ]\n}'

    def interrupted():
        with whole_file(path) as file:
            file.write(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    with pytest.raises(TypeError):
        write_json(path, {"a": object()})
    assert path.read_text() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_names_the_file_that_it_had_no_room_for(tmp_path):
    with pytest.raises(OSError, match="No space left") as caught, whole_file(tmp_path / "results.json"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.filename == str(tmp_path / "results.json")
