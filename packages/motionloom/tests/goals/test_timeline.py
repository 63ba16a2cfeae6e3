"""Timeline files: what the keys mean, what is refused and on which line, and that the schema says the same."""

import os
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom import io
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from motionloom.goals.remarks import parts_read
from motionloom.goals.schemas import timeline_schema
from motionloom.goals.segment import Segment
from motionloom.goals.timeline import plain_timeline, read_timeline, timeline_from, timeline_of
from motionloom.io import lined_yaml
from motionloom.requests.fields import specs
from motionloom.requests.timeline import SegmentKeys, TimelineKeys
from tests.schema_check import valid
from tests.work import work

ROOT = Path(__file__).parents[4]
EXAMPLES = sorted((ROOT / "examples" / "timelines").glob("*.yaml"))
PATH = "{points: [[0, 0], [0, 4]]}"
WHOLE, PART = specs(TimelineKeys), specs(SegmentKeys)


@pytest.fixture
def read(tmp_path):
    def reader(text: str | bytes):
        (tmp_path / "t.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_timeline(tmp_path / "t.yaml")

    return reader


@pytest.mark.parametrize(
    ("text", "seconds", "lengths", "rests"),
    [
        ("a person squats down once and comes back up", 5.0, [2.2, 2.8], [1]),
        ("an athlete does three squats", 7.0, [2.2, 2.2, 2.6], []),
        ("a person jumps twice", 2.0, [1.0, 1.0], []),
        ("a man jumps twice, then waves", 8.0, [1.5, 1.9, 4.6], []),
        ("a man jumps twice, then waves", 10.0, [1.5, 1.5, 1.15, 5.85], [2]),
        ("a person does three squats", None, [2.2, 2.2, 2.2], []),
    ],
)
def test_repetitions_take_the_seconds_that_were_said(
    text: str, seconds: float | None, lengths: list[float], rests: list[int]
) -> None:
    """The last one takes a little longer, or the person stands behind it."""
    timeline = timeline_of(text, seconds, amounts=True)
    assert [segment.seconds for segment in timeline.segments] == pytest.approx(lengths)
    assert [i for i, one in enumerate(timeline.segments) if one.text.endswith(" stands still")] == rests


@pytest.mark.parametrize("seconds", [None, 4.0])
def test_a_length_changes_how_long_a_way_takes_and_not_where_it_leads(seconds: float | None) -> None:
    (segment,) = timeline_of("a person takes three steps back", seconds, amounts=True).segments
    assert segment.goal is not None
    assert len(segment.goal) == round(20 * segment.seconds)
    assert segment.goal.positions[-1, 0, 2] == pytest.approx(-1.2)


@pytest.mark.parametrize(
    ("text", "in_place"),
    [
        ("a person jumps twice", True),
        ("a person jumps on the spot three times", True),
        ("a person jumps forward twice", False),
        ("a person jumps over the fence twice", False),
        ("a person bows twice", False),
        ("a person hops on the left foot four times", True),
        ("a person hops to the left four times", False),
    ],
)
def test_counted_jumps_stay_in_place_unless_they_lead_somewhere(text: str, in_place: bool) -> None:
    for seconds in (None, 3.0, 7.0):
        strokes = [one for one in timeline_of(text, seconds, amounts=True).segments if "stands" not in one.text]
        for one in strokes:
            assert (one.goal is not None) == in_place
            if one.goal is not None:
                assert one.goal.mask[:, 0, [0, 2]].all()
                assert not one.goal.positions.any()


def test_every_key_arrives_where_it_belongs(read, tmp_path):
    io.save(Motion(SMPL22, 20.0, np.zeros((3, 3)), np.tile(IDENTITY, (3, 22, 1))), tmp_path / "clip.bvh")
    timeline = read(
        f"""
        seed: 7
        guidance: 3
        transition: 0.5
        start: clip.bvh
        path: {{path: {PATH}}}
        segments:
        - a person walks
        - text: jumps
          seconds: 2.5
          guidance: 4
          transition: 1.25
        - text: waves
          seconds: 3
          goal: {{joints: [{{joint: left_wrist, points: [{{time: 1, position: [0.3, 1.2, 0.2]}}]}}]}}
        - {{text: sits, goals: [{{path: {PATH}}}, {{joints: [{{joint: head, every_frame: [[null, 1.5, null]]}}]}}]}}
        """
    )
    assert (timeline.seed, timeline.guidance, timeline.start) == (7, 3, tmp_path / "clip.bvh")
    segments = [(s.text, s.seconds, s.guidance, s.transition) for s in timeline.segments]
    assert segments == [
        ("a person walks", 5, None, 0.5),
        ("jumps", 2.5, 4, 1.25),
        ("waves", 3, None, 0.5),
        ("sits", 5, None, 1),
    ]
    assert (timeline.frames, timeline.seconds, timeline.begins) == (310, 15.5, (0, 100, 150, 210, 310))
    assert timeline.path is not None
    assert (len(timeline.path), timeline.path.joints) == (310, ("pelvis",))
    goals = [segment.goal for segment in timeline.segments]
    assert goals[:2] == [None, None]
    assert goals[2] is not None
    assert goals[3] is not None
    assert (len(goals[2]), goals[2].joints) == (60, ("left_wrist",))
    np.testing.assert_array_equal(goals[2].positions[20, SMPL22.index("left_wrist")], [0.3, 1.2, 0.2])
    assert (len(goals[3]), goals[3].joints) == (100, ("pelvis", "head"))


@pytest.mark.parametrize(
    ("text", "transitions"),
    [
        ("segments: [a, b]", [1, 1]),
        ("segments: [{text: a, seconds: 1}, b]", [0.5, 1]),  # unless asked for it is what fits
        ("segments: [{text: a, seconds: 2}, {text: b, seconds: 0.4}]", [0.2, 0.2]),
        ("transition: 2.5\nsegments: [a, b]", [2.5, 1]),  # the last segment has nobody to share with
        ("transition: 9\nsegments: [a]", [1]),
        ("transition: 2\nsegments: [{text: a, transition: 0.1}, b, c]", [0.1, 2, 1]),
    ],
)
def test_transitions_that_nobody_asked_for_fit(read, text, transitions):
    assert [segment.transition for segment in read(text).segments] == transitions


REFUSED = [
    ("segments:\n- text: walk\n  secnds: 3", 3, "unknown key 'secnds' (did you mean 'seconds'?); a segment has text, "),
    ("seed: 1\nsegmets: [a]", 2, "unknown key 'segmets' (did you mean 'segments'?); a timeline has segments, seed"),
    ("segments: [a]\nzzz: 1", 2, "unknown key 'zzz'; a timeline has"),
    ("segments: [a]\npath:\n  curve: s\n  size: 2", 3, "write it as path: {path: {curve: ...}}"),
    ("seed: 1\n", 1, "no 'segments'"),
    ("- walk\n- jump", 1, "a timeline must be a mapping with segments, "),
    ("walk", 1, "got 'walk'"),
    ("segments: walk", 1, "'segments' must be a list with at least one segment; got 'walk'"),
    ("segments:", 1, "got nothing"),
    ("segments: []", 1, "got an empty list"),
    ("segments:\n- walk\n- 5", 3, "a segment must be a mapping with text, "),
    ("segments:\n- walk\n-", 3, "got nothing"),
    ("segments:\n- seconds: 5", 2, "a segment has no 'text'"),
    ("segments:\n- walk\n- ''", 3, "the text is empty"),
    ("segments:\n- text: ' '\n", 2, "the text is empty"),
    ("segments:\n- text: 5", 2, "the text must be words; got the number 5"),
    ("segments:\n- text: true", 2, "got true or false"),
    ("segments:\n- text:\n", 2, "got nothing"),
    ("segments:\n- text: [a]", 2, "got a list"),
    ("segments:\n- a\n- " + "x" * 2_001, 3, "2,001 characters"),
    ("segments:\n- text: a\n  seconds: 0", 3, "'seconds' must be 0.2 to 60 seconds; got 0"),
    ("segments:\n- text: a\n  seconds: -5", 3, "got -5"),
    ("segments:\n- text: a\n  seconds: 60.01", 3, "got 60.01"),
    ("segments:\n- text: a\n  seconds: five", 3, "'seconds' must be a number; got 'five'"),
    ("segments:\n- text: a\n  seconds: '5'", 3, "'seconds' must be a number; got '5'"),
    ("segments:\n- text: a\n  seconds: true", 3, "must be a number"),
    ("segments:\n- text: a\n  seconds:", 3, "got nothing"),
    ("segments:\n- text: a\n  seconds: .nan", 3, "'.nan' is not a finite number"),
    ("segments:\n- text: a\n  seconds: -.INF", 3, "not a finite number"),
    ("segments:\n- text: a\n  seconds: NaN", 3, "not a finite number"),
    ("segments:\n- text: a\n  seconds: 1e999", 3, "too large a number"),
    ("segments:\n- text: a\n  seconds: " + "1" * 5000, 3, "a number of 5000 digits"),
    ("segments:\n- text: a\n  guidance: 101", 3, "'guidance' must be -100 to 100, usually 1 to 7; got 101"),
    ("segments:\n- text: a\n  transition: 0\n- b", 3, "'transition' must be 0.05 to 30 seconds; got 0"),
    ("transition: -1\nsegments: [a]", 1, "got -1"),
    (
        "segments:\n- text: a\n  transition: 2.6\n- b",
        3,
        "takes 2.6 s and the segment of line 2 5 s; it may take at most",
    ),
    ("segments:\n- text: a\n  transition: 2\n- b\n- text: c\n  seconds: 3", None, ""),
    (
        "segments:\n- text: a\n  transition: 2\n- text: c\n  seconds: 3",
        3,
        "the segment of line 4 3 s; it may take at m",
    ),
    ("transition: 2\nsegments:\n- a\n- {text: b, seconds: 3}", 3, "at most half of that, 1.5 s"),
    ("seed: 1.5\nsegments: [a]", 1, "'seed' must be a whole number from 0 to 4,611,686,018,427,387,903; got 1.5"),
    ("seed: -1\nsegments: [a]", 1, "'seed' must be a whole number from 0 to"),
    ("seed: 4611686018427387904\nsegments: [a]", 1, "'seed' must be a whole number from 0 to"),
    ("segments: [a]\nseed: 1\nseed: 2", 3, "the key 'seed' stands here a second time"),
    ("segments:\n- text: a\n  text: b", 3, "second time"),
    ("segments: &a [b]", 1, "anchors and aliases"),
    ("seed: 1\nsegments: *a", 2, "anchors and aliases"),
    ("segments: !!python/object:os.system [a]", 1, "tags"),
    ("segments:\n- !!str a", 2, "tags"),
    ("segments:\n- ! a", 2, "tags"),
    ("<<: {seed: 1}\nsegments: [a]", 1, "unknown key '<<'"),
    ("? [a]\n: 1", 1, "a key must be one word"),
    ("segments: [a]\n---\nsegments: [b]", 2, "a second document"),
    ("segments:\n- a\n\t- b", 3, "this is not YAML"),
    ("segments: [a\nseed: 1", 2, "this is not YAML"),
    ("segments: [a]\nseed: %", 2, "this is not YAML"),
    (b"segments:\n- a\xff", 2, "not UTF-8"),
    ("segments:\n- a\x07", 2, "this is not YAML"),
    ("segments: " + "[" * 100 + "]" * 100, 1, "more than 32 deep"),
    ("start: /etc/passwd\nsegments: [a]", 1, "leads out of the folder"),
    ("segments: [a]\nstart: ../clip.bvh", 2, "leads out of the folder"),
    ("start: C:\\clip.bvh\nsegments: [a]", 1, "leads out of the folder"),
    ("start: away/clip.bvh\nsegments: [a]", 1, "a link that leads out of the folder"),
    ("start: absent.bvh\nsegments: [a]", 1, "no such file"),
    ("start: t.yaml\nsegments: [a]", 1, "'start' must name a motion"),
    ("start: 5\nsegments: [a]", 1, "'start' must be the name of a file; got 5"),
    ('start: "a\\0b"\nsegments: [a]', 1, "control character U+0000"),
    ("segments: [a]\npath: 3", 2, "'path' must be a mapping or the name of a goal file; got the number 3"),
    ("segments:\n- text: a\n  goal: [1]", 3, "'goal' must be a mapping or the name of a goal file; got a list"),
    ("segments:\n- text: a\n  goals: {}", 3, "'goals' must be a list with at least one goal"),
    ("segments:\n- text: a\n  goals: []", 3, "got an empty list"),
    ("segments:\n- text: a\n  goal: ../g.json", 3, "leads out of the folder"),
    ("segments:\n- text: a\n  goal: x\n  goals: [x]", 4, "either 'goal' or 'goals'"),
    (
        "segments:\n- text: a\n  goal:\n    joints:\n    -\n      joint: left_wirst",
        6,
        "did you mean 'left_w",
    ),
    ("segments:\n- text: a\n  goal:\n    jonts: []", 3, "did you mean 'joints'?"),
    (
        "segments:\n- text: a\n  goals:\n  - joints: [{joint: head, points: [{time: 1, position: [0, 1.5, 0]}]}]\n"
        "  - joints: [{joint: head, points: [{time: 1, position: [1, 1.5, 0]}]}]",
        5,
        "contradict",
    ),
]


@pytest.mark.parametrize(("text", "line", "message"), REFUSED, ids=[f"case{i}" for i in range(len(REFUSED))])
@pytest.mark.parametrize("loader", ["C", "Python"])
def test_what_is_wrong_is_reported_with_its_line(read, tmp_path, monkeypatch, text, line, message, loader):
    """By the quick parser and by the one that is there without a compiler."""
    if loader == "Python":
        monkeypatch.setattr(lined_yaml, "_loader", lambda: yaml.SafeLoader)
    os.symlink(tmp_path.parent, tmp_path / "away")
    (tmp_path.parent / "clip.bvh").write_text("")
    if line is None:
        assert read(text).segments
        return
    with pytest.raises(MotionloomError) as refused:
        read(text)
    sentence = str(refused.value)
    assert message in sentence
    assert sentence.startswith(f"{tmp_path / 't.yaml'}, line {line}: ")
    assert "\n" not in sentence


@pytest.mark.parametrize(
    ("text", "message"),
    [("", "is empty"), ("# nothing\n", "nothing but comments"), ("a\0b", "binary data"), ("a: 1\n" * 6_500_000, "32")],
    ids=["empty", "comments", "binary", "large"],
)
def test_what_has_no_lines_is_reported_without_one(read, text, message):
    with pytest.raises(MotionloomError, match=message):
        read(text)


def test_every_segment_is_as_much_work_as_the_one_before(read):
    def counted(segments: int) -> int:
        text = "segments:\n" + "- text: a person walks forward\n  seconds: 4.5\n  transition: 1\n" * segments
        assert len(read(text).segments) == segments
        return work(lambda: read(text))

    few = counted(200)
    assert few < 200 * 1_000
    assert counted(1_600) <= 8 * few


def test_a_hundred_thousand_segments_are_read(read):
    timeline = read("segments:\n" + "- text: a person walks forward\n  seconds: 4.5\n  transition: 1\n" * 100_000)
    assert len(timeline.segments) == 100_000


def test_more_than_anybody_needs_is_refused_while_it_is_read(read, monkeypatch):
    """On the line of the first that is too many."""
    monkeypatch.setattr(lined_yaml, "MAX_ITEMS", 200)
    with pytest.raises(MotionloomError, match="line 202: more than 200 in one list"):
        read("segments:\n" + "- a\n" * 300)
    monkeypatch.setattr(lined_yaml, "MAX_VALUES", 100)
    with pytest.raises(MotionloomError, match="line 99: the file holds more than 100 values"):
        read("segments:\n" + "- a\n" * 300)


def test_many_frames_of_goals_are_refused_before_they_are_made(read):
    with pytest.raises(MotionloomError, match=r"line 1: goals for 1,200,000 frames are too many"):
        read(f"path: {{path: {PATH}}}\nsegments:\n" + "- {text: a, seconds: 60}\n" * 1000)


WORDS = """segments: text: seconds: goal: path: start: - [ ] { } , : & * ! | > ' " # % @ ` ? ~ null .inf 1e9 0 -1 \\0
&a *a <<: --- ... !!str walk"""
ODD = st.sampled_from([*WORDS.split(), "\n", "\n\n", "\n  ", "\t", "\u2028", "\ufeff", "\x85"])


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    data=st.binary(max_size=60)
    | st.text(max_size=60).map(lambda s: s.encode("utf-8", "replace"))
    | st.lists(ODD, max_size=25).map(lambda words: " ".join(words).encode()),
    quick=st.booleans(),
)
def test_any_bytes_are_a_timeline_or_one_sentence(read, data, quick):
    sentence = ""
    before, lined_yaml._loader = lined_yaml._loader, lambda: yaml.CSafeLoader if quick else yaml.SafeLoader
    try:
        assert read(data).segments
    except MotionloomError as error:
        sentence = str(error)
    finally:
        lined_yaml._loader = before
    assert "\n" not in sentence
    assert len(sentence) < 700


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(-70, 70) | st.sampled_from(["walk", "", "5", "~", "a: b"]),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from([*WHOLE, *PART, "x"]), inner, max_size=4)
    ),
    max_leaves=8,
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=JSON)
def test_plain_values_survive(tmp_path, value):
    """What PyYAML writes is read as PyYAML would read it."""
    (tmp_path / "v.yaml").write_text(yaml.safe_dump(value))
    values = lined_yaml.read_lined(tmp_path / "v.yaml").plain()
    assert values == yaml.safe_load(yaml.safe_dump(value)) or isinstance(value, float)


# The schema ------------------------------------------------------------------------------------------------------


def test_the_schema_has_the_readers_keys():
    schema = timeline_schema()
    assert set(schema["properties"]) == set(WHOLE)
    assert set(schema["$defs"]["segment"]["anyOf"][1]["properties"]) == set(PART)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


SMALL = st.fixed_dictionaries(
    {},
    optional={
        "text": st.sampled_from(["walk", "", " ", 5, None, "x" * 2_000, "x" * 2_001, ["a"]]),
        "seconds": st.sampled_from([5, 0.2, 0.19, 60, 60.1, 0, "5", None, True]),
        "guidance": st.sampled_from([0, 2.5, 100, -100, 100.5, "a"]),
        "transition": st.sampled_from([0.05, 0.1, 0, "a", None]),
        "goal": st.sampled_from([5, None, []]),
        "goals": st.sampled_from([[], 5]),
        "x": st.just(1),
    },
)
TOP = st.fixed_dictionaries(
    {},
    optional={
        "segments": st.lists(SMALL | st.sampled_from(["walk", "", 5]), max_size=3)
        | st.just(["walk"])
        | st.sampled_from([None, 5, "walk", {}]),
        "seed": st.sampled_from([0, 5, 2**62 - 1, 2**62, -1, 1.5, "1", None, True]),
        "guidance": st.sampled_from([0, 3.5, 101, None]),
        "transition": st.sampled_from([0.05, 0.1, 0, 31, "a"]),
        "x": st.just(1),
    },
)


@settings(max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=TOP)
def test_the_schema_and_the_reader_agree(read, value):
    try:
        read(yaml.safe_dump(value, allow_unicode=True))
        accepted = True
    except MotionloomError:
        accepted = False
    assert accepted == valid(timeline_schema(), value)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_are_read_and_fit_the_schema(example):
    assert read_timeline(example).segments
    assert valid(timeline_schema(), yaml.safe_load(example.read_text()))


def test_prompts_make_the_timeline_that_a_file_of_them_makes(read):
    assert (
        plain_timeline(["a", "b"], seconds=1).segments
        == read("segments: [{text: a, seconds: 1, transition: 0.5}, {text: b, seconds: 1}]").segments
    )


def test_the_document_explains_every_key_with_an_example_that_is_read(tmp_path):
    text = (ROOT / "docs" / "compose.md").read_text()
    example = re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)[0]
    (tmp_path / "t.yaml").write_text(example)
    io.save(Motion(SMPL22, 20.0, np.zeros((3, 3)), np.tile(IDENTITY, (3, 22, 1))), tmp_path / "walk.bvh")
    (tmp_path / "zombie.safetensors").touch()
    assert read_timeline(tmp_path / "t.yaml").frames == 100 + 50 + 80 + 100
    plain = yaml.safe_load(example)
    assert set(plain) == set(WHOLE)
    assert {key for segment in plain["segments"] if isinstance(segment, dict) for key in segment} == set(
        specs(SegmentKeys)
    )
    assert valid(timeline_schema(), plain)


def test_numbers_beyond_all_bounds_are_refused_wherever_they_are(tmp_path):
    """JSON, unlike YAML here, gives whole numbers of thousands of digits, which no float holds."""
    for value in (10**400, {"segments": 10**400}, {"segments": [10**400]}, {"segments": [{"text": 10**400}]}):
        with pytest.raises(MotionloomError, match="got a number beyond all bounds"):
            timeline_from(value, folder=tmp_path)
    with pytest.raises(MotionloomError, match="has seconds a number beyond all bounds; give a number, at most"):
        Segment("a person walks", 10**400)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("a man walks up a flight of stairs", 4.0),
        ("someone goes UPSTAIRS", 4.0),
        ("down the staircase", 4.0),
        ("a person stares at a star", 4.0),
        ("a person walks forward", 5.0),
        ("jumping jacks", 5.0),
        ("a person jumps up and down", 5.0),
        ("a person jumps over a puddle", 2.5),
        ("a polite bow", 2.5),
        ("a man lies down", 6.0),
        ("a person is lying on the ground", 5.0),
        ("she turns around to face the other way", 3.0),
        ("a man stumbles and falls forward", 3.5),
        ("loses his balance and falls over", 3.5),
        ("a man trips over a stone", 3.5),
        ("he walks for three seconds", 3.0),
        ("a person sits down for 20 seconds", 20.0),
    ],
)
def test_a_sentence_without_a_length_is_as_long_as_its_action_takes_people(text: str, seconds: float) -> None:
    assert [segment.seconds for segment in timeline_of(text).segments] == [seconds]
    assert timeline_of(text, 6.0).seconds == 6.0


@pytest.mark.parametrize("text", ["a person jumps {} times", "a person takes {} steps", "a man does {} squats"])
@pytest.mark.parametrize("amounts", [True, False])
def test_numbers_beyond_all_bounds_are_some_seconds(text: str, amounts: bool) -> None:
    timeline = timeline_of(text.format("9" * 400), amounts=amounts)
    assert 1.0 < timeline.seconds <= 60.0


@pytest.mark.parametrize(
    ("text", "seconds", "parts"),
    [
        ("a man walks up the stairs", 4.0, [4.0]),
        ("a man walks up the stairs", 5.05, [2.5, 2.55]),
        ("climbing a staircase", 8.0, [2.65, 2.65, 2.7]),
        ("someone goes upstairs", 6.0, [3.0, 3.0]),
        ("she walks down the stairs", 8.0, [8.0]),
        ("he goes downstairs", 8.0, [8.0]),
        ("a man walks up", 8.0, [8.0]),
        ("a man marches in place", 4.0, [4.0]),
        ("march on the spot with high knees", 9.0, [3.0, 3.0, 3.0]),
    ],
)
def test_who_goes_up_stairs_for_long_does_so_in_parts(text: str, seconds: float, parts: list[float]) -> None:
    timeline = timeline_of(text, seconds, amounts=True)
    assert [one.seconds for one in timeline.segments] == pytest.approx(parts)
    assert {one.text for one in timeline.segments} == {text}
    assert all(one.transition <= min(parts) / 2 for one in timeline.segments)
    assert timeline.seconds == seconds
    assert parts_read(timeline) == ""
