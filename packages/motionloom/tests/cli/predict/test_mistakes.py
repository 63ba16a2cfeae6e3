"""What predict refuses, and the schema it prints."""

from pathlib import Path

import pytest

from motionloom.cli import main
from motionloom.core.files.bvh_writer import save_bvh
from motionloom.core.models.prior import save_prior
from tests.cli.predict.clips import file_names
from tests.cli.said import complaint
from tests.recorded import tiny
from tests.tasks.test_edit import person

HOLD = ["--hold", "head", "--from", "kick.bvh"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["past.bvh", "--horizon", "0"], "--seconds must be above 0 and at most 86,400 seconds; got 0"),
        (["past.bvh", "--seconds", "-1"], "got -1"),
        (["past.bvh", "--seconds", "nan"], "got nan"),
        (["past.bvh", "--seconds", "inf"], "got inf"),
        (["past.bvh", "--horizon", "86401"], "got 86401"),
        (["past.bvh", "--seconds", "0.001"], "less than a frame of past.bvh (0.0333 s)"),
        (["past.bvh", "--horizon", "86400"], "at most 2,500,000 fit"),
        (["past.bvh", "--horizon", "70", "--out", "a.glb", "--format", "gif", "--out", "f"], "write an .mp4"),
        (["past.bvh", "--count", "0"], "--count must be a whole number from 1 to 10,000"),
        (["past.bvh", "--count", "10001"], "got 10001"),
        (["past.bvh", "--seed", "-1"], "--seed must be a whole number from 0"),
        (["past.bvh", "--steps", "0"], "--steps must be a whole number from 1 to 100,000; got 0"),
        (["past.bvh", "--guidance", "nan"], "--guidance must be -100 to 100"),
        (["past.bvh", "--temperature", "2.1"], "--temperature must be 0 to 2, usually about 1; got 2.1"),
        (["past.bvh", "--temperature", "nan"], "--temperature must be 0 to 2"),
        (["past.bvh", "--end", "0.03"], "past.bvh has one frame here"),
        (["past.bvh", "--start", "9"], "cannot crop"),
        (["absent.bvh"], "absent.bvh"),
        (["nan.bvh"], "nan.bvh"),
        (["past.bvh", "--out", "past.bvh/futures"], "cannot write 'past.bvh/futures'"),
        (["past.bvh", "--out", "absent/futures"], "does not exist; make it first"),
        (["past.bvh", "--out", "absent/a.bvh"], "does not exist"),
        (["past.bvh", "--out", "taken"], "cannot write to taken: it is a file; name a folder"),
        (["past.bvh", "--out", "a.txt"], "a folder's name has no ending; got .txt"),
        (["past.bvh", "--out", "x" * 300], "cannot write"),
        (["past.bvh", "--out", "f", "--out", "./f"], "given twice"),
        (["past.bvh", "--hold", "head"], "say which one with --from MOTION"),
        (["past.bvh", "--mask", "mask.json"], "say which one with --from MOTION"),
        (["past.bvh", "--from", "kick.bvh"], "none is held; give --hold PART or --mask FILE"),
        (["past.bvh", "--hold", ",", "--from", "kick.bvh"], "no joint is named; there are root, left_leg, "),
        (["past.bvh", "--hold", "left_am", "--from", "kick.bvh"], "'left_am' (did you mean 'left_arm'?); there are"),
        (["past.bvh", "--mask", "bad.json", "--from", "kick.bvh"], "bad.json, line 2: no joint or group is called"),
        (["past.bvh", "--mask", "absent.json", "--from", "kick.bvh"], "absent.json"),
        (["past.bvh", *HOLD], "kick.bvh has 1.50 s from 0 s on, and parts are held for 2.00 s; give a longer motion"),
        (["past.bvh", *HOLD, "--seconds", "1", "--from-time", "1"], "has 0.50 s from 1 s on"),
        (["past.bvh", *HOLD, "--seconds", "1.5334"], "parts are held for 1.53 s"),  # a frame more than there is
        (["past.bvh", *HOLD, "--seconds", "1", "--from-time", "7"], "has 0.00 s from 7 s on"),
        (["past.bvh", "--mask", "late.json", "--from", "kick.bvh"], "nothing is held before 5 s"),
        (["past.bvh", *HOLD, "--hold", "lower_body,upper_body", "--seconds", "1"], "all joints are held all of the"),
        (["past.bvh", "--hold", "head", "--from", "other.bvh", "--seconds", "1"], "--skeleton past.bvh"),
        (["past.bvh", "--hold", "head", "--from", "absent.bvh"], "absent.bvh"),
        (["past.bvh", "--weights", "absent"], "no predictor 'absent'"),
        (["past.bvh", "--weights", "prior.safetensors"], "is a prior, not a predictor"),
        (["past.bvh", "--weights", "taken"], "not a whole safetensors file"),
        (["past.bvh", "--device", "abacus"], "'abacus' cannot be used"),
    ],
    ids=lambda value: " ".join(value)[:50] if isinstance(value, list) else "",
)
def test_mistakes_are_one_sentence_and_nothing_is_written(weights, call, words, message, capsys):
    Path("taken").write_text("mine")
    Path("mask.json").write_text('{"hold": [{"joints": ["head"]}]}')
    Path("bad.json").write_text('{"hold": [{"joints":\n["tail"]}]}')
    Path("late.json").write_text('{"hold": [{"joints": ["head"], "from": 5}]}')
    text = Path("past.bvh").read_text().splitlines()
    Path("nan.bvh").write_text("\n".join([*text[:-1], "nan " * len(text[-1].split())]))
    if "prior.safetensors" in words:
        save_prior(tiny.prior(), "prior.safetensors")
    if "86400" in words:
        save_bvh(person(1.0, 60.0), "past.bvh", unit=0.01)
    before = file_names()
    assert main(["predict", *words, *([] if "--weights" in words else ["--weights", weights])]) == 2
    assert message in complaint(capsys)
    assert (file_names(), "seconds" in call) == (before, False)


def test_a_predictor_is_no_prior(weights, capsys):
    assert main(["generate", "walk", "--weights", weights]) == 2
    assert "is a predictor, not a prior" in capsys.readouterr().err
