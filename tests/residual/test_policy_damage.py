"""A policy's file that is missing, damaged or foreign is refused by name, in the same words by loader and controller."""

import pickle

import numpy as np
import pytest
from safetensors.numpy import save

from agents.policy.controller import ResidualController
from agents.policy.files import FORMAT, WEIGHTS, Policy, read_policy, save_policy
from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings
from tests.residual.policies import ENVIRONMENT, INPUTS, POLICIES, SETTINGS, Trap, network

either = pytest.mark.parametrize("kind", POLICIES)


def rewrite(folder, arrays=None, about=None):
    """Change arrays (``_`` in a name stands for a dot) and what is said about them, and vouch for the result; None removes."""
    parts = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    changes = {name.replace("_", "."): value for name, value in (arrays or {}).items()}, about or {}
    kept = [{**part, **new} for part, new in zip(parts, changes, strict=True)]
    (folder / WEIGHTS).write_bytes(sealed(*({name: value for name, value in one.items() if value is not None} for one in kept)))


def assert_refused(folder, message):
    with pytest.raises(ValueError, match=message) as caught:
        read_policy(folder)
    assert repr(str(folder)) in str(caught.value)
    assert "allowed: " in str(caught.value)
    assert "\n" not in str(caught.value)
    # The controller refuses in the same words.
    with pytest.raises(ValueError, match=message) as again:
        ResidualController(policy=folder)
    assert str(again.value) == str(caught.value)


def test_a_folder_without_a_policy_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "empty").mkdir()
    for name in ("file", "empty", "nowhere"):
        for read in (read_policy, lambda folder: ResidualController(policy=folder)):
            with pytest.raises(ValueError, match=r"; allowed: a folder that birthsim train wrote") as caught:
                read(tmp_path / name)
            assert repr(str(tmp_path / name)) in str(caught.value)


@either
def test_every_flipped_bit_is_noticed(folder, kind):
    save_policy(POLICIES[kind], folder)
    content = (folder / WEIGHTS).read_bytes()
    # All of the header's bytes, and some of the arrays'.
    header = 8 + int.from_bytes(content[:8], "little")
    rng = np.random.default_rng(0)
    for place in [*range(header), *rng.integers(header, len(content), 200), len(content) - 1]:
        flipped = bytearray(content)
        flipped[place] ^= 1 << int(rng.integers(8))
        with pytest.raises(ValueError, match=r"^(no birthsim-residual-3 or )?damaged"):
            unsealed(bytes(flipped), FORMAT)
    (folder / WEIGHTS).write_bytes(flipped)
    assert_refused(
        folder, f"{WEIGHTS} is damaged: its checksum is of another content; allowed: a folder that birthsim train wrote"
    )


@either
def test_a_file_that_is_cut_off_or_longer_is_noticed(folder, kind):
    save_policy(POLICIES[kind], folder)
    content = (folder / WEIGHTS).read_bytes()
    for part in (content[:-4], content[:20], b"", content + b"0", content[:200]):
        (folder / WEIGHTS).write_bytes(part)
        assert_refused(folder, "damaged")


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3", "null", '{"format": 3}', "\xff", '{"a": ' * 5000])
def test_what_is_said_about_other_arrays_is_refused(folder, text):
    for metadata in (None, {"other": text}, {"birthsim": text}):
        (folder / WEIGHTS).write_bytes(save({"mean": np.zeros(3)}, metadata))
        assert_refused(folder, f"{WEIGHTS} is no {FORMAT} or damaged; allowed: a folder that birthsim train wrote")


@pytest.mark.parametrize("form", ["other-1", "birthsim-residual-4", "birthsim-checkpoint-1", 3, None, ["birthsim"]])
def test_another_format_is_called_foreign(folder, form):
    arrays, about = unsealed((folder / WEIGHTS).read_bytes(), FORMAT)
    (folder / WEIGHTS).write_bytes(sealed(arrays, {**about, "format": form}))
    said = rf"of the foreign format .*, not '{FORMAT}'" if isinstance(form, str) else f"{WEIGHTS} is no {FORMAT} or damaged"
    assert_refused(folder, said)


@pytest.mark.parametrize(
    "changes",
    [
        *({name: None} for name in ("settings", "training", "environment", "squashed")),
        *({"settings": {**SETTINGS.to_dict(), **wrong}} for wrong in ({"authority": -1.0}, {"law": "pid"}, {"unknown": 1})),
        {"settings": {"authority": 40.0, "smoothing": 0.3, "policy_period": 0.01, "weight_compensation": False}},
        *({name: wrong} for name in ("settings", "training", "squashed") for wrong in ([1, 2], 3, "false")),
    ],
)
def test_a_configuration_with_a_wrong_or_missing_entry_is_refused(folder, changes):
    rewrite(folder, about=changes)
    assert_refused(folder, r"is damaged \(.+\); allowed: a folder that birthsim train wrote")


def shape(*sizes, fill=0.1, dtype=np.float32):
    return np.full(sizes, fill, dtype)


WRONG = {
    "forward": [
        *({name: None} for name in ("mean", "variance", "1_weight", "2_bias")),
        {"mean": shape(INPUTS - 1, dtype=np.float64)},
        {"mean": shape(1, INPUTS, dtype=np.float64), "variance": shape(1, INPUTS, dtype=np.float64)},
        {"mean": shape(0, dtype=np.float64), "variance": shape(0, dtype=np.float64), "0_weight": shape(16, 0)},
        *({"0_weight": shape(*sizes)} for sizes in ((16, INPUTS - 1), (INPUTS, 16), (16 * INPUTS,))),
        *({"0_bias": shape(*sizes)} for sizes in ((15,), (16, 1))),
        {"3_weight": shape(2, 3), "3_bias": shape(2)},
        {"extra_weight": shape(2, 2)},
        {name: None for name in ("0_weight", "1_weight", "2_weight")},
        {"variance": shape(INPUTS, fill=-0.1, dtype=np.float64)},
        *({name: shape(INPUTS, fill=bad, dtype=np.float64)} for name in ("mean", "variance") for bad in (np.nan, np.inf)),
        *({"1_weight": shape(8, 16, fill=bad)} for bad in (np.nan, -np.inf)),
        {"2_bias": shape(2, fill=np.nan)},
        *({"1_weight": shape(8, 16, dtype=kind)} for kind in (np.float64, np.float16, np.int32, np.bool_)),
        *({name: shape(INPUTS)} for name in ("mean", "variance")),
    ],
    "with a memory": [
        *({name: None} for name in ("enters_weight", "own_weight", "own_bias")),
        {"enters_weight": None, "enters_bias": None, "own_weight": None, "own_bias": None},
        {"enters_weight": shape(15, 9)},
        {"enters_weight": shape(14, 8), "enters_bias": shape(14)},
        {"enters_weight": shape(0, 8), "enters_bias": shape(0), "own_weight": shape(0, 0), "own_bias": shape(0)},
        *({"own_weight": shape(*sizes)} for sizes in ((15, 6), (15,))),
        {"own_weight": shape(18, 5), "own_bias": shape(18)},
        {"own_weight": shape(15, 5, fill=np.nan)},
        *({"2_weight": shape(2, size)} for size in (8, 14)),
    ],
}


@pytest.mark.parametrize(("kind", "changes"), [(kind, changes) for kind, rows in WRONG.items() for changes in rows])
def test_arrays_that_are_no_network_are_refused(folder, kind, changes):
    save_policy(POLICIES[kind], folder)
    rewrite(folder, changes)
    assert_refused(folder, r"is damaged \(.+\); allowed: a folder that birthsim train wrote")


@pytest.mark.parametrize(("inputs", "outputs"), [(22, 2), (INPUTS, 4), (INPUTS - 1, 3)])
def test_a_network_of_another_task_is_refused_by_the_controller(tmp_path, inputs, outputs):
    save_policy(Policy(network(inputs, outputs), ENVIRONMENT, SETTINGS, {}), tmp_path)
    assert read_policy(tmp_path).network.inputs == inputs
    with pytest.raises(ValueError, match=rf"maps {inputs} to {outputs} numbers; allowed: {INPUTS} to 2") as caught:
        ResidualController(policy=tmp_path)
    assert repr(str(tmp_path)) in str(caught.value)


@pytest.mark.parametrize("period", [0.0105, 0.0004])
def test_a_policy_period_that_the_rig_cannot_keep_is_refused(tmp_path, period):
    save_policy(Policy(network(), ENVIRONMENT, ResidualSettings(policy_period=period), {}), tmp_path)
    with pytest.raises(ValueError, match=rf"policy_period = {period} s; allowed: a multiple of the control period 0\.001 s"):
        ResidualController(policy=tmp_path)


def test_a_pickle_under_another_name_is_refused_and_not_opened(folder, tmp_path):
    trap = tmp_path / "sprung"
    (folder / WEIGHTS).write_bytes(pickle.dumps(Trap(trap)))
    assert_refused(folder, f"is no {FORMAT} or damaged")
    assert not trap.exists()
    # The trap is a real one.
    pickle.loads(pickle.dumps(Trap(trap)))
    assert trap.exists()
