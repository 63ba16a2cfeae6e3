"""Parts of another clip laid over a clip, and heads that look somewhere."""

from dataclasses import replace

import numpy as np
import pytest

from motionloom.core import rotations as rot
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.kinematics.gaze import NOD, TURN, looking, looks
from motionloom.requests.tasks import Edit
from motionloom.retarget import from_smpl22, joints22
from motionloom.tasks.direct_edits import Look, Overlay, Smooth
from motionloom.tasks.edit import changes_from_options, edit
from motionloom.tasks.run import Models, Plan, run
from tests.recorded import tiny
from tests.tasks.test_edit import person, rig

FORWARD = np.array([0.0, 0.0, 1.0])
HEAD, SPINE, RIGHT_WRIST = 15, 9, 21
ALL_BUT_THE_ARM = ("lower_body", "torso", "head_neck", "left_arm")


def waving(seconds: float, fps: float = 30.0) -> Motion:
    """Somebody who stands, elsewhere, with the right arm up."""
    frames = round(seconds * fps)
    turns = np.zeros((frames, 22, 3))
    turns[:, 0, 1], turns[:, 17, 2] = -1.0, -1.3
    return Motion(SMPL22, fps, np.tile([9.0, 0.95, 9.0], (frames, 1)), rot.rotvec_to_quat(turns))


def changed(clip: Motion, *changes: Overlay | Look | Smooth) -> Motion:
    """One version, of weights that are not used."""
    return edit(tiny.prior(), clip, "", changes)[0]


def gaze(motion: Motion) -> np.ndarray:
    """(frames, 3) where the head of a 22-joint person faces."""
    return rot.rotate(motion.world_rotations()[:, HEAD], FORWARD)


def test_an_arm_follows_another_clip_and_the_rest_stays() -> None:
    clip = person(4.0)
    edited = changed(clip, Overlay(((1.0, 3.0),), waving(5.0), ALL_BUT_THE_ARM))
    others = [joint for joint in range(22) if joint not in SMPL22.groups["right_arm"]]
    assert np.array_equal(edited.rotations[:, others], clip.rotations[:, others])
    assert np.array_equal(edited.root, clip.root)
    assert np.array_equal(edited.rotations[:20], clip.rotations[:20])
    assert np.array_equal(edited.rotations[60:], clip.rotations[60:])
    assert np.abs(edited.rotations[40, 17] - waving(1.0).rotations[0, 17]).max() < 1e-6
    steps = np.linalg.norm(np.diff(edited.positions()[:, RIGHT_WRIST], axis=0), axis=-1)
    assert steps.max() < 0.3, "the arm goes up in a few frames"


def test_another_body_follows_as_well_and_no_longer_than_the_clip_lasts() -> None:
    clip = from_smpl22(person(4.0), rig())
    edited = changed(clip, Overlay(((1.0, 4.0),), waving(1.0), ALL_BUT_THE_ARM))
    up = joints22(edited)[:, RIGHT_WRIST, 1] - joints22(clip)[:, RIGHT_WRIST, 1]
    assert up[25:35].min() > 0.3
    assert np.array_equal(edited.rotations[40:], clip.rotations[40:])


@pytest.mark.parametrize("body", [None, rig()], ids=["smpl", "another"])
def test_a_head_looks_at_a_place(body: Skeleton | None) -> None:
    clip = person(3.0) if body is None else from_smpl22(person(3.0), body)
    ahead = rot.rotate(person(3.0).world_rotations()[:, SPINE], FORWARD)
    eyes = joints22(clip)[:, HEAD]
    place = eyes + 3 * rot.rotate(rot.rotvec_to_quat(np.array([0.0, 0.6, 0.0])), ahead)
    turned = looking(clip, place, np.ones(len(clip)))
    moved = np.linalg.norm(joints22(turned)[:, HEAD] - eyes, axis=-1)
    assert moved.max() < 0.08, "a neck is short"
    legs = [0, 1, 2, 4, 5, 7, 8, 16, 17, 20, 21]
    assert np.allclose(joints22(turned)[:, legs], joints22(clip)[:, legs])
    if body is None:
        line = place - turned.positions()[:, HEAD]
        off = np.arccos(np.clip((gaze(turned) * line).sum(-1) / np.linalg.norm(line, axis=-1), -1, 1))
        assert np.degrees(off).max() < 4


def test_a_head_turns_no_further_than_a_neck_can_and_not_to_what_is_behind() -> None:
    clip = waving(2.0)
    ahead = gaze(clip)[0]
    for degrees in (90, 180):
        turn = rot.rotvec_to_quat(np.array([0.0, np.radians(degrees), 0.0]))
        place = clip.positions()[0, HEAD] + 50 * rot.rotate(turn, ahead)
        turned = looking(clip, place, np.ones(len(clip)))
        angle = np.arccos(gaze(turned)[0] @ ahead)
        assert angle == pytest.approx(TURN if degrees == 90 else 0.0, abs=1e-6)
    high = looking(clip, clip.positions()[0, HEAD] + [0, 50, 0] + ahead, np.ones(len(clip)))
    assert np.arccos(gaze(high)[0] @ ahead) == pytest.approx(NOD, abs=1e-6)


ALL_BUT_THE_HEAD = ("lower_body", "torso", "left_arm", "right_arm")


def moved(words: str, clip: Motion, *spans: tuple[float, float]) -> np.ndarray:
    """(frames, 2) degrees to the left and up of where the head looked, of a clip that faces +Z or nearly."""
    edited = changed(clip, *changes_from_options(words, keep=ALL_BUT_THE_HEAD, between=spans))
    others = [joint for joint in range(22) if joint not in SMPL22.groups["head_neck"]]
    assert np.array_equal(edited.rotations[:, others], clip.rotations[:, others])
    assert np.allclose(looks(edited), gaze(edited), atol=0.06), "the uniform person's face is to the front of its head"
    ahead = rot.rotate(rot.inverse(clip.world_rotations()[:, SPINE]), looks(edited))
    before = rot.rotate(rot.inverse(clip.world_rotations()[:, SPINE]), looks(clip))
    angles = [np.stack([np.arctan2(one[:, 0], one[:, 2]), np.arcsin(one[:, 1])], axis=-1) for one in (ahead, before)]
    return np.degrees(angles[0] - angles[1])


def test_a_head_does_what_words_say_of_it() -> None:
    clip = waving(4.0)
    for words, left, up in (("looks to the left", 55, 0), ("he looks up and to his right", -55, 30)):
        angles = moved(words, clip, (1.0, 3.0))
        assert angles[60] == pytest.approx([left, up], abs=3), words
        assert np.abs(angles[:30]).max() == np.abs(angles[90:]).max() == 0
        assert np.abs(np.diff(angles, axis=0)).max() < 10, "softly"
    nods = moved("nods twice", clip)
    assert nods[:, 1].min() == pytest.approx(-20, abs=2)
    assert np.abs(nods[:, 0]).max() < 1
    down = nods[:, 1] < -10
    assert (np.diff(down.astype(int)) == 1).sum() == 2
    assert np.abs(nods[60:]).max() < 1e-6, "twice, and then no more"
    slightly = moved("nods slightly and slowly", clip)[:, 1]
    assert slightly.min() == pytest.approx(-10, abs=1)
    for words, side in (("shakes the head three times", 20), ("looks around", 50)):
        angles = moved(words, clip)
        assert angles[:, 0].max() > side
        assert angles[:, 0].min() < -side
        assert np.abs(angles[:, 1]).max() < 3


def test_words_that_say_nothing_of_a_head_are_refused() -> None:
    with pytest.raises(MotionloomError, match=r"a head nods, shakes, looks left.*'kicks' says none of these"):
        changes_from_options("kicks", keep=ALL_BUT_THE_HEAD)
    assert [type(one).__name__ for one in changes_from_options("kicks", keep=ALL_BUT_THE_ARM)] == ["Redraw"]


def test_a_look_begins_and_ends_softly() -> None:
    clip = waving(4.0)
    edited = changed(clip, Look(((1.0, 3.0),), np.array([12.0, 1.6, 9.0])))
    assert np.array_equal(edited.rotations[:30], clip.rotations[:30])
    assert np.array_equal(edited.rotations[90:], clip.rotations[90:])
    turned = np.linalg.norm(np.diff(gaze(edited), axis=0), axis=-1)
    assert 0.01 < turned.max() < 0.2
    whole = changed(clip, Look((), np.array([12.0, 1.6, 9.0])))
    assert np.abs(np.diff(gaze(whole), axis=0)).max() < 1e-9, "there is no other side to come from"


def test_what_is_asked_becomes_changes_and_what_cannot_be_is_refused() -> None:
    place = np.zeros(3)
    assert [type(one) for one in changes_from_options("", source=waving(1.0), keep=["head"])] == [Overlay]
    assert [type(one).__name__ for one in changes_from_options("waves", look=place)] == ["Redraw", "Look"]
    assert [type(one).__name__ for one in changes_from_options("", look=place, between=[(0, 1)])] == ["Look"]
    with pytest.raises(MotionloomError, match="a text says or what another clip does; leave out one"):
        changes_from_options("waves", source=waving(1.0))
    with pytest.raises(MotionloomError, match="no part called 'tail' to keep"):
        Overlay((), waving(1.0), ["tail"])
    with pytest.raises(MotionloomError, match="no stretch from 1 to 9 s"):
        changed(person(4.0), Look(((1.0, 9.0),), place))
    with pytest.raises(MotionloomError, match="look must be a list of 3 numbers"):
        Edit(motion=person(1.0), look=(1.0, 2.0))  # type: ignore[arg-type]


def test_somebody_looks_at_the_other_person() -> None:
    one, two = waving(2.0), waving(2.0)
    two = replace(two, root=two.root + np.array([2.0, 0.0, 1.0]))
    values = Edit(motion=one, person=0, look_at=1)
    plan = Plan(task="edit", values=values, sampling=values.sampling, people=(one, two))
    (result,) = run(plan, Models(tiny.prior()))
    first, second = result.people
    assert second is two
    line = two.positions()[:, HEAD] - first.positions()[:, HEAD]
    before, after = (
        np.degrees(np.arccos((gaze(motion) * line).sum(-1) / np.linalg.norm(line, axis=-1)))[20]
        for motion in (one, first)
    )
    assert after < before - 30


def trembling(seconds: float) -> tuple[Motion, Motion]:
    """Somebody who moves, and the same with a tremor of 8 degrees in every joint and 2 cm in the pelvis."""
    calm = person(seconds)
    shake = np.random.default_rng(1).normal(size=(len(calm), 22, 3))
    turns = rot.multiply(calm.rotations, rot.rotvec_to_quat(np.radians(8) * shake))
    return calm, replace(calm, rotations=turns, root=calm.root + 0.02 * shake[:, 0])


def quickness(motion: Motion) -> np.ndarray:
    """(frames - 2,) metres: how far the wrists and ankles are from the middle of where they were and will be."""
    places = motion.positions()[:, [7, 8, 20, 21]]
    return np.linalg.norm(places[2:] - 2 * places[1:-1] + places[:-2], axis=-1).mean(axis=-1)


def test_a_tremor_goes_and_what_is_slow_stays() -> None:
    calm, shaken = trembling(4.0)
    smoothed = changed(shaken, Smooth((), 0.4))
    assert quickness(smoothed).mean() < 0.25 * quickness(shaken).mean()
    apart = np.linalg.norm(smoothed.positions() - calm.positions(), axis=-1)
    assert apart.mean() < 0.6 * np.linalg.norm(shaken.positions() - calm.positions(), axis=-1).mean()
    assert np.abs(changed(calm, Smooth((), 0.1)).positions() - calm.positions()).max() < 0.05


def test_only_a_stretch_and_only_some_parts_are_smoothed() -> None:
    _, shaken = trembling(4.0)
    smoothed = changed(shaken, Smooth(((1.0, 3.0),), 0.4, ALL_BUT_THE_ARM))
    arm = SMPL22.groups["right_arm"]
    others = [joint for joint in range(22) if joint not in arm]
    assert np.array_equal(smoothed.rotations[:, others], shaken.rotations[:, others])
    assert np.array_equal(smoothed.root, shaken.root)
    inside = slice(round(1.0 * shaken.fps), round(3.0 * shaken.fps))
    assert np.array_equal(np.delete(smoothed.rotations, inside, axis=0), np.delete(shaken.rotations, inside, axis=0))
    middle = slice(inside.start + 10, inside.stop - 10)
    turned = [np.abs(np.diff(one.rotations[middle][:, list(arm)], 2, axis=0)).mean() for one in (smoothed, shaken)]
    assert turned[0] < 0.25 * turned[1]


def test_smoothing_is_asked_with_seconds_and_alone() -> None:
    assert [type(one) for one in changes_from_options("", smooth=0.2, keep=["head"], between=[(0, 1)])] == [Smooth]
    assert [type(one).__name__ for one in changes_from_options("waves", smooth=0.2)] == ["Redraw", "Smooth"]
