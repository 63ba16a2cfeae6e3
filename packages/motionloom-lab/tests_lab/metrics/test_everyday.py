"""The everyday checks on made-up people whose answer is known: who does it passes, the opposite and deceivers fail."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22
from motionloom.goals.remarks import is_english
from motionloom.kinematics.physics import J
from motionloom_lab.metrics.everyday.body import Body, times
from motionloom_lab.metrics.obedience import EVERYDAY, SETS, THEMES, chosen
from tests.kinematics.people import FPS, jumping, moved, spun, standing, walking

UNSEEN = Path(__file__).parents[4] / "benchmarks" / "everyday_unseen.toml"
BY_NAME = {check.name: check for check in EVERYDAY}
UPPER = [j for j in range(22) if j not in (1, 2, 4, 5, 7, 8, 10, 11)]


def mirrored(p: np.ndarray) -> np.ndarray:
    return p[:, list(SMPL22.mirror_pairs())] * [-1.0, 1.0, 1.0]


def ramp(first: float, last: float, seconds: float) -> np.ndarray:
    """(frames,) from 0 before ``first`` to 1 after ``last`` seconds."""
    t = np.arange(round(seconds * FPS)) / FPS
    return np.clip((t - first) / (last - first), 0.0, 1.0)


def lowered(drop: np.ndarray, back: np.ndarray | float = 0.0) -> np.ndarray:
    """Somebody whose feet stay while the rest comes down by ``drop`` (frames,) metres and goes ``back`` metres."""
    p = standing(len(drop) / FPS)
    by = np.stack([0 * drop, -drop, -np.broadcast_to(back, drop.shape)], axis=-1)
    feet = p[:, [7, 8, 10, 11]].copy()
    p = moved(p, by)
    p[:, [7, 8, 10, 11]] = feet
    for hip, knee, ankle in ((1, 4, 7), (2, 5, 8)):
        shin, thigh = 0.42, 0.42
        line = p[:, hip] - p[:, ankle]
        length = np.minimum(np.linalg.norm(line, axis=-1), 0.83)
        along = line / np.linalg.norm(line, axis=-1, keepdims=True)
        forward = np.cross([1.0, 0.0, 0.0], along)
        forward *= np.where(forward[:, 2:] < 0, -1, 1)
        near = (length**2 + shin**2 - thigh**2) / (2 * length)
        p[:, knee] = p[:, ankle] + along * near[:, None] + forward * np.sqrt(shin**2 - near**2)[:, None]
    return p


def bent(angle: np.ndarray) -> np.ndarray:
    """Somebody on straight legs whose trunk leans forward by (frames,) radians."""
    p = standing(len(angle) / FPS)
    pelvis = p[:, [1, 2]].mean(axis=1, keepdims=True)  # it is the hips that bend
    sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
    around = p[:, UPPER] - pelvis
    y, z = around[..., 1] * cos - around[..., 2] * sin, around[..., 2] * cos + around[..., 1] * sin
    p[:, UPPER] = np.stack([around[..., 0], y, z], axis=-1) + pelvis
    for side in ("left", "right"):
        for joint, drop in (("elbow", 0.27), ("wrist", 0.53)):
            p[:, J[f"{side}_{joint}"]] = p[:, J[f"{side}_shoulder"]] - [0.0, drop, 0.0]
    return p


def tipped(angle: np.ndarray, floor: float = 0.1) -> np.ndarray:
    """The whole body turned over backwards by (frames,) radians, its lowest joint on the floor or standing."""
    p = standing(len(angle) / FPS)
    sin, cos = np.sin(angle)[:, None], np.cos(angle)[:, None]
    p = np.stack([p[..., 0], p[..., 1] * cos + p[..., 2] * sin, p[..., 2] * cos - p[..., 1] * sin], axis=-1)
    p[..., 1] -= p[..., 1].min(axis=1, keepdims=True)
    return p + np.array([0.0, floor, 0.0]) * (angle > 0.1)[:, None, None]


def arm_up(side: str, share: np.ndarray, p: np.ndarray | None = None) -> np.ndarray:
    """An arm that goes from hanging (0) over the front to straight up (1), by ``share`` (frames,)."""
    p = standing(len(share) / FPS) if p is None else p.copy()
    shoulder, angle = p[:, J[f"{side}_shoulder"]], np.pi * share
    for joint, length in (("elbow", 0.27), ("wrist", 0.53)):
        way = np.stack([0 * angle, -np.cos(angle), np.sin(angle)], axis=-1)
        p[:, J[f"{side}_{joint}"]] = shoulder + length * way
    return p


def kicked(side: str, height: float, seconds: float = 3.0) -> np.ndarray:
    """A straight leg that swings up to the front and down again in half a second."""
    p = standing(seconds)
    swing = np.interp(np.arange(len(p)) / FPS, [1.0, 1.25, 1.5], [0, 1, 0], left=0, right=0) * np.arccos(1 - height)
    hip = p[:, J[f"{side}_hip"]].copy()
    for joint in ("knee", "ankle", "foot"):
        at = p[:, J[f"{side}_{joint}"]] - hip
        y, z = at[:, 1], at[:, 2]
        turned = np.stack([at[:, 0], y * np.cos(swing), z - y * np.sin(swing)], axis=-1)
        p[:, J[f"{side}_{joint}"]] = hip + turned
    return p


def after(*parts: np.ndarray) -> np.ndarray:
    """Parts in a row, each put where the last one ends."""
    whole = parts[0]
    for part in parts[1:]:
        whole = np.concatenate([whole, part + (whole[-1, 0] - part[0, 0]) * [1.0, 0.0, 1.0]])
    return whole


def squats(count: int, seconds: float = 9.0) -> np.ndarray:
    """Down and up ``count`` times, two seconds each, standing for the rest."""
    t = np.arange(round(seconds * FPS)) / FPS
    return lowered(np.where(t < 2 * count, 0.225 * (1 - np.cos(np.pi * t)), 0.0))


BACK = walking(1.2, 3.0) * [-1.0, 1.0, -1.0]
"""Walking to where -Z is, facing there."""
SEATED = lowered(0.45 * ramp(1, 2, 5), 0.35 * ramp(1, 2, 5))
PEOPLE = {
    "walk slowly": walking(0.7, 5),
    "walk fast": walking(1.8, 4),
    "run fast": walking(3.6, 3),
    "steps back": spun(walking(0.8, 4), np.full(80, np.pi)),
    "sidestep left": spun(walking(0.8, 4), np.full(80, -np.pi / 2)),
    "sidestep right": spun(walking(0.8, 4), np.full(80, np.pi / 2)),
    "walk and stop": after(walking(1.2, 3), standing(2)),
    "start walking": after(standing(1.5), walking(1.1, 3.5)),
    "walk then run": after(walking(1.2, 2.5), walking(3.2, 2.5)),
    "run then walk": after(walking(3.2, 2.5), walking(1.2, 2.5)),
    "there and back": after(walking(1.2, 3), spun(standing(1), np.linspace(0, np.pi, 20)), BACK),
    "turn around": spun(standing(4), np.pi * ramp(1, 3, 4)),
    "spin": spun(standing(4), 2 * np.pi * ramp(0.5, 3.5, 4)),
    "sit down from standing": SEATED,
    "stand up": SEATED[::-1],
    "sit": np.repeat(SEATED[-1:], 80, axis=0),
    "sit and stand up": np.concatenate([SEATED, SEATED[::-1]])[20:-20],
    "lie down": tipped(np.pi / 2 * ramp(2, 5, 7)),
    "get up": tipped(np.pi / 2 * ramp(2, 4, 6))[::-1],
    "lie on the back": tipped(np.full(80, np.pi / 2)),
    "crouch down": lowered(0.5 * ramp(1, 2, 4)),
    "bow": bent(np.radians(50) * (ramp(1, 1.5, 4) - ramp(2.5, 3, 4))),
    "touch the toes": bent(np.radians(135) * (ramp(1, 2, 5) - ramp(3, 4, 5))),
    "three squats": squats(3),
    "one squat": squats(1, 5.0),
    "raise the left arm": arm_up("left", ramp(1, 1.5, 3)),
    "raise the right hand": arm_up("right", ramp(1, 1.5, 3)),
    "raise the right arm twice": arm_up("right", (1 - np.cos(np.pi * np.minimum(np.arange(120) / FPS, 4))) / 2),
    "both hands over the head": arm_up("left", ramp(1, 1.5, 3), arm_up("right", ramp(1, 1.5, 3))),
    "point": arm_up("right", 0.5 * ramp(1, 1.5, 4)),
    "kick left": kicked("left", 0.8),
    "kick right": kicked("right", 0.8),
    "jump, then walk": after(jumping(0.35, 2), walking(1.2, 4)),
    "squat, then jump": after(lowered(0.225 * (1 - np.cos(np.pi * np.arange(40) / FPS))), jumping(0.35, 3)),
    "walk, then sit": after(walking(1.0, 3), lowered(0.45 * ramp(1, 2, 4), 0.35 * ramp(1, 2, 4))),
    "stand up and walk": after(SEATED[::-1][:80], walking(1.0, 3)),
    "back, then forward": after(walking(1.0, 3.0)[::-1], walking(1.0, 3)),
    "right, then left arm": np.concatenate(
        [arm_up("right", ramp(0.5, 1, 3) - ramp(2, 2.5, 3)), arm_up("left", ramp(0.5, 1, 3) - ramp(2, 2.5, 3))]
    ),
}
"""Who does what: by the name of the check that the person must pass."""
BOTH_RIGHT = {
    "walk and stop": {"start walking"},
    "spin": {"turn around"},
    "sit and stand up": {"one squat"},
    "one squat": {"duck"},
    "squat, then jump": {"one squat", "duck"},
    "touch the toes": {"pick up"},
    "lie down": {"fall", "lie on the back"},
    "walk, then sit": {"sit down from standing"},
    "stand up and walk": {"stand up"},
    "back, then forward": {"steps back"},
    "raise the right arm twice": {"raise the right hand"},
}
"""Other checks that the same person may pass: they ask for a part of it, or for nearly the same."""


def passed(positions: np.ndarray) -> set[str]:
    """Names of the checks among those of `PEOPLE` that a person passes."""
    return {name for name in PEOPLE if BY_NAME[name].obeyed(BY_NAME[name].measured(positions, FPS))}


@pytest.mark.parametrize("name", PEOPLE)
def test_a_made_up_person_passes_its_own_check_and_hardly_any_other(name: str) -> None:
    check = BY_NAME[name]
    numbers = check.measured(PEOPLE[name], FPS)
    assert not check.failed(numbers), {b.measure: numbers[b.measure] for b in check.failed(numbers)}
    assert passed(PEOPLE[name]) - BOTH_RIGHT.get(name, set()) == {name}


@pytest.mark.parametrize(("name", "steepness"), [("up the stairs", 1.0), ("climb a ladder", 5.0)])
def test_climbs_are_refused_that_are_faster_than_people_climb(name: str, steepness: float) -> None:
    """Two metres upwards with the hands in front: step by step, and as if thrown."""
    check, reaching = BY_NAME[name], np.full(round(6 * FPS), 0.5)
    hands = arm_up("left", reaching, arm_up("right", reaching))

    def climber(pace: float) -> np.ndarray:
        height = 2 * ramp(1, 1 + 2 / pace, 6)[:, None]
        return moved(hands, height * [0.0, 1.0, 1 / steepness])

    slow, fast = (check.measured(climber(pace), FPS) for pace in (0.6, 3.0))
    assert not check.failed(slow), slow
    assert slow["fastest"] == pytest.approx(0.6, abs=0.05)
    assert [bound.measure for bound in check.failed(fast)] == ["fastest"]


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("what", ["sidestep", "kick", "wave with the {} hand", "punch", "walk and turn"])
def test_a_sided_check_says_the_opposite_in_the_mirror(what: str, side: str) -> None:
    name = what.format(side) if "{}" in what else f"{what} {side}"
    other = name.replace(side, "right" if side == "left" else "left")
    rng = np.random.default_rng(5)
    p = walking(1.1, 4.0) + np.cumsum(rng.normal(0, 0.02, (80, 22, 3)), axis=0)
    here, there = BY_NAME[name].measured(p, FPS), BY_NAME[other].measured(mirrored(p), FPS)
    assert here == pytest.approx(there, abs=2e-3)


@pytest.mark.parametrize("check", EVERYDAY, ids=lambda c: c.name)
@pytest.mark.parametrize("pace", [0.0, 1.25])
def test_nobody_obeys_by_standing_or_by_walking_ahead(check, pace: float) -> None:
    p = walking(pace, check.seconds) if pace else standing(check.seconds)
    assert not check.obeyed(check.measured(p, FPS))


@pytest.mark.parametrize("check", EVERYDAY, ids=lambda c: c.name)
def test_every_check_says_what_it_measures_and_measures_no_more(check) -> None:
    numbers = check.measured(walking(1.0, check.seconds), FPS)
    assert all(bound.measure in numbers and len(bound.why) > 3 for bound in check.bounds)
    assert all(np.isfinite(value) for value in numbers.values())
    assert all(bound.low <= bound.high for bound in check.bounds)
    assert 2.0 <= check.seconds <= 9.8


def test_there_are_sixty_everyday_prompts_or_more_in_all_themes() -> None:
    assert len(EVERYDAY) >= 60
    assert len({c.name for c in SETS["all"]}) == len({c.prompt for c in SETS["all"]}) == len(SETS["all"])
    assert all(len(checks) >= 5 for checks in THEMES.values())


@pytest.mark.parametrize("deep", [0.05, 0.12])
def test_who_sinks_into_the_floor_by_more_than_eight_centimetres_obeys_nothing(deep: float) -> None:
    check = BY_NAME["lie on the back"]
    p = PEOPLE["lie on the back"] - [0.0, 0.1 + deep, 0.0]
    assert check.obeyed(check.measured(p, FPS)) == (deep < 0.08)


def test_who_sits_in_the_air_or_lies_above_the_floor_does_not_obey() -> None:
    for name, up in (("sit", 0.3), ("lie on the back", 0.4)):
        check = BY_NAME[name]
        assert not check.obeyed(check.measured(PEOPLE[name] + [0.0, up, 0.0], FPS))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5])
def test_squats_are_counted(count: int) -> None:
    numbers = BY_NAME["three squats"].measured(squats(count, 10.0), FPS)
    assert numbers["squats"] == count
    assert BY_NAME["three squats"].obeyed(numbers) == (count == 3)


def test_times_counts_rises_and_no_wiggles() -> None:
    assert times(np.array([0, 1, 0, 1, 0.6, 0.9, 0.2]), 0.3, 0.8) == 2
    assert times(np.array([1, 1, 1.0]), 0.3, 0.8) == 0
    assert times(np.sin(np.linspace(0, 6 * np.pi, 200)), -0.5, 0.5) == 2


def test_a_body_knows_how_far_it_leans_turns_and_rolls() -> None:
    body = Body(tipped(np.linspace(0, np.pi / 2, 80)), FPS)
    assert body.lean[-1] == pytest.approx(90, abs=5)
    assert body.front[-1, 1] == pytest.approx(1.0, abs=0.02)
    across = np.repeat([[1.0, 0.0, 0.0]], 80, axis=0)
    assert body.spin(across)[-1] == pytest.approx(-90, abs=3)
    assert Body(spun(standing(), np.linspace(0, 1.0, 80)), FPS).heading[-1] == pytest.approx(np.degrees(1.0), abs=3)


def test_sets_are_chosen_by_name() -> None:
    assert len(chosen("all")) == len(chosen("basic")) + len(chosen("everyday"))
    assert [c.name for c in chosen("basic", ["bow"])] == ["bow"]
    with pytest.raises(MotionloomError, match="basic, everyday, all"):
        chosen("weekend")
    with pytest.raises(MotionloomError, match="no check called 'fly'"):
        chosen("everyday", ["fly"])


def test_no_everyday_prompt_is_taken_for_another_language() -> None:
    unseen = tomllib.loads(UNSEEN.read_text())
    own = [text for check in EVERYDAY for text in (check.prompt, *check.paraphrases)]
    prompts = [*own, *unseen.values()]
    assert len(prompts) > 190
    assert not [text for text in prompts if not is_english(text)]
