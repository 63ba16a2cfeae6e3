"""Editing with a random prior: what is kept stays to the bit, borders do not jump, and what cannot be asked is told."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import WIDTH
from motionloom.core.models.networks.prior import PriorSession
from motionloom.core.models.networks.prior_condition import Bound
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.edits.boundary import InpaintWindow, arrival, joining
from motionloom.requests.sampling import Sampling
from motionloom.retarget import from_smpl22
from motionloom.retarget.onto import match_root
from motionloom.tasks.edit import Extend, Loop, Redraw, changes_from_options, edit, inpaint_motion, kept_feature_mask
from motionloom.tasks.splice import ground_pose_at, kept_parts, move_rigidly, person_at_20, splice
from tests.noise import normal
from tests.recorded import tiny

FEW = {"steps": 2, "guidance": 1.0}


@pytest.fixture(scope="module")
def prior() -> Prior:
    """Random weights around a standing person, so that what is drawn has human sizes."""
    features = humanml.motion_to_features(person(2.0))
    return replace(tiny.prior(), mean=np.asarray(features.mean(0)), std=np.full(WIDTH, 0.02, np.float32))


def person(seconds: float, fps: float = 20.0) -> Motion:
    """Strides along a curve with swinging arms, smooth in time."""
    t = np.arange(round(seconds * fps)) / fps
    turns = np.zeros((len(t), 22, 3))
    swing = 0.5 * np.sin(2 * np.pi * t)
    turns[:, 0, 1] = 0.3 * t + 0.4
    for joint, sign in ((1, 1), (2, -1), (16, -1), (17, 1)):
        turns[:, joint, 0] = sign * swing
    turns[:, [4, 5], 0] = 0.3
    turns[:, 16, 2], turns[:, 17, 2] = -1.2, 1.2
    root = np.stack([3 + np.sin(0.5 * t), 0.9 + 0.02 * np.cos(4 * np.pi * t), -2 + 0.8 * t], axis=-1)
    return Motion(SMPL22, fps, root, rot.rotvec_to_quat(turns))


def rig() -> Skeleton:
    """Another body: 20 % larger, other names, a finger, under a root that stands on the floor."""
    names = ("world", *(n.replace("left_", "l_").replace("right_", "r_") for n in SMPL22.names), "r_finger")
    offsets = np.concatenate([np.zeros((1, 3)), 1.2 * SMPL22.offsets, [[-0.1, 0, 0]]])
    return Skeleton(names, (-1, *(p + 1 for p in SMPL22.parents), 22), offsets)


def floating(motion: Motion) -> Motion:
    """The same places told with a still root and moving hips, as some files do."""
    rotations = np.array(motion.rotations)
    translations = np.tile(motion.skeleton.offsets, (len(motion), 1, 1))
    translations[:, 1] += motion.root
    return Motion(motion.skeleton, motion.fps, np.zeros((len(motion), 3)), rotations, translations)


def same(a: Motion, b: Motion, frames: slice) -> bool:
    pairs = [(a.root, b.root), (a.rotations, b.rotations)]
    if a.translations is not None and b.translations is not None:
        pairs.append((a.translations, b.translations))
    return all(np.array_equal(one[frames], other[frames]) for one, other in pairs)


def clip_of(kind: str) -> Motion:
    if kind.startswith("person"):
        return person(3.0, float(kind.split()[-1]))
    large = from_smpl22(person(3.0, 30.0), rig())
    return large if kind == "rig" else floating(large)


@pytest.mark.parametrize("kind", ["person at 20", "person at 60", "rig", "floating"])
def test_outside_of_the_stretch_everything_stays_to_the_bit(prior: Prior, kind: str) -> None:
    """And inside it does not; the length, rate and skeleton are the clip's."""
    clip = clip_of(kind)
    edited = edit(prior, clip, "a person turns", Redraw([(0.5, 1.2), (2.0, 2.5)]), **FEW)[0]
    borders = [round(s * clip.fps) for s in (0.5, 1.2, 2.0, 2.5)]
    assert (len(edited), edited.fps, edited.skeleton) == (len(clip), clip.fps, clip.skeleton)
    assert all(same(edited, clip, slice(*s)) for s in ((0, borders[0]), borders[1:3], (borders[3], None)))
    moved = np.linalg.norm(edited.positions() - clip.positions(), axis=-1).max(axis=1)
    assert (moved[borders[0] + 4 : borders[1] - 4] > 1e-3).all()


@pytest.mark.parametrize("kind", ["person at 20", "rig", "floating"])
def test_kept_joints_keep_their_rotations_and_the_root_its_place(prior: Prior, kind: str) -> None:
    clip = clip_of(kind)
    edited = edit(prior, clip, "a person jumps", Redraw(keep=["lower_body"]), **FEW)[0]
    shift = len(clip.skeleton) > 22
    lower = [j + shift for j in SMPL22.groups["lower_body"]]
    upper = [j + shift for j in (3, 9, 16, 17, 18)]
    assert np.array_equal(edited.rotations[:, lower], clip.rotations[:, lower])
    np.testing.assert_array_equal(edited.positions()[:, lower], clip.positions()[:, lower])
    assert (np.abs(edited.rotations[:, upper] - clip.rotations[:, upper]).max(axis=(0, 2)) > 1e-3).all()
    if shift:
        assert np.array_equal(edited.rotations[:, -1], clip.rotations[:, -1]), "fingers are not drawn"


def test_the_root_alone_can_be_kept(prior: Prior) -> None:
    clip = person(3.0)
    edited = edit(prior, clip, "a person jumps", Redraw([(1.0, 2.0)], keep=["root"]), **FEW)[0]
    assert np.array_equal(edited.root, clip.root)
    assert not np.array_equal(edited.rotations[:, 1], clip.rotations[:, 1])


def test_the_numbers_of_kept_parts_are_the_published_masks() -> None:
    """`lower_body` here is `lower_body` of the control models, and a wrist adds its rotation and displacement."""
    np.testing.assert_array_equal(kept_feature_mask(["lower_body"]), humanml.mask("lower_body"))
    assert kept_feature_mask(["left_wrist"]).sum() == 3 + 6 + 3
    assert not kept_feature_mask([]).any()


def test_a_stretch_arrives_where_the_clip_goes_on() -> None:
    """Random features bent by `arrival` integrate to the known facing and place, by a loop over frames."""
    known = np.asarray(humanml.motion_to_features(person(5.0)))[None].astype(np.float64)
    mask = np.ones_like(known, dtype=np.bool_)
    mask[:, 30:70] = False
    wild = np.where(mask, known, known + 0.05 * normal(known.shape, 1))
    stretch = InpaintWindow(np.zeros((100, 22, 3)), 30, 70, np.zeros(WIDTH, bool))
    bent = arrival(known, mask, stretch)(wild)

    def walked(features: np.ndarray) -> tuple[float, complex]:
        angle, place = 0.0, 0j
        for frame in range(70):
            angle += 2 * features[frame, 0]
            place += complex(features[frame, 1], features[frame, 2]) * np.exp(1j * angle)
        return angle, place

    (a, p), (b, q), (_, far) = (walked(x[0]) for x in (known, bent, wild))
    assert abs(np.exp(1j * a) - np.exp(1j * b)) < 1e-6
    assert abs(p - q) < 1e-6 < 0.1 < abs(p - far)
    assert np.array_equal(bent[mask], wild[mask])


def test_what_is_drawn_leaves_the_known_frames_without_a_jump() -> None:
    """Parabolas known outside, a line far away drawn inside: value and change go on at the borders."""
    t = np.arange(60.0, dtype=np.float64)[None, :, None]
    rates = np.linspace(-1, 1, WIDTH, dtype=np.float64)
    known = 0.01 * rates * (t - 20) ** 2 + 1
    mask = np.ones_like(known, dtype=np.bool_)
    mask[:, 20:40] = False
    mask[:, :, 30] = True
    sampled = np.where(mask, known, 5 + 0.3 * t)
    joined = joining(known, mask, 20, 40)(sampled)
    assert np.array_equal(joined[mask], known[mask])
    free = [n for n in range(259) if n != 30]
    for border, step in ((19, 1), (40, -1)):
        pace = known[:, border] - known[:, border - step]
        first, second = joined[:, border + step], joined[:, border + 2 * step]
        np.testing.assert_allclose((first - known[:, border])[:, free], pace[:, free], atol=1e-5)
        assert (np.abs((second - first - pace)[:, free]) < 0.5).all(), "a jump would be 4 or more"
    np.testing.assert_allclose(joined[:, 29:31], sampled[:, 29:31], atol=0.6, rtol=0)


def test_an_open_stretch_is_left_alone() -> None:
    """At the clip's end, and where the root is known anyway, there is nothing to arrive at."""
    known = np.asarray(humanml.motion_to_features(person(3.0)))[None]
    mask = np.zeros_like(known, dtype=np.bool_)
    at_end = InpaintWindow(np.zeros((60, 22, 3)), 30, known.shape[1], np.zeros(WIDTH, bool))
    assert np.array_equal(arrival(known, mask, at_end)(2 * known), 2 * known)
    mask[..., :3] = True
    assert np.array_equal(arrival(known, mask, replace(at_end, last=50))(2 * known), 2 * known)


@pytest.mark.parametrize(("first", "last"), [(15, 30), (0, 30), (15, 59)])
def test_known_frames_come_back_in_the_world(prior: Prior, first: int, last: int) -> None:
    """Of a clip far from the origin; also where the stretch is at either end."""
    positions = person(3.0).positions()
    window = InpaintWindow(positions, first, last, np.zeros(WIDTH, bool))
    placed = inpaint_motion(prior, window, "a person jumps", Sampling(**FEW), seed=0)
    outside = [*range(first), *range(last, 59)]
    np.testing.assert_allclose(placed.positions[outside], positions[:59][outside], atol=2e-4)
    assert np.abs(placed.positions[first + 3 : last - 3] - positions[first + 3 : last - 3]).max() > 1e-3


def test_little_strength_stays_nearer_to_the_clip(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the best estimate where all that is known is that numbers are standard normal."""

    def shrunk(net: PriorSession, state: np.ndarray, level: int, bound: Bound) -> np.ndarray:
        return (prior.schedule.signal[level] * state).astype(np.float32)

    monkeypatch.setattr(PriorSession, "__call__", shrunk)
    clip = person(3.0)
    near, far = (
        np.mean([np.abs(one.positions() - clip.positions()).mean() for one in several])
        for several in (
            edit(prior, clip, "a person jumps", Redraw(strength=s), seed=1, count=4, **FEW) for s in (0.02, 1.0)
        )
    )
    assert near < 0.5 * far


def speeds(motion: Motion) -> np.ndarray:
    return np.linalg.norm(np.diff(motion.positions(), axis=0), axis=-1).max(axis=1)


def test_a_splice_leaves_neither_a_jump_nor_a_kink() -> None:
    """A pose 0.2 rad and 10 cm away, turning at another rate, is met within the fastest step of either motion."""
    clip = person(4.0, 60.0)
    other = move_rigidly(person(4.0, 60.0), rot.rotvec_to_quat(np.array([0, 0.2, 0])), clip.root[0], clip.root[0] + 0.1)
    spliced = splice(clip, other, 90, last=160, keep=kept_parts(SMPL22, frozenset(), np.zeros(3, bool)))
    steps = np.linalg.norm(np.diff(spliced.positions(), axis=0), axis=-1).max(axis=1)
    bends = np.linalg.norm(np.diff(spliced.positions(), n=2, axis=0), axis=-1).max(axis=1)
    usual = np.linalg.norm(np.diff(clip.positions(), n=2, axis=0), axis=-1).max()
    assert steps[[89, 159]].max() < 1.1 * speeds(clip).max()
    assert bends[[88, 89, 158, 159]].max() < 2 * usual
    plain = np.diff(np.where(np.isin(np.arange(240), range(90, 160))[:, None], other.root, clip.root), n=2, axis=0)
    assert np.linalg.norm(plain, axis=-1).max() > 20 * usual, "the plain splice would jump"


def test_a_looped_clip_can_follow_itself(prior: Prior) -> None:
    """Frame 0, moved behind the last frame, continues it: no joint turns much faster there than the arms swing."""
    clip = person(3.75, 30.0)
    loop = edit(prior, clip, changes=Loop(), **FEW)[0]
    assert (len(loop), same(loop, clip, slice(0, 82))) == (112, True)

    def wrap(motion: Motion) -> float:
        turn = rot.multiply(motion.rotations[0], rot.inverse(motion.rotations[-1]))[1:]
        return float(np.linalg.norm(rot.quat_to_rotvec(turn), axis=-1).max())

    assert wrap(loop) < 2 * 0.5 * 2 * np.pi / 30
    assert wrap(clip) > 3 * 0.5 * 2 * np.pi / 30, "the clip alone would jump"


def test_a_clip_that_ends_where_it_began_loops_in_the_world(prior: Prior) -> None:
    still = person(3.0)
    still = replace(still, root=np.tile([1.0, 0.9, 2.0], (60, 1)))
    still = replace(still, rotations=still.rotations.copy() * 1.0)
    still.rotations[:, 0] = rot.IDENTITY
    loop = edit(prior, still, changes=Loop(), **FEW)[0]
    assert np.linalg.norm(loop.root[-1] - loop.root[0]) < 0.1


def test_an_extended_clip_is_the_clip_and_more(prior: Prior) -> None:
    clip = clip_of("rig")
    longer = edit(prior, clip, "a person sits", Extend(1.5), **FEW)[0]
    assert len(longer) == len(clip) + 45
    assert same(longer, clip, slice(0, len(clip)))
    assert speeds(longer)[len(clip) - 1] < 1.5 * speeds(clip).max()


def test_versions_have_their_own_seeds(prior: Prior) -> None:
    clip = person(3.0)
    reports: list[tuple[int, int]] = []
    two = edit(
        prior, clip, "a person jumps", Redraw([(1, 2)]), count=2, seed=4, progress=lambda *p: reports.append(p), **FEW
    )
    assert reports == [(1, 4), (2, 4), (3, 4), (4, 4)]
    alone = edit(prior, clip, "a person jumps", Redraw([(1, 2)]), seed=5, **FEW)[0]
    assert np.array_equal(two[1].rotations, alone.rotations)
    assert not np.array_equal(two[0].rotations, two[1].rotations)


def test_the_skeleton_can_be_the_persons(prior: Prior) -> None:
    edited = edit(prior, clip_of("rig"), "a person jumps", Redraw([(1, 2)]), skeleton="smpl", **FEW)[0]
    assert edited.skeleton == SMPL22
    assert edited.fps == 30


def test_a_long_clip_costs_what_its_window_costs(prior: Prior, monkeypatch: pytest.MonkeyPatch) -> None:
    """The network sees at most 8 seconds of a clip of half a minute."""
    lengths: list[int] = []
    forward = type(prior.net).__call__

    def counted(net, x, *rest):
        lengths.append(x.shape[1])
        return forward(net, x, *rest)

    monkeypatch.setattr(type(prior.net), "__call__", counted)
    edit(prior, person(30.0), "a person jumps", Redraw([(14, 16)]), **FEW)
    assert 0 < max(lengths) <= 160


def test_manner_keeps_places() -> None:
    """Hips that move under a still root are where the moving root had them."""
    clip = from_smpl22(person(1.0), rig())
    moved = match_root(floating(clip), clip)
    np.testing.assert_allclose(moved.positions()[:, 1:], clip.positions()[:, 1:], atol=1e-9)
    assert np.array_equal(moved.root, np.zeros((20, 3)))


def test_the_person_at_20_goes_straight_on() -> None:
    """One frame more than the clip needs, and the frames of the clip are the clip's."""
    clip = person(2.0)
    places = person_at_20(clip)
    assert len(places) == 41
    apart = places[:40] - clip.positions()
    np.testing.assert_allclose(apart, apart.mean(axis=(0, 1)) * [0, 1, 0] + 0 * apart, atol=0.03)
    np.testing.assert_allclose(places[40] - places[39], places[39] - places[38], atol=1e-9)


def test_standing_tells_the_facing() -> None:
    """A person who faces +X stands turned a quarter about +Y."""
    clip = person(1.0)
    clip.rotations[:, 0] = rot.rotvec_to_quat(np.array([0, np.pi / 2, 0]))
    assert ground_pose_at(clip, 0).facing == pytest.approx(np.pi / 2, abs=1e-6)


def edited_with(prior: Prior, options: dict) -> None:
    """Changes by single options, as the command line and the server ask for them."""
    names = ("keep", "between", "loop", "extend", "strength", "blend")
    own = {name: value for name, value in options.items() if name in names}
    changes = changes_from_options(options.get("text", ""), **own)
    edit(prior, person(3.0), changes=changes, **{key: value for key, value in options.items() if key not in own})


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({}, "nothing to change"),
        ({"text": " "}, "nothing to change"),
        ({"text": "walk", "keep": ["tail"]}, "tail"),
        ({"text": "walk", "keep": ["lower_body", "upper_body"]}, "all joints"),
        ({"keep": ["head"], "loop": True}, "kept parts"),
        ({"between": [(2.0, 6.0)]}, "3.00"),
        ({"between": [(-1.0, 1.0)]}, "3.00"),
        ({"between": [(2.0, 1.0)]}, "2 to 1"),
        ({"between": [(1.0, 1.01)]}, "at least"),
        ({"between": [(float("nan"), 1.0)]}, "nan"),
        ({"between": [(0.5, 1.5), (1.0, 2.0)]}, "overlap"),
        ({"extend": -1.0}, "extended"),
        ({"extend": 1e9}, "extended"),
        ({"extend": float("nan")}, "extended"),
        ({"text": "walk", "strength": 0.0}, "strength"),
        ({"text": "walk", "strength": 1.5}, "strength"),
        ({"loop": True, "blend": 2.9}, "blends"),
        ({"loop": True, "blend": 0.0}, "blends"),
        ({"text": "walk", "count": 0}, "count"),
        ({"text": "walk", "seed": -1}, "seed"),
        ({"text": "walk", "steps": 0}, "steps"),
        ({"text": "walk", "guidance": float("inf")}, "guidance"),
        ({"text": "walk", "skeleton": "mine"}, "skeleton"),
    ],
    ids=str,
)
def test_what_cannot_be_asked_is_refused(prior: Prior, options: dict, sentence: str) -> None:
    with pytest.raises(MotionloomError, match=sentence) as caught:
        edited_with(prior, options)
    assert "\n" not in str(caught.value)


def test_clips_that_cannot_be_edited_are_refused(prior: Prior) -> None:
    """Too short, too long for a whole, and no person at all."""
    with pytest.raises(MotionloomError, match="at least"):
        edit(prior, person(0.3), "walk")
    with pytest.raises(MotionloomError, match="at once"):
        edit(prior, person(61.0), "walk")
    chain = Skeleton(("a", "b"), (-1, 0), np.array([[0, 0, 0], [0, 1.0, 0]]))
    with pytest.raises(MotionloomError):
        edit(prior, Motion(chain, 30, np.zeros((60, 3)), np.tile(rot.IDENTITY, (60, 2, 1))), "walk")


def test_a_clip_with_z_up_is_reported(prior: Prior) -> None:
    """A body whose bones and world both have +Z up."""
    stand = rot.rotvec_to_quat(np.array([np.pi / 2, 0, 0]))
    clip = person(2.0)
    skeleton = Skeleton(SMPL22.names, SMPL22.parents, rot.rotate(stand, SMPL22.offsets))
    turned = rot.multiply(rot.multiply(stand, clip.rotations), rot.inverse(stand))
    with pytest.raises(MotionloomError, match="--up z"):
        edit(prior, Motion(skeleton, 20, rot.rotate(stand, clip.root), turned), "walk")
