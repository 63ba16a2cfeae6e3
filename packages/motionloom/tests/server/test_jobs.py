"""Every task over HTTP with the real prior, events, cancelling, and what is refused."""

from typing import Any

import numpy as np
import pytest

from motionloom import Prior, generate
from motionloom.kinematics.capsules import overlaps
from tests.server.serving import Server, decoded

PATH = {"path": {"points": [[0, 0], [0.5, 1], [0, 2]]}}


def poses(server: Server, motion: str, person: int = 0) -> np.ndarray:
    status, motion_json = server.json("GET", f"/motions/{motion}")
    assert status == 200
    return decoded(motion_json["people"][person]["positions"], motion_json["frames"], 22, 3)


def test_a_generated_motion_is_that_of_the_library_with_the_same_seed(server: Server) -> None:
    job = server.draw(task="generate", prompt="a person jumps", seconds=2.0, seed=5, count=2, steps=6)
    assert [one["seed"] for one in job["results"]] == [5, 6]
    expected = generate(Prior.load(), "a person jumps", seconds=2.0, seed=5, count=2, steps=6)
    for one, motion in zip(job["results"], expected, strict=True):
        assert np.abs(poses(server, one["id"]) - motion.positions()).max() < 1e-3


def test_every_level_arrives_in_order_and_ends_at_the_motion(server: Server) -> None:
    job = server.submit(task="generate", prompt="a person walks", seconds=2.0, seed=2, steps=6)
    events = list(server.events(job))
    levels = [data for _, kind, data in events if kind == "level"]
    assert [data["level"] for data in levels] == [1, 2, 3, 4, 5, 6]
    assert [number for number, _, _ in events] == sorted({number for number, _, _ in events})
    last = decoded(levels[-1]["positions"], 1, 40, 22, 3)[0]
    motion = events[-1][2]["results"][0]["id"]
    assert events[-1][1] == "done"
    assert np.linalg.norm(last - poses(server, motion), axis=-1).mean() < 0.05


def test_every_third_level_arrives_where_that_is_asked_and_none_where_none_is(server: Server) -> None:
    fields = {"task": "generate", "prompt": "a person walks", "seconds": 1.0, "steps": 7}
    for levels, expected in ((3, [3, 6]), (False, [])):
        job = server.submit(**fields, levels=levels)
        assert [data["level"] for _, kind, data in server.events(job) if kind == "level"] == expected


def test_a_stream_goes_on_behind_the_event_that_was_seen_last(server: Server) -> None:
    job = server.submit(task="generate", prompt="a person walks", seconds=2.0, seed=3, steps=6)
    whole = [event for event in server.events(job) if event[1] != "progress"]  # of which only the latest is told again
    middle = whole[len(whole) // 2][0]
    again = [event for event in server.events(job, after=middle) if event[1] != "progress"]
    assert again == [event for event in whole if event[0] > middle]


def test_a_sentence_of_two_actions_is_parted_as_on_the_command_line(server: Server) -> None:
    one = server.draw(task="generate", prompt="a person walks, then jumps", seconds=4.0, steps=4)
    (line,) = one["remarks"]
    assert line.startswith("one after the other: walks ")
    assert "jumps " in line
    listed = [{"text": "a person walks", "seconds": 2.0}, {"text": "a person jumps", "seconds": 2.0}]
    assert one["results"][0]["frames"] == sum(round(20 * part["seconds"]) for part in listed)


def test_numbers_in_the_words_are_kept_and_measured_as_on_the_command_line(server: Server) -> None:
    job = server.draw(task="generate", prompt="turn left 90 degrees", seed=5, steps=6)
    (result,) = job["results"]
    expected = generate(Prior.load(), "turn left 90 degrees", seed=5, steps=6)[0]
    assert np.abs(poses(server, result["id"]) - expected.positions()).max() < 1e-3
    assert [one["read"] for one in result["measures"]["amounts"]] == ["a turn of 90 degrees to the left"]
    assert job["remarks"][0].startswith("read as: a turn of 90 degrees to the left, ")
    (did,) = result["happened"]
    assert did["turn"] == pytest.approx(result["measures"]["amounts"][0]["measured"], abs=15)
    assert "turns" in did["sentence"]
    assert "to the left" in did["sentence"]
    status, stored = server.json("GET", f"/motions/{result['id']}")
    assert (status, stored["about"]["happened"]) == (200, [did])
    literal = server.draw(task="generate", prompt="turn left 90 degrees", seed=5, steps=6, literal=True)
    assert literal["results"][0]["frames"] == 60


def test_words_that_nobody_learned_are_remarked_on(server: Server) -> None:
    foreign = "eine Person geht vorwärts"
    for fields in ({"task": "generate", "prompt": foreign, "seconds": 1.0}, {"task": "duet", "prompt": foreign}):
        job = server.draw(**fields | {"seconds": 1.0, "steps": 2})
        assert any("does not look like English" in line for line in job["remarks"])
    plain = server.draw(task="generate", prompt="a person walks", seconds=1.0, steps=2)
    assert plain["remarks"] == plain["notes"] == []


def test_remarks_name_their_words_and_sentences_that_are_known(server: Server) -> None:
    words, foreign = "vacuuming the living room", "eine Person geht vorwärts"
    timeline = {"segments": [{"text": text, "seconds": 1.0} for text in ("a person walks", words, foreign, words)]}
    job = server.draw(task="compose", timeline=timeline, steps=2)
    assert [note["text"] for note in job["notes"]] == [foreign, words]
    assert [note["line"] for note in job["notes"]] == job["remarks"]
    assert [len(note["instead"]) for note in job["notes"]] == [0, 3]
    instead = job["notes"][1]["instead"][0]
    again = server.draw(task="generate", prompt=instead, seconds=1.0, steps=2)
    assert again["notes"] == []


def test_what_happens_between_two_times_is_measured(server: Server) -> None:
    segments = [{"text": "a person walks forward", "seconds": 3.0}, {"text": "a person sits", "seconds": 2.0}]
    (result,) = server.draw(task="compose", timeline={"segments": segments})["results"]
    place = f"/motions/{result['id']}/deeds"
    status, first = server.json("GET", f"{place}?begin=0&end=3")
    assert (status, first["happened"][0]["seconds"]) == (200, 3.0)
    assert "forward" in first["happened"][0]["sentence"]
    assert server.json("GET", place) == (200, {"happened": result["happened"]})
    assert server.json("GET", f"{place}?begin=4.9&end=5") == (200, {"happened": [None]})
    for wrong in ("begin=x", "begin=3&end=2", "end=99", "begin=-1", "end=nan"):
        status, answer = server.json("GET", f"{place}?{wrong}")
        assert status == 400
        assert "from 0 to 5" in answer["error"]


def test_the_best_of_several_is_that_of_the_library(server: Server) -> None:
    job = server.draw(task="generate", prompt="a person jumps", seconds=1.0, seed=5, best_of=3, steps=6)
    (expected,) = generate(Prior.load(), "a person jumps", seconds=1.0, seed=5, best_of=3, steps=6)
    assert np.abs(poses(server, job["results"][0]["id"]) - expected.positions()).max() < 1e-3


def test_a_loop_begins_as_it_ends_and_its_last_frames_are_seen_as_no_level(server: Server) -> None:
    fields = {"task": "generate", "prompt": "a person waves", "seconds": 3.0, "seed": 3, "steps": 6}
    job = server.submit(**fields, loop=True)
    events = list(server.events(job))
    assert [data["level"] for _, kind, data in events if kind == "level"] == [1, 2, 3, 4, 5, 6]
    closed, free = (poses(server, one) for one in (_motion_of(events[-1][2]), _motion_of(server.draw(**fields))))
    assert np.abs(closed[:30] - free[:30]).max() < 1e-3
    ends = [np.linalg.norm((one[-1] - one[-1, 0]) - (one[0] - one[0, 0]), axis=-1).mean() for one in (closed, free)]
    assert ends[0] < 0.5 * ends[1]


def _motion_of(job: dict[str, Any]) -> str:
    return job["results"][0]["id"]


def test_compose_follows_the_path_of_its_timeline(server: Server) -> None:
    timeline = {"segments": [{"text": "a person walks", "seconds": 2}] * 2, "path": PATH, "seed": 4}
    job = server.draw(task="compose", timeline=timeline, steps=6)
    (result,) = job["results"]
    assert (result["seed"], result["frames"]) == (4, 80)
    assert result["measures"]["goals"]["path"]["mean_cm"] < 3
    assert np.abs(poses(server, result["id"])[-1, 0, [0, 2]] - [0, 2]).max() < 0.1


def _three(*words: str) -> dict[str, Any]:
    return {"segments": [{"text": text, "seconds": 2.0} for text in words], "seed": 4}


def test_a_changed_block_is_drawn_again_and_the_others_keep_their_frames(server: Server) -> None:
    first, other = _three("a person walks", "a person waves", "a person jumps"), "a person kicks"
    old = _motion_of(server.draw(task="compose", timeline=first, steps=6))
    changed = _three("a person walks", "a person waves", other)
    job = server.submit(task="compose", timeline=changed, steps=6, kept_from=old, levels=2)
    events = list(server.events(job))
    levels = [data for _, kind, data in events if kind == "level"]
    assert [(data["level"], data["begin"], data["frames"]) for data in levels] == [(n, 3.5, 50) for n in (2, 4, 6)]
    (result,) = events[-1][2]["results"]
    assert (result["frames"], result["measures"]["redrawn"]) == (120, [2])
    assert np.array_equal(poses(server, result["id"])[:70], poses(server, old)[:70])
    assert np.abs(poses(server, result["id"])[80:] - poses(server, old)[80:]).max() > 0.05
    again = server.draw(task="compose", timeline=changed, steps=6, kept_from=result["id"])["results"][0]
    assert again["measures"]["redrawn"] == []
    assert np.array_equal(poses(server, again["id"]), poses(server, result["id"]))


def test_where_no_block_is_the_same_all_is_drawn_as_without_an_old_motion(server: Server, walk: str) -> None:
    timeline = _three("a person walks", "a person waves")
    plain = _motion_of(server.draw(task="compose", timeline=timeline, steps=6))
    seed = _motion_of(server.draw(task="compose", timeline=timeline, steps=6, seed=5))
    for source in (walk, seed):
        (result,) = server.draw(task="compose", timeline=timeline, steps=6, kept_from=source)["results"]
        assert "redrawn" not in result["measures"]
        assert np.array_equal(poses(server, result["id"]), poses(server, plain))
    status, _ = server.json("POST", "/jobs", {"task": "compose", "timeline": timeline, "kept_from": "0" * 16})
    assert status == 404


def test_control_measures_each_goal_and_names_what_is_missed(server: Server) -> None:
    far = {"joint": "left_wrist", "points": [{"time": 1.0, "position": [0.4, 1.2, 1.0]}]}
    job = server.draw(task="control", prompt="a person walks", seconds=2.0, steps=6, goals={**PATH, "joints": [far]})
    measures = job["results"][0]["measures"]
    assert set(measures["goals"]) == {"path", "joints[0]"}
    assert measures["goals"]["joints[0]"]["worst_at"] == 1.0
    assert measures["goals"]["path"]["worst_cm"] < 10


def test_all_takes_of_a_timeline_are_seen_at_every_level(server: Server) -> None:
    segments = [{"text": "a person walks", "seconds": 1.0}, {"text": "a person jumps", "seconds": 1.0}]
    job = server.submit(task="compose", timeline={"segments": segments}, count=3, seed=5, steps=4, levels=2)
    events = list(server.events(job))
    levels = [data for _, kind, data in events if kind == "level"]
    assert [(data["level"], data["row"]) for data in levels] == [(2, 0), (2, 1), (2, 2), (4, 0), (4, 1), (4, 2)]
    results = events[-1][2]["results"]
    assert [one["seed"] for one in results] == [5, 6, 7]
    for data, one in zip(levels[3:], results, strict=True):
        last = decoded(data["positions"], 1, 40, 22, 3)[0]
        assert np.abs(last - poses(server, one["id"])).mean() < 0.05, "seen last: nearly the motion that comes of it"


def test_levels_of_a_controlled_motion_stand_in_the_world_of_its_goals(server: Server) -> None:
    goals = {"start": {"position": [3, -2], "facing": 90}, "path": {"points": [[3, -2], [5, -2]]}}
    job = server.submit(task="control", prompt="a person walks", seconds=2.0, steps=6, goals=goals)
    levels = [data for _, kind, data in server.events(job) if kind == "level"]
    last = decoded(levels[-1]["positions"], 1, 40, 22, 3)[0]
    assert np.abs(last[0, 0, [0, 2]] - [3, -2]).max() < 0.2
    assert np.abs(last[-1, 0, [0, 2]] - [5, -2]).max() < 0.4


def test_an_edit_keeps_what_is_outside_of_its_stretch(server: Server, walk: str) -> None:
    job = server.draw(task="edit", motion=walk, prompt="a person waves", between=[[0.5, 1.5]], steps=6, count=2)
    before = poses(server, walk)
    for one in job["results"]:
        after = poses(server, one["id"])
        assert np.abs(after[:10] - before[:10]).max() < 1e-5
        assert np.abs(after[12:28] - before[12:28]).max() > 0.02


def test_levels_of_an_edit_say_where_in_the_motion_they_begin(server: Server) -> None:
    (long,) = server.draw(task="generate", prompt="a person walks", seconds=9.0, steps=4)["results"]
    job = server.submit(task="edit", motion=long["id"], prompt="a person waves", between=[[6.0, 7.0]], steps=4)
    events = list(server.events(job))
    [*_, last] = [data for _, kind, data in events if kind == "level"]
    assert 0 < last["begin"] < 6.0
    first = round(last["begin"] * 20)
    last_poses = decoded(last["positions"], 1, last["frames"], 22, 3)[0]
    before = poses(server, long["id"])[first : first + 10]
    assert np.abs(last_poses[:10] - before).max() < 0.05


def test_futures_begin_with_their_past(server: Server, walk: str) -> None:
    job = server.draw(task="predict", motion=walk, seconds=1.0, count=3)
    assert [one["frames"] for one in job["results"]] == [60, 60, 60]
    for one in job["results"]:
        assert np.abs(poses(server, one["id"])[:40] - poses(server, walk)).max() < 1e-5


def test_a_switch_has_both_motions_and_what_is_between(server: Server, walk: str) -> None:
    (other,) = server.draw(task="generate", prompt="a person waves", seconds=2.0, steps=6)["results"]
    (result,) = server.draw(task="switch", motion=walk, target=other["id"], seconds=0.5)["results"]
    assert result["frames"] == 40 + 10 + 40


@pytest.mark.parametrize("blocks", [1, 2])
def test_goals_of_both_people_of_a_duet_are_kept(server: Server, blocks: int) -> None:
    """Right wrists meet at one place, in words alone and in a timeline."""
    place, seconds = np.array([0.1, 1.2, 0.38]), 4.0

    def goal(z: float, facing: float, apart: float) -> dict[str, Any]:
        at = (place + np.array([0.0, 0.0, apart])).tolist()
        path = {"points": [[0, z], [0, z]], "times": [0, seconds], "facing": [facing, facing]}
        return {"path": path, "joints": [{"joint": "right_wrist", "points": [{"time": 1.5, "position": at}]}]}

    first, second = goal(0.0, 0.0, -0.02), goal(0.75, 180.0, 0.02)
    fields: dict[str, Any] = {"prompt": "two people shake hands", "seconds": seconds, "goals": first}
    if blocks == 2:
        segments = [{"text": "two people shake hands", "seconds": seconds / 2}] * 2
        fields = {"timeline": {"segments": segments, "path": first}}
    (result,) = server.draw(task="duet", steps=8, other_goals=second, **fields)["results"]
    _, motion_json = server.json("GET", f"/motions/{result['id']}")
    wrists = [decoded(one["positions"], -1, 22, 3)[30, 21] for one in motion_json["people"]]
    assert [float(np.linalg.norm(wrist - place)) for wrist in wrists] == pytest.approx([0.02, 0.02], abs=0.05)


def test_a_duet_has_two_people_and_one_answers_somebody(server: Server, walk: str) -> None:
    (two,) = server.draw(task="duet", prompt="two people dance", seconds=2.0, steps=4)["results"]
    first, second = (poses(server, two["id"], person) for person in (0, 1))
    assert two["measures"]["overlaps"] == overlaps(first, second, 20.0)
    assert len([one["sentence"] for one in two["happened"]]) == 2
    (answer,) = server.draw(task="duet", react_to=walk, steps=4)["results"]
    assert (two["people"], answer["people"]) == (2, 2)
    assert np.abs(poses(server, answer["id"], 0) - poses(server, walk)).max() < 1e-5
    assert np.isfinite(poses(server, two["id"], 1)).all()


def test_a_job_that_is_cancelled_ends_at_the_next_network_call(server: Server) -> None:
    job = server.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=200)
    for _, kind, _ in server.events(job):
        if kind == "level":
            break
    status, answer = server.json("DELETE", f"/jobs/{job}")
    assert (status, answer["state"]) == (200, "cancelled")
    after = server.wait(server.submit(task="generate", prompt="a person walks", seconds=1.0, steps=1))
    assert after["state"] == "done"
    events = list(server.events(job))
    assert events[-1][1] == "cancelled"
    assert max(data["level"] for _, kind, data in events if kind == "level") < 100


def test_a_job_that_waits_is_cancelled_at_once(server: Server) -> None:
    long = server.submit(task="generate", prompt="a person walks", seconds=10.0, count=8, steps=200)
    other = server.submit(task="compose", timeline={"segments": ["a person walks"]})
    status, answer = server.json("DELETE", f"/jobs/{other}")
    assert (status, answer["state"], answer["results"]) == (200, "cancelled", [])
    server.json("DELETE", f"/jobs/{long}")


BROKEN: list[tuple[Any, str]] = [
    (b"{", "not JSON"),
    (b"[1]", "JSON object"),
    (b'{"task": "generate", "prompt": "a", "seconds": NaN}', "not JSON"),
    (b"\xff\xfe", "not JSON"),
    ({}, "no 'task'"),
    ({"task": "dance"}, "there are generate"),
    ({"task": "generate"}, "no 'prompt'"),
    ({"task": "generate", "prompt": "  "}, "prompt is empty"),
    ({"task": "generate", "prompt": "x" * 5000}, "characters"),
    ({"task": "generate", "prompt": ["a", "b"]}, "'prompt' must be text; got a list of 2"),
    ({"task": "generate", "prompt": "a", "seconds": 1e9}, "'seconds' must be above 0 and at most 60 seconds;"),
    ({"task": "generate", "prompt": "a", "seconds": 61}, "'seconds' must be above 0 and at most 60 seconds; got 61"),
    ({"task": "generate", "prompt": "a", "seconds": 0}, "above 0 and at most 60"),
    ({"task": "duet", "prompt": "a", "seconds": 61}, "'seconds' must be above 0 and at most 60 seconds; got 61"),
    ({"task": "generate", "prompt": "a", "count": 9}, "from 1 to 8"),
    ({"task": "generate", "prompt": "a", "count": True}, "whole number"),
    ({"task": "generate", "prompt": "a", "seed": -1}, "whole number"),
    ({"task": "generate", "prompt": "a", "steps": 10**6}, "from 1 to 200"),
    ({"task": "generate", "prompt": "a", "secnds": 1}, "did you mean 'seconds'"),
    ({"task": "compose", "timeline": {"segments": []}}, "at least one"),
    (
        {"task": "compose", "timeline": {"segments": [{"text": "a", "seconds": "x"}]}},
        "the timeline, segments[0].seconds: 'seconds' must be a number",
    ),
    (
        {"task": "compose", "timeline": {"segments": ["a"], "start": "../../etc/passwd"}},
        "leads out of the project folder;",
    ),
    ({"task": "compose", "timeline": {"segments": [{"text": "a", "seconds": 60}] * 20}}, "at most 600"),
    ({"task": "control", "prompt": "a", "goals": {}}, "asks for nothing"),
    ({"task": "control", "prompt": "a", "goals": {"path": {"svg": "/etc/passwd"}}}, "leads out of the project folder;"),
    ({"task": "control", "prompt": "a", "goals": {"joints": [{"joint": "tail", "points": []}]}}, "tail"),
    ({"task": "edit", "motion": "../../../etc/passwd"}, "no such motion"),
    ({"task": "edit", "motion": "0" * 16}, "there is no motion"),
    ({"task": "duet", "prompt": "a", "react_to": "0" * 16, "past": "0" * 16}, "different duets"),
    ({"task": "duet", "prompt": "a", "other_goals": {}}, "'other_goals' go with words or a timeline, and with goals"),
]


@pytest.mark.parametrize(("body", "sentence"), BROKEN)
def test_what_cannot_be_asked_is_answered_with_one_sentence(server: Server, body: Any, sentence: str) -> None:
    status, answer = server.json("POST", "/jobs", body)
    assert status in (400, 404)
    assert sentence in answer["error"]
    assert str(server.project) not in answer["error"]


def test_what_only_the_library_can_refuse_fails_the_job_with_its_sentence(server: Server, walk: str) -> None:
    job = server.submit(task="edit", motion=walk, between=[[1.0, 30.0]], prompt="a person waves")
    job_json = server.wait(job)
    assert (job_json["state"], job_json["status"]) == ("failed", 400)
    assert "no stretch from 1 to 30 s" in job_json["error"]


def test_an_unknown_job_is_404(server: Server) -> None:
    for method, path in (("GET", "/jobs/nothing"), ("DELETE", "/jobs/nothing"), ("GET", "/jobs/nothing/events")):
        status, answer = server.json(method, path)
        assert status == 404
        assert "no such job" in answer["error"]


def test_words_of_a_head_are_done_without_a_remark(server: Server, walk: str) -> None:
    fields = {"task": "edit", "motion": walk, "keep": ["lower_body", "torso", "left_arm", "right_arm"]}
    job = server.draw(**fields, prompt="nods twice")
    assert job["remarks"] == []
    first, second = (
        decoded(server.json("GET", f"/motions/{one}")[1]["people"][0]["looks"], 40, 3)
        for one in (walk, job["results"][0]["id"])
    )
    assert 0.2 < (first - second)[:, 1].max() < 0.5
    refused = server.wait(server.submit(**fields, prompt="kicks"))
    assert (refused["state"], refused["error"].split(";")[0]) == (
        "failed",
        "a head nods, shakes, looks left, right, up or down, and looks around",
    )
