"""Files that appear whole or not at all."""

import errno
import os

import pytest

from birthsim_env.files import whole_file, whole_results, write_json


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


def test_a_folder_in_the_way_of_one_result_leaves_all_as_they_were(tmp_path):
    (tmp_path / "b.json").mkdir()
    (tmp_path / "a.png").write_text("old")

    def both():
        with whole_results(tmp_path) as own:
            (own / "a.png").write_text("new")
            (own / "b.json").write_text("new")

    with pytest.raises(IsADirectoryError) as caught:
        both()
    assert caught.value.filename == str(tmp_path / "b.json")
    assert (tmp_path / "a.png").read_text() == "old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.png", "b.json"]
