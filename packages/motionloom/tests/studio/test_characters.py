"""Characters and motions of others: dropped, on the stage, and exported."""

import json
import struct
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from motionloom import load
from motionloom.io.character import load_character
from tests.io.rigged import Hero
from tests.shared import shared
from tests.studio.studio import Studio

SIDES = """{0}hipjoint root {1}0.6 -0.8 0.1 2|{0}femur {0}hipjoint {1}0.34 -0.94 0 7|{0}tibia {0}femur {1}0.34 -0.94 0 7
{0}foot {0}tibia 0 -0.3 1 2|{0}toes {0}foot 0 0 1 1|{0}clavicle thorax {1}1 0.2 0 3.5|{0}humerus {0}clavicle {1}1 0 0 5
{0}radius {0}humerus {1}1 0 0 3.5|{0}wrist {0}radius {1}1 0 0 1.5|{0}hand {0}wrist {1}1 0 0 0.7"""
MIDDLE = """lowerback root 0 1 0 2|upperback lowerback 0 1 0 2|thorax upperback 0 1 0 2|lowerneck thorax 0 1 0 1.5
upperneck lowerneck 0 1 0 1.5|head upperneck 0 1 0 1.6"""


def skeleton() -> str:
    """An ASF of a standing person with the names of the CMU recordings."""
    rows = "\n".join([MIDDLE, SIDES.format("l", ""), SIDES.format("r", "-")]).replace("|", "\n").split("\n")
    bones = [(name, parent, direction) for name, parent, *direction in (row.split() for row in rows)]
    head = ":version 1.10|:name person|:units|  mass 1.0|  length 0.45|  angle deg|:root|  order TX TY TZ RX RY RZ"
    text = [*f"{head}|  axis XYZ|  position 0 0 0|  orientation 0 0 0|:bonedata".split("|")]
    for number, (name, _, (x, y, z, size)) in enumerate(bones, start=1):
        x, y, z = np.array([x, y, z], float) / np.linalg.norm(np.array([x, y, z], float))
        text += [
            "  begin",
            f"    id {number}",
            f"    name {name}",
            f"    direction {x:.6f} {y:.6f} {z:.6f}",
            f"    length {size}",
            "    axis 0 0 0 XYZ",
            "    dof rx ry rz",
            "  end",
        ]
    text += [":hierarchy", "  begin"]
    for parent in dict.fromkeys(parent for _, parent, _ in bones):
        text.append(f"    {parent} {' '.join(name for name, above, _ in bones if above == parent)}")
    return "\n".join([*text, "  end", ""])


def recording(frames: int = 120) -> str:
    """An AMC of 120 frames a second: the person sways to and fro."""
    rows = [":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(frames):
        rows += [str(frame + 1), f"root 0 17 {frame / 60:.4f} 0 0 0", f"lowerback {10 * np.sin(frame / 20):.4f} 0 0"]
    return "\n".join([*rows, ""])


def as_vrm(hero: Hero) -> Hero:
    """The same file as VRM 1 says whose bones are whose."""
    names = {
        "pelvis": "hips",
        "spine1": "spine",
        "spine2": "chest",
        "spine3": "upperChest",
        "neck": "neck",
        "head": "head",
    }
    sides = {
        "hip": "UpperLeg",
        "knee": "LowerLeg",
        "ankle": "Foot",
        "foot": "Toes",
        "collar": "Shoulder",
        "shoulder": "UpperArm",
        "elbow": "LowerArm",
        "wrist": "Hand",
    }
    names |= {f"{side}_{part}": f"{side}{bone}" for side in ("left", "right") for part, bone in sides.items()}
    bones = {names[node["name"]]: {"node": n} for n, node in enumerate(hero.json["nodes"]) if node["name"] in names}
    hero.json["extensions"] = {"VRMC_vrm": {"specVersion": "1.0", "humanoid": {"humanBones": bones}}}
    hero.json["extensionsUsed"] = ["VRMC_vrm"]
    return hero


def test_own_characters_are_on_the_stage_and_in_the_exports(studio: Studio, tmp_path: Path):
    mannequin = studio.picture()
    for file in (Hero().write(tmp_path / "hero.glb"), as_vrm(Hero(seed=3)).write(tmp_path / "hero.vrm")):
        studio.drop(file)
        studio.page.wait_for_selector(f"#inspector b:text-is('{file.name}')")
        studio.page.wait_for_selector("#canvas[data-character]")
        assert (np.abs(studio.picture() - mannequin).max(axis=-1) > 30).mean() > 0.003, "the stage shows the mannequin"
        moving = tmp_path / f"moving{file.suffix}"
        moving.write_bytes(studio.export("GLB"))
        assert load_character(moving).skeleton.names == load_character(file).skeleton.names
        assert abs(load(moving).seconds - 2.0) < 0.11
        studio.key("Control+z")
    assert studio.project()["character"] is None
    assert not studio.faults


def drawn_by_draco(hero: Hero) -> Hero:
    """The same mesh as a Draco bitstream (2.2, sequential, its numbers as they are), and nowhere else in the file."""
    (primitive,) = hero.json["meshes"][0]["primitives"]
    accessors, views = hero.json["accessors"], hero.json["bufferViews"]

    def taken(number: int) -> bytes:
        view = views[accessors[number].pop("bufferView")]
        found = bytes(hero.data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        hero.data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] = bytes(view["byteLength"])
        return found

    def varint(number: int) -> bytes:
        low, rest = number & 127, number >> 7
        return bytes([low | 128]) + varint(rest) if rest else bytes([low])

    names = {"POSITION": (0, 9, 3), "JOINTS_0": (4, 2, 4), "WEIGHTS_0": (4, 9, 4)}  # kind, type of number, width
    corners = accessors[primitive["attributes"]["POSITION"]]["count"]
    faces = np.frombuffer(taken(primitive["indices"]), "<u2")
    data = b"DRACO" + bytes([2, 2, 1, 0, 0, 0]) + varint(len(faces) // 3) + varint(corners) + b"\1"
    data += faces.astype("<u1" if corners < 256 else "<u2").tobytes() + b"\1" + varint(len(names))
    data += b"".join(bytes([*about, 0]) + varint(number) for number, about in enumerate(names.values()))
    data += bytes(len(names)) + b"".join(taken(primitive["attributes"][name]) for name in names)
    packed = hero.add(np.frombuffer(data, np.uint8), 5121, "SCALAR")
    view = accessors.pop(packed)["bufferView"]
    attributes = {name: number for number, name in enumerate(names)}
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": attributes}}
    hero.json["extensionsUsed"] = hero.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return hero


def test_a_character_packed_by_draco_is_on_the_stage(studio: Studio, tmp_path: Path):
    mannequin = studio.picture()
    pictures = []
    for hero in (Hero(seed=7), drawn_by_draco(Hero(seed=7))):
        file = hero.write(tmp_path / "hero.glb")
        studio.drop(file)
        studio.page.wait_for_selector("#canvas[data-character], .notice[role=alert]")
        assert studio.page.locator(".notice[role=alert]").count() == 0
        pictures.append(studio.picture())
        studio.key("Control+z")
    plain, packed = pictures
    assert (np.abs(packed - mannequin).max(axis=-1) > 30).mean() > 0.003, "the stage shows the mannequin"
    assert (np.abs(packed - plain).max(axis=-1) > 30).mean() < 0.002, "it looks as the plain file does"
    assert not studio.faults


def test_a_refused_character_is_used_once_its_joints_are_named(studio: Studio, tmp_path: Path):
    """Its names say nothing and a hand hangs at the hip: a dialog asks, with guesses, and the answer stays."""
    page, hero = studio.page, Hero(seed=4)
    names = {node["name"]: f"part {number}" for number, node in enumerate(hero.json["nodes"][:22])}
    for node in hero.json["nodes"][:22]:
        node["name"] = names[node["name"]]
    hero.json["nodes"][19]["children"] = []
    hero.json["nodes"][0]["children"].append(21)
    studio.drop(hero.write(tmp_path / "odd.glb"))
    page.wait_for_selector("#joints[open]")
    assert page.locator("#joints .part").count() == 22
    assert page.locator("#joints .part.missing").count() > 0
    page.get_by_role("button", name="Use these joints").click()
    studio.says(page.locator("#joints [role=alert]"), "no joint was found for")
    pixels = "document.querySelector('#joints canvas').toDataURL()"
    before = page.evaluate(pixels)
    studio.until(f"{pixels} !== {json.dumps(before)}")  # it turns
    for part, name in names.items():
        page.locator(f"#joints .part[data-key={part}] select").select_option(name)
    assert page.locator("#joints .part.missing").count() == 0
    page.get_by_role("button", name="Use these joints").click()
    page.wait_for_selector("#joints", state="hidden")
    page.wait_for_selector("#canvas[data-character]")
    moving = tmp_path / "moving.glb"
    moving.write_bytes(studio.export("GLB"))
    assert load_character(moving, joint_map=names).joints.names()["left_wrist"] == {names["left_wrist"]: 1.0}
    studio.load()
    page.wait_for_selector("#canvas[data-character]")
    studio.key("Control+z")
    assert not studio.faults


def test_pictures_that_nothing_unpacks_are_refused_in_a_sentence(studio: Studio, tmp_path: Path):
    hero = Hero(seed=2)
    hero.json["extensionsUsed"] = ["KHR_texture_basisu"]
    studio.drop(hero.write(tmp_path / "hero.glb"))
    said = studio.page.locator(".notice[role=alert]")
    studio.says(said, "hero.glb cannot be shown: its pictures are packed (KHR_texture_basisu)")
    studio.key("Control+z", "Escape")
    hero = Hero(seed=2)
    (primitive,) = hero.json["meshes"][0]["primitives"]
    primitive["mode"] = 77
    studio.drop(hero.write(tmp_path / "odd.glb"))
    studio.says(said, "odd.glb cannot be shown")
    assert "THREE" not in said.inner_text()
    studio.key("Control+z")


class Listener(BaseHTTPRequestHandler):
    """Somebody else's server, who wants to know when a character is looked at."""

    asked: ClassVar[list[str]] = []

    def do_GET(self) -> None:
        self.asked.append(self.path)
        self.send_error(404)

    def log_message(self, *_: object) -> None:
        """Nothing is printed."""


def test_a_picture_that_a_character_names_elsewhere_is_asked_for_by_nobody(studio: Studio, tmp_path: Path):
    listener = ThreadingHTTPServer(("127.0.0.1", 0), Listener)
    threading.Thread(target=listener.serve_forever, daemon=True).start()
    hero = Hero(seed=5)
    hero.json["images"] = [{"uri": f"http://127.0.0.1:{listener.server_port}/seen.png"}]
    hero.json["textures"] = [{"source": 0}]
    hero.json["materials"] = [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]
    (primitive,) = hero.json["meshes"][0]["primitives"]
    corners = hero.json["accessors"][primitive["attributes"]["POSITION"]]["count"]
    primitive["attributes"]["TEXCOORD_0"] = hero.add(np.zeros((corners, 2)), 5126, "VEC2")
    primitive["material"] = 0
    try:
        studio.drop(hero.write(tmp_path / "spy.glb"))
        studio.page.wait_for_selector("#canvas[data-character]")
        exported = studio.export("GLB")
        studio.picture()
    finally:
        listener.shutdown()
        listener.server_close()
    assert b"/seen.png" in exported, "the character's own file comes back as it was"
    assert not Listener.asked
    studio.key("Control+z")
    assert not studio.faults


def test_films_and_sheets_are_written_by_mouse(studio: Studio):
    assert studio.export("PNG").startswith(b"\x89PNG")
    film = studio.export("MP4")
    assert film[4:8] == b"ftyp"
    assert len(film) > 5000


def test_a_skeleton_and_its_recording_become_a_clip(studio: Studio, tmp_path: Path):
    (tmp_path / "sway.asf").write_text(skeleton())
    (tmp_path / "sway.amc").write_text(recording())
    studio.drop(tmp_path / "sway.amc", tmp_path / "sway.asf")
    studio.page.wait_for_selector(".clip, .notice[role=alert]")
    [clip] = studio.project()["clips"]
    assert (clip["name"], clip["seconds"]) == ("sway.amc", 1.0)


def test_other_peoples_characters_are_on_the_stage(studio: Studio):
    for name in ("vrm1_example.vrm", "gdbot.glb", "vroid.vrm"):
        studio.drop(shared(f"rigs/{name}"))
        studio.page.wait_for_selector(f"#inspector b:text-is('{name}')")
        studio.page.wait_for_selector("#canvas[data-character], .notice[role=alert]")
        assert studio.page.locator(".notice[role=alert]").count() == 0
        data = studio.export("GLB")
        (length,) = struct.unpack_from("<I", data, 12)
        assert json.loads(data[20 : 20 + length])["skins"]
        studio.key("Control+z")
    assert not studio.faults


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("m2m_fox.glb", "there is a body in it, but no skeleton"),
        ("rpm_walk.glb", "There is no body in rpm_walk.glb"),
    ],
)
def test_what_a_file_lacks_is_told(studio: Studio, name: str, sentence: str):
    studio.drop(shared(f"rigs/{name}"))
    studio.says(studio.page.locator(".notice[role=alert]"), sentence)
    assert studio.page.locator("#joints[open]").count() == 0


def test_a_body_in_pieces_with_too_few_joints_is_asked_about(studio: Studio):
    studio.drop(shared("rigs/kenney.glb"))
    studio.page.wait_for_selector("#joints[open]")
    studio.says(studio.page.locator("#joints .unmet"), "It has 7 joints")
    studio.key("Escape")
