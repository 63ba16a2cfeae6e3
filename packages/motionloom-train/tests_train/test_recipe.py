"""Recipes: what is written is used, and anything unusable is refused in one sentence."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom_train.recipe import Recipe, changes, load_recipe

ROOT = Path(__file__).parents[3]


def load(folder: Path, text: str, **replaced) -> Recipe:
    path = folder / "a.toml"
    path.write_text(text)
    return load_recipe(path, replaced)


@pytest.mark.parametrize("path", sorted((ROOT / "recipes").glob("*.toml")), ids=lambda p: p.name)
def test_the_recipes_of_the_project_are_usable(path: Path) -> None:
    assert load_recipe(path).steps > 0


def test_what_is_not_written_has_its_default(tmp_path: Path) -> None:
    recipe = load(tmp_path, 'name = "mine"\nsteps = 5\nrate = 1\n[net]\nwidth = 64\n')
    assert (recipe.name, recipe.steps, recipe.rate, recipe.batch) == ("mine", 5, 1.0, Recipe().batch)
    assert isinstance(recipe.rate, float)
    assert recipe.net == {"width": 64}


def test_changes_replace_entries_and_leave_the_rest_of_a_table_alone(tmp_path: Path) -> None:
    pairs = ["steps=7", "start=default", "net.width=32", "net.heads=2", "windows=[8, 9]"]
    recipe = load(tmp_path, "steps = 5\nshares=[0.5, 0.5]\n[net]\nwidth = 64\nlayers = 3\n", **changes(pairs))
    assert (recipe.steps, recipe.start, recipe.windows) == (7, "default", [8, 9])
    assert recipe.net == {"width": 32, "heads": 2, "layers": 3}
    with pytest.raises(MotionloomError, match="KEY=VALUE"):
        changes(["steps"])


@pytest.mark.parametrize(
    "text",
    [
        "step = 5",
        "steps = '5'",
        "steps = true",
        "steps = 1.5",
        "steps = 0",
        "batch = -1",
        "rate = nan",
        "rate = 0.0",
        "rate = inf",
        "windows = []",
        "windows = [1, 2]",
        "windows = ['a']\nshares = [1.0]",
        "windows = [0]\nshares = [1.0]",
        "windows = [1000000]\nshares = [1.0]",
        "shares = [0, 0, 0, 0]",
        "ema = 1.0",
        "drop_text = 1.0",
        "amp = 'fp8'",
        "clip = 0",
        "schedule = 'stepwise'",
        "levels = 1",
        "levels = 1000000000",
        "seed = -1",
        "name = '../../up'",
        "name = ''",
        "prompts = [1]",
        "sources = [1]",
        "decay = -1.0",
        "cooldown = 2.0",
        "save_every = 0",
        "net = 3",
        "[net]\nwidth = 7",
        "[net]\nwidth = 'x'",
        "[net]\nbreadth = 64",
        "[net]\nlayers = 1000000",
        "steps = ",
        "\x00",
        "net = " + "[" * 5000,
    ],
    ids=lambda text: text[:40],
)
def test_unusable_recipes_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(MotionloomError) as caught:
        load(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_a_missing_recipe_is_reported(tmp_path: Path) -> None:
    with pytest.raises(MotionloomError, match="no recipe"):
        load_recipe(tmp_path / "absent.toml")


VALUE = st.recursive(
    st.integers() | st.floats() | st.booleans() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=4,
)


@settings(max_examples=60, deadline=None)
@given(values=st.dictionaries(st.sampled_from([*Recipe.__dataclass_fields__, "other"]), VALUE, max_size=3))
def test_any_values_give_a_recipe_or_one_kind_of_error(tmp_path_factory: pytest.TempPathFactory, values: dict) -> None:
    try:
        assert isinstance(load(tmp_path_factory.getbasetemp(), "", **values), Recipe)
    except MotionloomError as error:
        assert str(error)  # noqa: PT017


@pytest.mark.parametrize(
    "said",
    [
        "a." * 200_000 + "a = 1",
        "steps = " + "9" * 5000,
        "favour.walk = nan",
        "favour.walk = -1",
        "rate = " + "9" * 400,
        "ema = " + "9" * 400,
        "favour.walk = true",
        "favour.walk = 'x'",
        "x" * 70_000,
        "[pair]\nprefix = " + "9" * 400,
        "[predictor]\nuntold = " + "9" * 400,
        "[net]\na = [[9" + "9" * 30 + "]]",
    ],
    ids=lambda said: said[:20],
)
def test_hostile_recipes_are_refused_at_once(tmp_path, said):
    (tmp_path / "a.toml").write_text(said)
    with pytest.raises(MotionloomError) as caught:
        load_recipe(tmp_path / "a.toml")
    assert len(str(caught.value)) < 900
    assert "\n" not in str(caught.value)


def test_keys_of_very_many_parts_are_refused_before_they_are_read(tmp_path):
    (tmp_path / "a.toml").write_text("a." * 20_000 + "a = 1")
    with pytest.raises(MotionloomError, match="dots"):
        load_recipe(tmp_path / "a.toml")


def test_a_key_of_very_many_parts_on_the_line_is_no_key():
    assert changes(["a." * 200_000 + "a=1"]) == {"a." * 200_000 + "a": "1"}


@pytest.mark.parametrize("kept", [0, -1, 99_999])
def test_frequencies_beyond_a_window_are_refused(kept):
    from motionloom_train.predictor import Settings

    with pytest.raises(MotionloomError, match="kept"):
        Settings.parse({"kept": kept})
