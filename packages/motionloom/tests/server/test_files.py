"""Files in and out: exports that read back, uploads, characters, and names that are no names."""

import json
import socket
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest

from motionloom import load
from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22
from motionloom.io import load_scene, save
from motionloom.io.character import load_character
from motionloom.io.gltf import load_glb
from motionloom.requests.export import ROOTS, Export
from motionloom.retarget.named import named_skeleton
from motionloom.server.files import export
from motionloom.server.limits import Limits
from motionloom.server.project import Project
from motionloom.server.refusal import Refusal
from motionloom.viz import page
from tests.io.rigged import Hero
from tests.io.test_bind_pose import place
from tests.server.serving import Server, decoded
from tests.viz.test_page import TEMPLATE, Reader
from tests.viz.test_video import standing


def fetched(server: Server, path: str, place: Path) -> Path:
    status, _, data = server.ask("GET", path)
    assert status == 200, data
    place.write_bytes(data)
    return place


def places(server: Server, motion: str) -> np.ndarray:
    _, motion_json = server.json("GET", f"/motions/{motion}")
    return decoded(motion_json["people"][0]["positions"], motion_json["frames"], 22, 3)


@pytest.mark.parametrize("kind", ["bvh", "glb", "npz"])
def test_an_exported_motion_reads_back_as_the_page_has_it(server: Server, walk: str, kind: str, tmp_path: Path) -> None:
    back = load(fetched(server, f"/motions/{walk}.{kind}", tmp_path / f"walk.{kind}"))
    own = [back.skeleton.index(name) for name in SMPL22.names]
    assert np.abs(back.positions()[:, own] - places(server, walk)).max() < 1e-3


def test_pictures_and_films_are_what_they_are_called(server: Server, walk: str) -> None:
    for kind, begin in (("png", b"\x89PNG"), ("mp4", b"\x00\x00\x00")):
        status, headers, data = server.ask("GET", f"/motions/{walk}.{kind}")
        assert status == 200
        assert data.startswith(begin)
        assert headers["content-type"].endswith(kind)


def test_rotations_and_root_give_the_places(server: Server, walk: str) -> None:
    _, motion_json = server.json("GET", f"/motions/{walk}")
    (person,) = motion_json["people"]
    turns = decoded(person["rotations"], motion_json["frames"], 22, 4).astype(np.float64)
    root = decoded(person["root"], motion_json["frames"], 3).astype(np.float64)
    _, about = server.json("GET", "/capabilities")
    assert about["joints"] == list(SMPL22.names)
    assert np.allclose(about["offsets"], SMPL22.offsets)
    again = Motion(SMPL22, motion_json["fps"], root, turns / np.linalg.norm(turns, axis=-1, keepdims=True))
    assert np.abs(again.positions() - places(server, walk)).max() < 1e-4


def test_a_named_skeleton_is_that_of_the_file(server: Server, walk: str, tmp_path: Path) -> None:
    back = load(fetched(server, f"/motions/{walk}.bvh?skeleton=mixamo", tmp_path / "walk.bvh"))
    assert set(named_skeleton("mixamo").names) <= set(back.skeleton.names)


def test_the_way_is_carried_by_what_is_asked(tmp_path: Path) -> None:
    """Without a server: a person who glides 1 m/s, on a skeleton with a root bone on the ground."""
    project = Project(tmp_path, Limits())
    root = np.tile(SMPL22.offsets[0], (40, 1))
    root[:, 2] += np.arange(40) / 20
    stored = project.add((Motion(SMPL22, 20, root, np.tile([1.0, 0, 0, 0], (40, 22, 1))),), {})
    ways = {}
    for mode in (*ROOTS, None):
        options = Export(motion=stored.id, format="npz", skeleton="unreal", root=mode)
        back = load(export(project, options))
        where = back.positions()[:, [back.skeleton.index(name) for name in ("root", "pelvis")]]
        ways[mode] = np.linalg.norm((where[-1] - where[0])[:, [0, 2]], axis=-1)
    assert ways["motion"].min() > 1.5
    assert ways["hips"][0] < 0.01 < 1.5 < ways["hips"][1]
    assert ways["in-place"].max() < 0.01
    with pytest.raises(Refusal, match="'root' goes with a 'skeleton'"):
        export(project, Export(motion=stored.id, format="npz", root="hips"))
    with pytest.raises(MotionloomError, match="root is 'feet'; there are motion, hips, in-place"):
        Export(motion=stored.id, root="feet")


def test_a_part_is_exported_mirrored_and_at_another_rate(server: Server, walk: str, tmp_path: Path) -> None:
    how = "start=0.5&end=1.5&fps=40&mirror=true"
    back = load(fetched(server, f"/motions/{walk}.npz?{how}", tmp_path / "part.npz"))
    whole = load(fetched(server, f"/motions/{walk}.npz", tmp_path / "whole.npz"))
    expected = whole.crop(0.5, 1.5).mirror().resample(40)
    assert back.fps == 40
    assert np.abs(back.positions() - expected.positions()).max() < 1e-6
    status, _, data = server.ask("GET", f"/motions/{walk}.npz?fps=fast")
    assert (status, b"'fps' must be a number; got 'fast'" in data) == (400, True)


def test_a_page_plays_it_with_a_character_of_ones_own_if_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a server, and with a stand-in for the viewer."""
    viewer = tmp_path / "viewer.html"
    viewer.write_text(TEMPLATE)
    monkeypatch.setattr(page, "VIEWER", viewer)
    project = Project(tmp_path / "project", Limits())
    stored = project.add((standing(20), standing(20, speed=1.0)), {"prompt": "two <people>"})
    own = project.add_character(Hero().write(project.part(".glb")), "hero.glb", ".glb")
    for skeleton, person, people in ((None, None, 2), (None, 1, 1), ("mixamo", None, 2), (own, None, 2), (own, 0, 1)):
        file = export(project, Export(motion=stored.id, format="html", skeleton=skeleton, person=person))
        content = Reader(file.read_text()).given
        [take] = content["takes"]
        assert (take["name"], len(take["people"])) == ("two <people>", people)
        assert (content["character"] is not None) == (skeleton == own)


def test_both_people_of_a_duet_are_in_one_file_or_alone(server: Server, tmp_path: Path) -> None:
    (two,) = server.draw(task="duet", prompt="two people dance", seconds=1.0, steps=2)["results"]
    both = load_scene(fetched(server, f"/motions/{two['id']}.glb", tmp_path / "two.glb"))
    second = load(fetched(server, f"/motions/{two['id']}.npz?person=1", tmp_path / "second.npz"))
    assert len(both) == 2
    assert np.abs(second.positions() - both[1].positions()[:, :22]).max() < 1e-3


def test_a_file_that_is_sent_can_be_drawn_from(server: Server, walk: str, tmp_path: Path) -> None:
    data = fetched(server, f"/motions/{walk}.bvh", tmp_path / "walk.bvh").read_bytes()
    status, sent = server.json("POST", "/motions?name=my%20walk.bvh", data)
    assert (status, sent["frames"], sent["people"], sent["fps"]) == (201, 40, 1, 20.0)
    job = server.draw(task="predict", motion=sent["id"], seconds=0.5, count=1)
    assert job["results"][0]["frames"] == 50


def test_what_a_page_was_given_it_can_send_back(server: Server, walk: str) -> None:
    _, motion_json = server.json("GET", f"/motions/{walk}")
    status, sent = server.json("POST", "/motions?name=live.json", motion_json)
    assert (status, sent["frames"], sent["people"], sent["name"]) == (201, 40, 1, "live.json")
    assert np.abs(places(server, sent["id"]) - places(server, walk)).max() < 1e-4


def test_a_character_is_given_back_and_moves(server: Server, walk: str, tmp_path: Path) -> None:
    rig = tmp_path / "hero.glb"
    body = named_skeleton("mixamo")
    still = Motion(body, 20.0, np.tile([0.0, 1.0, 0.0], (2, 1)), np.tile([1.0, 0.0, 0.0, 0.0], (2, len(body), 1)))
    save(still, rig)
    status, sent = server.json("POST", "/characters?name=hero.glb", rig.read_bytes())
    assert status == 201, sent
    assert sent["joints"]["left_knee"] == ["mixamorig:LeftLeg"]
    assert server.ask("GET", f"/characters/{sent['id']}")[2] == rig.read_bytes()
    moving = fetched(server, f"/motions/{walk}.glb?skeleton={sent['id']}", tmp_path / "moving.glb")
    assert load_character(moving).skeleton.names == load_character(rig).skeleton.names
    assert "a person walks" in load_character(moving).file.clips


def test_a_character_moves_where_it_stands(server: Server, walk: str, tmp_path: Path) -> None:
    rig = place(Hero()).write(tmp_path / "hero.glb")
    _, sent = server.json("POST", "/characters?name=hero.glb", rig.read_bytes())
    moving = load_glb(fetched(server, f"/motions/{walk}.glb?skeleton={sent['id']}", tmp_path / "moving.glb"))
    pelvis = moving.positions()[0, moving.skeleton.index("pelvis")]
    np.testing.assert_allclose(pelvis[[0, 2]], [3.0, 1.0], atol=0.01)


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("walk.exe", b"x", "ending in"),
        ("", b"x", "ending in"),
        ("walk.bvh", b"", "empty"),
        ("walk.bvh", b"HIERARCHY\nROOT", "walk.bvh has no MOTION part"),
        ("walk.npz", b"PK\x03\x04junk", "npz"),
        ("walk.glb", b"glTF" + b"\xff" * 40, "glb"),
        ("walk.amc", b":FULLY-SPECIFIED\n", "send the .asf first"),
        ("walk.vrm", b"\x00" * 100, "vrm"),
        ("live.json", b"[", "not JSON"),
        ("live.json", b'{"fps": 20}', "has no 'people'"),
        ("live.json", b'{"fps": 20, "people": [{"root": "", "rotations": "AAAA"}]}', "base64 of float32"),
    ],
)
def test_a_broken_file_is_refused_with_one_sentence(server: Server, name: str, data: bytes, sentence: str) -> None:
    status, answer = server.json("POST", f"/motions?name={name}", data)
    assert status == 400
    assert sentence in answer["error"]
    assert str(server.project) not in answer["error"]
    assert not list((server.project / "temporary").iterdir())


def test_a_character_without_a_person_in_it_is_refused(server: Server) -> None:
    status, answer = server.json("POST", "/characters?name=box.bvh", b"HIERARCHY\nROOT box\n{\nOFFSET 0 0 0\n}\n")
    assert status == 400
    assert answer["error"]


def test_joints_that_nobody_can_guess_are_named_and_kept(server: Server, walk: str, tmp_path: Path) -> None:
    """A refused character comes back with its joints; named, it moves as the same one with plain names does."""
    odd = Hero(seed=4)
    names = {node["name"]: f"part {number}" for number, node in enumerate(odd.json["nodes"][:22])}
    for node in odd.json["nodes"][:22]:
        node["name"] = names[node["name"]]
    odd.json["nodes"][19]["children"] = []  # the hand hangs elsewhere: the shape says nothing either
    odd.json["nodes"][0]["children"].append(21)
    data = odd.write(tmp_path / "odd.glb").read_bytes()
    status, refused = server.json("POST", "/characters?name=odd.glb", data)
    assert (status, "no joint was found for" in refused["error"]) == (400, True)
    assert {one["name"] for one in refused["joints"]} >= set(names.values())
    assert refused["joints"][0].keys() == {"name", "parent", "place"}
    assert set(refused["guesses"].values()) <= set(names.values())
    wrong = quote(json.dumps({"left_hip": "nobody"}))
    assert "nobody" in server.json("POST", f"/characters?name=odd.glb&joints={wrong}", data)[1]["error"]
    assert server.json("POST", "/characters?name=odd.glb&joints=5", data)[0] == 400
    joints = quote(json.dumps(names))
    status, entry = server.json("POST", f"/characters?name=odd.glb&joints={joints}", data)
    assert status == 201, entry
    assert entry["joints"]["left_knee"] == [names["left_knee"]]
    status, _, moving = server.ask("GET", f"/motions/{walk}.glb?skeleton={entry['id']}")
    assert status == 200
    (tmp_path / "moving.glb").write_bytes(moving)
    character = load_character(tmp_path / "moving.glb", joint_map=names)
    assert character.joints.names()["left_wrist"] == {names["left_wrist"]: 1.0}


@pytest.mark.parametrize(
    "path",
    [
        "/motions/../project.json",
        "/motions/..%2fproject.json",
        "/motions/%2e%2e%2fproject.json",
        "/motions/....//project.json",
        "/motions//etc/passwd",
        "/motions/%00",
        "/motions/.json",
        "/characters/..",
        "/characters/..%2f..%2fetc%2fpasswd",
        "/page/../app.py",
        "/..%2fserver%2fapp.py",
        "/motions/%c0%ae%c0%ae/x",
        "/motions/" + "a" * 3000,
    ],
)
def test_no_path_leads_out_of_the_project(server: Server, path: str) -> None:
    status, _, data = server.ask("GET", path)
    assert status in (400, 404)
    assert b"root:" not in data
    assert b"import" not in data


def test_a_name_with_folders_in_it_is_a_name_only(server: Server, walk: str, tmp_path: Path) -> None:
    data = fetched(server, f"/motions/{walk}.npz", tmp_path / "walk.npz").read_bytes()
    status, sent = server.json("POST", "/motions?name=..%2f..%2f..%2ftmp%2fevil.npz", data)
    assert (status, sent["name"]) == (201, "evil.npz")
    assert (server.project / "motions" / f"{sent['id']}.npz").is_file()


def test_exports_leave_nothing_behind_even_while_they_are_sent(server: Server, walk: str) -> None:
    with socket.create_connection(("127.0.0.1", server.port), timeout=60) as connection:
        connection.sendall(f"GET /motions/{walk}.glb HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        assert b"200" in connection.recv(20)
        assert not list((server.project / "temporary").iterdir())
    server.ask("GET", f"/motions/{walk}.png")
    status, answer = server.json("GET", f"/motions/{walk}.png?person=3")
    assert (status, "there is no person 3" in answer["error"]) == (400, True)
    assert not list((server.project / "temporary").iterdir())


def test_an_unknown_format_or_skeleton_is_refused(server: Server, walk: str) -> None:
    for path, sentence in (
        (f"/motions/{walk}.fbx", "motions are given as"),
        (f"/motions/{walk}.bvh?skeleton=x", "no such"),
    ):
        status, answer = server.json("GET", path)
        assert status == 404
        assert sentence in answer["error"]


def test_bytes_say_where_everybody_looks(server: Server, walk: str) -> None:
    _, motion_json = server.json("GET", f"/motions/{walk}")
    frames, ahead = motion_json["frames"], decoded(motion_json["people"][0]["looks"], motion_json["frames"], 3)
    status, _, data = server.ask("GET", f"/motions/{walk}?looks=true", headers={"Accept": "application/octet-stream"})
    assert status == 200
    numbers = np.frombuffer(data, "<f4")
    assert np.array_equal(numbers[: frames * 66].reshape(frames, 22, 3), places(server, walk))
    assert np.array_equal(numbers[frames * 66 :].reshape(frames, 3), ahead)
    assert np.allclose(np.linalg.norm(ahead, axis=-1), 1.0, atol=1e-6)
    way = places(server, walk)[-1, 0] - places(server, walk)[0, 0]
    assert (ahead @ (way / np.linalg.norm(way))).min() > 0.6, "who walks looks ahead"
    _, _, plain = server.ask("GET", f"/motions/{walk}", headers={"Accept": "application/octet-stream"})
    assert plain == data[: frames * 66 * 4]
