"""Clips made from others: what their notes say is what they show."""

from dataclasses import replace

import numpy as np

from motionloom.core.features import humanml as hml
from motionloom_train.data.augment import Idle
from motionloom_train.data.clips import Clip, Note
from motionloom_train.data.derived import faces_up, held_clips, made_clips, sat_and_risen
from tests.kinematics import people

NOBODY = Idle(())


def clip(positions: np.ndarray, *notes: Note) -> Clip:
    features = hml.encode(hml.canonical(positions), heading="corrected").astype(np.float32)
    return Clip("a", "s", "free", "train", "plain", notes, features)


def places(longer: Clip) -> np.ndarray:
    return hml.decode_positions(longer.features.astype(np.float64))


def laid(face: float) -> np.ndarray:
    """Somebody who stands, turns about the ankles and lies after two seconds: on the back (1) or the face (-1)."""
    p = people.standing(3.0)
    angle = face * np.pi / 2 * np.clip(np.arange(len(p)) / 40, 0, 1)[:, None]
    y, z = p[..., 1] + 0.1, p[..., 2].copy()
    p[..., 1], p[..., 2] = np.cos(angle) * y + np.sin(angle) * z, np.cos(angle) * z - np.sin(angle) * y
    return p - [0.0, p[..., 1].min(), 0.0]


def test_who_has_lain_down_on_the_back_is_seen_to_lie() -> None:
    note = Note(0, 59, "action:lie down", ("a person lies down",), (0, 59))
    back = [n for longer in held_clips([clip(laid(1.0), note)], NOBODY) for n in longer.notes]
    assert [n.kind for n in back if n.kind == "action:lie"] == ["action:lie"]
    (lies,) = (n for n in back if n.kind == "action:lie")
    assert lies.last - lies.first >= 70
    longer = next(m for m in held_clips([clip(laid(1.0), note)], NOBODY) if len(m.notes) == 2)
    part = places(longer)[lies.first : lies.last]
    assert part[:, 0, 1].max() < 0.4
    assert all(map(faces_up, part))
    note = replace(note, texts=("a person lies down", "a person lies down on the back"))
    face = [n for longer in held_clips([clip(laid(-1.0), note)], NOBODY) for n in longer.notes]
    assert {n.kind for n in face} == {"action:lie down", "action:get up"}
    assert not any("the back" in text for n in face for text in n.texts)
    assert any("the back" in text for n in back for text in n.texts)


def test_a_seat_is_taken_and_left_within_one_window() -> None:
    p = people.standing(2.0)
    down = 0.35 * np.clip(np.arange(len(p)) / 34, 0, 1)[:, None]
    above = [0, 1, 2, 3, 4, 5, 6, 9, *range(12, 22)]
    p[:, above, 1] -= down
    (both,) = sat_and_risen([clip(p, Note(0, 39, "action:sit down", ("a person sits down",)))], 4)
    (note,) = both.notes
    assert note.kind == "action:sit down and stand up"
    height = places(both)[:, 0, 1]
    first, last = note.core or (0, 0)
    assert last - first <= 147
    assert height[first:last].min() < height[0] - 0.3
    assert abs(height[-1] - height[0]) < 0.05
    assert list(sat_and_risen([clip(p, Note(0, 39, "action:crouch", ("a person crouches",)))], 4)) == []


def test_gestures_go_on_for_four_seconds() -> None:
    """Windows of standing last two and a half, in which hands hardly arrive before they leave again."""
    standing = clip(people.standing(2.6), Note(0, 51, "stand"))
    walks = clip(people.walking(1.2, 2.6), Note(0, 51, "walk"))
    gestures = list(made_clips([standing, walks], 60, seed=1))
    assert len(gestures) > 40
    assert min(len(one.features) for one in gestures) >= 79


def test_who_has_walked_up_and_stopped_greets() -> None:
    walks = people.walking(1.2, 3.0)
    stops = np.concatenate([walks, np.repeat(walks[-1:], 40, axis=0)])
    noted = clip(stops, Note(0, len(stops) - 1, "action:stop walking", ("he walks and stops",), (10, len(walks))))
    gestures = list(made_clips([clip(people.standing(2.6), Note(0, 51, "stand")), noted], 200, seed=1))
    behind = [one for one in gestures if one.notes[0].kind == "action:made behind a walk"]
    assert behind
    for one in behind:
        p, (note,) = places(one), one.notes
        assert p[0, 0, 2] < 0.1
        assert p[-1, 0, 2] > 1.0
        assert note.core
        assert note.core[1] - note.core[0] >= 40
        assert all("stop" in text for text in note.texts)


def test_a_load_is_carried_from_the_first_frame_to_the_last() -> None:
    walks = clip(people.walking(1.2, 5.0), Note(0, 99, "walk"))
    gestures = list(made_clips([clip(people.standing(2.6), Note(0, 51, "stand")), walks], 200, seed=1))
    carries = [one for one in gestures if one.notes[0].kind == "action:made carry"]
    assert carries
    for one in carries:
        p = places(one)
        assert p[-1, 0, 2] - p[0, 0, 2] > 2
        assert (p[:, [20, 21], 2] - p[:, :1, 2] > 0.2).all()
