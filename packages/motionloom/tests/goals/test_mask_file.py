"""Mask files: what the keys mean, what is refused and on which line, and that the schema says the same."""

import json
from math import inf
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.skeleton import SMPL22
from motionloom.goals.hold import FixedPart
from motionloom.goals.mask_file import check_names, fixes_everything, read_mask
from motionloom.goals.schemas import MASK_JOINTS as JOINTS
from motionloom.goals.schemas import mask_schema
from motionloom.requests.mask import MASK, PART
from tests.schema_check import valid

EXAMPLES = sorted((Path(__file__).parents[4] / "examples" / "masks").glob("*.json"))


@pytest.fixture
def read(tmp_path):
    def reader(text: str | bytes, fps: float = 20.0):
        (tmp_path / "m.json").write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_mask(tmp_path / "m.json", fps=fps)

    return reader


@pytest.mark.parametrize("indent", [None, 2, "\t"])
def test_every_key_arrives_where_it_belongs(read, indent):
    """However the JSON is laid out; frames are those of the past's rate."""
    keys = {
        "hold": [
            {"joints": ["left_arm", "head"], "from": 0.0, "to": 1.5},
            {"joints": ["root"], "frames": [[0, 10], [20, 30]]},
            {"joints": ["torso"], "from": 1},
            {"joints": ["feet"], "to": 0.5},
            {"joints": ["neck"]},
        ]
    }
    parts = read(json.dumps(keys, indent=indent), fps=40)
    inside = [k for k in range(50) if any(a <= (k + 1) / 40 <= b for a, b in parts[1].spans)]
    assert inside == [*range(10), *range(20, 30)]  # frame 0 lies 1/40 s behind the end of the past
    assert parts == (
        FixedPart(("left_arm", "head"), ((0.0, 1.5),)),
        FixedPart(("root",), parts[1].spans),
        FixedPart(("torso",), ((1.0, inf),)),
        FixedPart(("feet",), ((0.0, 0.5),)),
        FixedPart(("neck",), ((0.0, inf),)),
    )


@pytest.mark.parametrize("fps", [24, 29.97, 30, 50, 60, 119.88, 120])
def test_neighbouring_stretches_of_frames_leave_no_gap_and_share_no_frame(read, fps):
    spans = read('{"hold": [{"joints": ["head"], "frames": [[0, 7], [7, 1000], [1000, 2000]]}]}', fps=fps)[0].spans
    counts = [sum(a <= (k + 1) / fps <= b for a, b in spans) for k in range(2100)]
    assert counts == [1] * 2000 + [0] * 100
    assert fixes_everything((FixedPart(SMPL22.names, spans),), 2000 / fps)


def test_yaml_says_the_same(read):
    assert read("hold:\n- joints: [left_arm]\n  to: 2\n") == (FixedPart(("left_arm",), ((0.0, 2.0),)),)


REFUSED = [
    ("[]", 1, "a mask must be a mapping with hold; got a list"),
    ("{}", 1, "there is no 'hold'"),
    ('{"hold": [],\n "x": 1}', 2, "unknown key 'x'; a mask has hold"),
    ('{"hold":\n []}', 2, "'hold' must be a list with at least one entry; got an empty list"),
    ('{"hold": "left_arm"}', 1, "got 'left_arm'"),
    ('{"hold": [\n"left_arm"]}', 2, "a held part must be a mapping with joints, from, to and frames; got 'left_arm'"),
    ('{"hold": [\n{"from": 0}]}', 2, "a held part has no 'joints'"),
    ('{"hold": [{\n"joint": ["head"]}]}', 2, "unknown key 'joint' (did you mean 'joints'?)"),
    ('{"hold": [{"joints":\n []}]}', 2, "'joints' must be a list with at least one entry"),
    ('{"hold": [{"joints": "head"}]}', 1, "got 'head'"),
    ('{"hold": [{"joints": [\n"left_am"]}]}', 2, "is called 'left_am' (did you mean 'left_arm'?); there are root, "),
    ('{"hold": [{"joints": ["head",\n 3]}]}', 2, "a joint is named by a word; got the number 3"),
    ('{"hold": [{"joints": ["head"],\n"from": -1}]}', 2, "'from' must be 0 to 86,400 seconds; got -1"),
    ('{"hold": [{"joints": ["head"],\n"to": "1"}]}', 2, "'to' must be a number; got '1'"),
    ('{"hold": [{"joints": ["head"],\n"to": true}]}', 2, "got true"),
    ('{"hold": [{"joints": ["head"],\n"to": NaN}]}', 2, "not a finite number"),
    ('{"hold": [{"joints": ["head"],\n"to": 86401}]}', 2, "got 86401"),
    ('{"hold": [{"joints": ["head"],\n"to": 0}]}', 2, "'to' must be after 'from', 0 s; got 0"),
    ('{"hold": [{"joints": ["head"], "from": 2,\n"to": 1}]}', 2, "'to' must be after 'from', 2 s; got 1"),
    ('{"hold": [{"joints": ["head"], "to": 2,\n"frames": [[0, 1]]}]}', 2, "either 'frames' or 'from' and 'to'"),
    ('{"hold": [{"joints": ["head"],\n"frames": [0, 1]}]}', 2, "lists pairs such as [0, 10]; got the number 0"),
    ('{"hold": [{"joints": ["head"],\n"frames": [[0, 1, 2]]}]}', 2, "lists pairs"),
    ('{"hold": [{"joints": ["head"],\n"frames": []}]}', 2, "'frames' must be a list"),
    ('{"hold": [{"joints": ["head"], "frames": [[0, 1],\n[5, 5]]}]}', 2, "frames [5, 5] end before they begin"),
    ('{"hold": [{"joints": ["head"],\n"frames": [[0, 1.5]]}]}', 2, "a whole number of 0 to 100,000,000; got the nu"),
    ('{"hold": [{"joints": ["head"],\n"frames": [[-1, 1]]}]}', 2, "a whole number"),
    ('{"hold": [{"joints": ["head"]}\n', 2, "this is not YAML"),
    ('{"hold": [{"joints": ["head"],\n"joints": ["neck"]}]}', 2, "the key 'joints' stands here a second time"),
    ('{"hold": &a [{"joints": ["head"]}]}', 1, "anchors"),
    (b'{"hold": [{"joints": ["\xff"]}]}', 1, "not UTF-8"),
]


@pytest.mark.parametrize(("text", "line", "message"), REFUSED, ids=[f"case{i}" for i in range(len(REFUSED))])
def test_what_is_wrong_is_reported_with_its_line(read, tmp_path, text, line, message):
    with pytest.raises(MotionloomError) as refused:
        read(text)
    sentence = str(refused.value)
    assert message in sentence
    assert sentence.startswith(f"{tmp_path / 'm.json'}, line ")
    assert int(sentence.removeprefix(f"{tmp_path / 'm.json'}, line ").split(":")[0]) == line
    assert "\n" not in sentence


@pytest.mark.parametrize(("text", "message"), [("", "is empty"), ("a\0b", "binary"), (" " * 4_000_001, "MB")])
def test_what_has_no_lines_is_reported_without_one(read, text, message):
    with pytest.raises(MotionloomError, match=message):
        read(text)


def test_names_on_the_line_are_checked_the_same():
    assert check_names(["left_arm", "root"]) == ("left_arm", "root")
    with pytest.raises(MotionloomError, match=r"'tail'; there are root, left_leg.*, right_wrist"):
        check_names(["head", "tail"])
    with pytest.raises(MotionloomError, match="no joint is named"):
        check_names([])


@pytest.mark.parametrize(
    ("parts", "held"),
    [
        ([FixedPart(("lower_body", "upper_body"))], True),
        ([FixedPart(("lower_body",)), FixedPart(("upper_body",))], True),
        ([FixedPart(("lower_body",)), FixedPart(("upper_body",), ((0.0, 1.0), (1.0, 2.0)))], True),
        ([FixedPart(("lower_body",)), FixedPart(("upper_body",), ((0.0, 1.0), (1.1, 2.0)))], False),
        ([FixedPart(("lower_body",)), FixedPart(("upper_body",), ((0.1, 2.0),))], False),
        ([FixedPart(("lower_body",)), FixedPart(("upper_body",), ((0.0, 1.9),))], False),
        ([FixedPart((*SMPL22.names[:-1], "root"))], False),
        ([FixedPart(SMPL22.names)], True),
        ([], False),
    ],
)
def test_only_all_joints_all_of_the_time_leave_nothing_to_predict(parts, held):
    assert fixes_everything(parts, 2.0) is held


# The schema ------------------------------------------------------------------------------------------------------


def test_the_schema_has_the_readers_keys_and_words():
    schema = mask_schema()
    assert tuple(schema["properties"]) == tuple(MASK)
    assert tuple(schema["properties"]["hold"]["items"]["properties"]) == tuple(PART)
    assert schema["properties"]["hold"]["items"]["properties"]["joints"]["items"]["enum"] == list(JOINTS)


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.stem)
def test_the_examples_are_read_and_fit(example):
    assert read_mask(example, fps=20)
    assert valid(mask_schema(), json.loads(example.read_text()))


NUMBERS = st.sampled_from([0, 1, 2, 10, 0.5, 86_400, -1, 86_401, True, None, "1"])
PARTS = st.fixed_dictionaries(
    {},
    optional={
        "joints": st.lists(st.sampled_from([*JOINTS[:3], "head", "tail", 5]), max_size=3) | st.just("head"),
        "from": NUMBERS,
        "to": NUMBERS,
        "frames": st.lists(st.lists(NUMBERS, max_size=3) | NUMBERS, max_size=2),
        "x": NUMBERS,
    },
)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=st.fixed_dictionaries({}, optional={"hold": st.lists(PARTS | NUMBERS, max_size=2), "y": NUMBERS}))
def test_what_is_read_fits_the_schema_and_what_fits_is_read(read, value):
    """But for stretches that end before they begin, about which a schema cannot speak."""
    try:
        read(json.dumps(value))
        good, sentence = True, ""
    except MotionloomError as error:
        good, sentence = False, str(error)
    assert valid(mask_schema(), value) is good or "must be after 'from'" in sentence or "before they begin" in sentence
