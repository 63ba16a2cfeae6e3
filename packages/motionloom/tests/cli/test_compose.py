"""compose, as a stranger types it: with a quick maker of pieces in the network's place, and with a tiny network."""

import json
from pathlib import Path

import numpy as np
import pytest

from motionloom import io
from motionloom.cli import main
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.rotations import IDENTITY
from motionloom.core.skeleton import SMPL22
from motionloom.tasks import long, reattempts
from tests.cli.said import complaint

THREE = "seed: 4\nguidance: 3\nsegments:\n- walk\n- {text: jump, seconds: 2}\n- text: sit down\n  seconds: 1\n"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Each test runs in an empty folder of its own."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch) -> dict:
    """What the command asked of the maker of motion, which walks 1 m a second along +Z and stops where it is told."""
    record: dict = {"stop": None, "problem": KeyboardInterrupt}

    def compose_stream(prior, segments, *, sampling, start, path, foot_lock, progress):
        record.update(segments=segments, start=start, path=path, foot_lock=foot_lock)
        record.update(seed=sampling.seed, guidance=sampling.guidance, steps=sampling.steps)
        at = 0
        for number, segment in enumerate(segments):
            if number == record["stop"]:
                raise record["problem"]
            frames = round(segment.seconds * 20)
            root = np.zeros((frames, 3))
            root[:, 2] = np.arange(at, at + frames) / 20
            at += frames
            progress(sampling.steps)
            yield Motion(SMPL22, 20.0, root, np.tile(IDENTITY, (frames, 22, 1)))

    monkeypatch.setattr(long, "compose_stream", compose_stream)
    return record


def compose(weights: str, *words: str) -> int:
    """The command that writes what is sampled, as it is sampled."""
    return main(["compose", *words, "--literal", "--weights", weights])


def file_names() -> set[str]:
    return {path.name for path in Path().iterdir()}


def test_prompts_become_segments_of_equal_length(weights, call, capsys):
    assert compose(weights, "walk", "jump over something", "sit down", "--seconds", "2", "--out", "long.bvh") == 0
    assert [(s.text, s.seconds, s.transition, s.goal) for s in call["segments"]] == [
        (text, 2.0, 1.0, None) for text in ("walk", "jump over something", "sit down")
    ]
    assert (call["seed"], call["guidance"], call["steps"], call["foot_lock"]) == (0, 2.5, 24, True)
    assert (len(io.load("long.bvh")), file_names()) == (120, {"long.bvh"})
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "wrote long.bvh: 6.00 s, 120 frames"
    assert [line.split(maxsplit=1) for line in lines[1:]] == [
        ["0.00", "walk"],
        ["2.00", "jump over something"],
        ["4.00", "sit down"],
    ]


def test_a_timeline_says_everything_and_the_line_has_the_last_word(weights, call, capsys):
    Path("three.yaml").write_text(THREE)
    assert compose(weights, "three.yaml", "--out", "a.npz", "--json") == 0
    assert (call["seed"], call["guidance"], len(io.load("a.npz"))) == (4, 3, 160)
    about = json.loads(capsys.readouterr().out)
    assert [one["sentence"] for one in about.pop("happened")] == ["moves 7.9 m forward"]
    assert about == {
        "seconds": 8.0,
        "of": 8.0,
        "files": ["a.npz"],
        "segments": [
            {"begin": 0.0, "end": 5.0, "text": "walk"},
            {"begin": 5.0, "end": 7.0, "text": "jump"},
            {"begin": 7.0, "end": 8.0, "text": "sit down"},
        ],
        "remarks": [],
    }
    assert compose(weights, "three.yaml", "--seed", "0", "--guidance", "0", "--no-foot-lock", "--steps", "3") == 0
    assert [call[key] for key in ("seed", "guidance", "foot_lock", "steps")] == [0, 0, False, 3]


def test_several_files_at_another_rate_hold_the_whole_motion(weights, call):
    Path("three.yaml").write_text(THREE)
    names = ["a.bvh", "a.npz", "a.glb"]
    assert compose(weights, "three.yaml", "--fps", "30", *[w for n in names for w in ("--out", n)]) == 0
    for name in names:
        motion = io.load(name)
        assert (len(motion), round(motion.fps, 6)) == (239, 30)  # 159 gaps of 1/20 s hold 238 of 1/30 s
        np.testing.assert_allclose(motion.root[:, 2], np.arange(239) / 30, atol=1e-5)


def test_a_start_is_read_and_handed_on(weights, call):
    clip = Motion(SMPL22, 30.0, np.zeros((9, 3)), np.tile(IDENTITY, (9, 22, 1)))
    io.save(clip, "clip.bvh")
    Path("on.yml").write_text("start: clip.bvh\nsegments: [walk]\n")
    assert compose(weights, "on.yml") == 0
    assert (len(call["start"]), call["start"].fps) == (9, 30)


@pytest.mark.parametrize("name", ["a.bvh", "a.npz"])
def test_an_interruption_leaves_what_was_finished(weights, call, name, capsys):
    call["stop"] = 2
    Path("three.yaml").write_text(THREE)
    assert compose(weights, "three.yaml", "--out", name, "--json") == 130
    assert len(io.load(name)) == 140
    assert file_names() == {name, "three.yaml"}
    output = capsys.readouterr()
    assert output.err == f"motionloom: interrupted; what was finished is in {name}, 7.00 s of 8.00 s\n"
    assert [row["text"] for row in json.loads(output.out)["segments"]] == ["walk", "jump"]


def test_a_real_ctrl_c_between_two_pieces_is_such_an_interruption(weights, call, ctrl_c):
    assert compose(weights, "walk", "jump", "--out", "a.bvh") == 130
    assert len(io.load("a.bvh")) == 100


def test_with_nothing_finished_nothing_is_left(weights, call, capsys):
    call["stop"] = 0
    assert compose(weights, "walk", "jump", "--out", "a.bvh", "--out", "a.npz") == 130
    call["problem"] = MotionloomError("the goal is out of reach")
    assert compose(weights, "walk", "jump", "--out", "a.bvh") == 2
    assert capsys.readouterr().err == "motionloom: interrupted\nmotionloom: the goal is out of reach\n"
    assert file_names() == set()


def test_a_failure_in_between_says_where_the_finished_part_is(weights, call, capsys):
    call.update(stop=1, problem=MotionloomError("the goal is out of reach"))
    assert compose(weights, "walk", "jump", "--out", "a.bvh") == 2
    errors = capsys.readouterr().err
    assert errors == "motionloom: the goal is out of reach (what was finished is in a.bvh, 5.00 s)\n"
    assert len(io.load("a.bvh")) == 100


def test_check_reads_and_makes_nothing(weights, call, capsys):
    Path("three.yaml").write_text(THREE)
    assert main(["compose", "three.yaml", "--check", "--weights", "absent"]) == 0
    assert capsys.readouterr().out.splitlines()[0] == "3 segments, 8.00 s in all; nothing was made"
    assert main(["compose", "three.yaml", "--check", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == []
    assert file_names() == {"three.yaml"}
    assert "segments" not in call


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "there is no segment"),
        (["walk", ""], "segment 2: the text is empty"),
        (["x" * 2_001], "2,001 characters"),
        (["walk \udcff"], "segment 1: the text holds half a character"),
        (["walk", "jump \x1b[31m"], "segment 2: the text holds the control character U+001B"),
        (["/dev/zero"], "/dev/zero is a file and no words; a timeline file's name ends in .yaml"),
        (["./three.yaml.txt"], "three.yaml.txt is a file and no words"),
        (["walk", "--seconds", "0"], "0.2 to 60 seconds; got 0"),
        (["walk", "--seconds", "nan"], "got nan"),
        (["walk", "--seconds", "61"], "got 61"),
        (["walk", "jump", "--transition", "2.6"], "half of a segment, 2.5 s; got 2.6"),
        (["walk", "jump", "--transition", "0"], "got 0"),
        (["walk", "jump", "--transition", "nan"], "got nan"),
        (["three.yaml", "walk"], "either one timeline file or prompts"),
        (["three.yaml", "--seconds", "5"], "write them into three.yaml"),
        (["absent.yaml"], "cannot read absent.yaml"),
        (["bad.yaml"], "bad.yaml, line 2: unknown key 'tekst' (did you mean 'text'?)"),
        (["walk", "--seed", "-1"], "--seed"),
        (["walk", "--guidance", "nan"], "--guidance"),
        (["walk", "--fps", "0"], "--fps"),
        (["walk", "--out", "a.txt"], "must end in"),
        (["walk", "--out", "a.bvh", "--out", "./a.bvh"], "given twice"),
        (["walk"] * 13 + ["--out", "a.gif"], "write an .mp4"),
        (["long.yaml"], "at most 2,500,000 fit"),
    ],
    ids=lambda value: " ".join(value)[:25] if isinstance(value, list) else "",
)
def test_mistakes_are_one_sentence_and_nothing_is_written(weights, call, words, message, capsys):
    Path("three.yaml").write_text(THREE)
    Path("three.yaml.txt").write_text(THREE)
    Path("bad.yaml").write_text("segments:\n- tekst: walk\n")
    Path("long.yaml").write_text("segments:\n" + "- {text: walk, seconds: 60}\n" * 2100)
    before = file_names()
    assert compose(weights, *words) == 2
    assert message in complaint(capsys)
    assert (file_names(), "segments" in call) == (before, False)


def test_a_prompt_of_several_lines_is_one_line_of_the_terminal(weights, call, capsys):
    assert compose(weights, "walk \u200b\nand on", "y" * 100) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[1:] == ["     0.00  walk \\u200b and on", "     5.00  " + "y" * 77 + "..."]


def test_a_long_list_is_cut_short(weights, call, capsys):
    assert compose(weights, *["walk"] * 50, "--seconds", "0.2") == 0
    assert capsys.readouterr().out.splitlines()[-1].strip() == "... and 10 more; --json lists all"


@pytest.mark.skipif(not hasattr(long, "compose"), reason="tasks.long has no compose yet")
def test_a_tiny_network_makes_a_motion_of_exactly_the_length_asked_for(weights):
    Path("t.yaml").write_text("segments:\n- walk\n- {text: jump, seconds: 1.3}\n- {text: sit, seconds: 0.6}\n")
    assert compose(weights, "t.yaml", "--steps", "2", "--out", "a.bvh", "--out", "a.npz") == 0
    assert len(io.load("a.bvh")) == len(io.load("a.npz")) == 100 + 26 + 12
    assert compose(weights, "walk", "--seconds", "1", "--steps", "2", "--out", "one.npz") == 0
    assert len(io.load("one.npz")) == 20


def test_what_is_missing_in_a_segment_is_told_and_a_literal_motion_is_the_first(
    weights: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reattempts, "missing", lambda text, places, fps: ["a kick"] * (text == "kick"))
    words = ["compose", "walk", "kick", "--seconds", "1", "--steps", "2", "--json", "--weights", weights]
    assert main([*words, "--out", "looked.npz"]) == 0
    output, line = capsys.readouterr(), "'kick': not shown: a kick"
    assert f"motionloom: {line}\n" in output.err
    assert line in json.loads(output.out)["remarks"]
    assert main([*words, "--literal", "--out", "literal.npz"]) == 0
    output = capsys.readouterr()
    assert "attempts" not in output.err + output.out
    looked, literal = (io.load(name) for name in ("looked.npz", "literal.npz"))
    np.testing.assert_allclose(looked.root[:5, [0, 2]], literal.root[:5, [0, 2]], atol=0.05)
    assert len(looked) == len(literal) == 40


def test_a_long_timeline_is_written_as_it_is_sampled_and_an_interrupted_short_one_not_at_all(
    weights: str, call: dict, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compose_takes(*_, **__) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(long, "compose_takes", compose_takes)
    call["stop"] = 12
    words = ["--seconds", "10", "--weights", weights, "--out", "a.bvh"]
    assert main(["compose", *["walk"] * 12, *words]) == 130
    assert file_names() == set()
    assert main(["compose", *["walk"] * 13, *words]) == 130
    assert io.load("a.bvh").seconds == 120
