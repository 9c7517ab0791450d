"""Minari and d3rlpy: a dataset is written by one command, read back, played again, and learned from."""

import os
import subprocess
import sys
import time

import d3rlpy
import gymnasium as gym
import minari
import numpy as np
import pytest

from birthsim_env import normalized_return

NAME = "birthsim/circle/expert-v0"


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    folder = tmp_path_factory.mktemp("datasets")
    command = [sys.executable, "-P", "-m", "birthsim", "export", "--to", "minari", "--episodes", "8", "--out", str(folder)]
    subprocess.run(command, check=True, capture_output=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MINARI_DATASETS_PATH", str(folder))
        yield minari.load_dataset(NAME)


def test_its_episodes_are_played_again_in_the_environment_that_it_names(dataset):
    assert dataset.total_episodes == 8
    env = dataset.recover_environment()
    for episode in list(dataset.iterate_episodes())[:2]:
        seed = int(dataset.storage.get_episode_metadata([episode.id]).__iter__().__next__()["seed"])
        np.testing.assert_array_equal(env.reset(seed=seed)[0], episode.observations[0])
        for k, action in enumerate(episode.actions):
            seen, paid, terminated, truncated, _ = env.step(action)
            np.testing.assert_array_equal(seen, episode.observations[k + 1])
            assert (paid, terminated, truncated) == (episode.rewards[k], episode.terminations[k], episode.truncations[k])


def test_a_killed_export_leaves_no_dataset_and_the_same_command_then_writes_it(tmp_path, monkeypatch):
    command = [sys.executable, "-P", "-m", "birthsim", "export", "--to", "minari", "--episodes", "8", "--out", str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        while process.poll() is None and not any("main_data.hdf5" in inside for _, _, inside in os.walk(tmp_path)):
            time.sleep(0.002)
        process.kill()
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    assert minari.list_local_datasets() == {}
    subprocess.run(command, check=True, capture_output=True)
    assert len(list(minari.load_dataset(NAME).iterate_episodes())) == 8
    assert [path.name for path in tmp_path.iterdir()] == ["birthsim"]


def test_its_scores_are_the_projects(dataset):
    returns = np.array([episode.rewards.sum() for episode in dataset.iterate_episodes()])
    np.testing.assert_allclose(
        100 * minari.get_normalized_return(dataset, returns), normalized_return("BirthSIM/Circle-v2", returns)
    )
    assert returns.mean() > 1200


def test_minaris_own_collector_records_an_episode(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    env = minari.DataCollector(gym.make("BirthSIM/Probe-v3", randomize=True), record_infos=True)
    env.reset(seed=1)
    for _ in range(700):
        env.step(np.zeros(4, np.float32))
    (episode,) = env.create_dataset("birthsim/probe/own-v0").iterate_episodes()
    assert len(episode.rewards) == 700
    assert episode.infos["pressure"].shape == (701, 4)
    env.close()


def test_d3rlpy_learns_from_it(dataset, tmp_path):
    episodes = list(dataset.iterate_episodes())
    joined = {name: np.concatenate([getattr(one, name) for one in episodes]) for name in ("actions", "rewards", "terminations")}
    given = d3rlpy.dataset.MDPDataset(
        observations=np.concatenate([one.observations[:-1] for one in episodes]),
        actions=joined["actions"],
        rewards=joined["rewards"].astype(np.float32),
        terminals=joined["terminations"].astype(np.float32),
        timeouts=np.concatenate([one.truncations for one in episodes]).astype(np.float32),
    )
    learner = d3rlpy.algos.BCConfig(batch_size=256, learning_rate=1e-3).create()
    learner.build_with_dataset(given)

    def error():
        return float(np.square(learner.predict(given.episodes[0].observations) - given.episodes[0].actions).mean())

    untrained = error()
    learner.fit(
        given, n_steps=2000, n_steps_per_epoch=2000, show_progress=False, logger_adapter=d3rlpy.logging.NoopAdapterFactory()
    )
    assert error() < 0.3 * untrained, untrained
