"""A live connection: what is said is checked, floods and rubbish disturb nobody, who comes back goes on."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Coroutine, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from motionloom.core.errors import MotionloomError
from motionloom.core.motion import Motion
from motionloom.core.skeleton import SMPL22, Skeleton
from motionloom.live import clock, messages, socket
from motionloom.live.commands import LONGEST_TEXT, Path, Pose, Reach, Say, Steer, from_json, person_of, to_json
from motionloom.live.sessions import Sessions
from motionloom.live.socket import live_session
from tests.live import people
from tests.live.people import QUICK
from tests.tasks.two_people import block

PATIENCE = 60.0
"""Seconds that a test waits on a machine that is very busy before it says that nothing comes."""


class Client:
    """The far end of a socket, in the same loop."""

    def __init__(self) -> None:
        self.sent: asyncio.Queue[str] = asyncio.Queue()
        self.got: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.code: int | None = None
        self.read = 0

    async def accept(self) -> None: ...

    async def receive(self) -> Mapping[str, Any]:
        text = await self.sent.get()
        self.read += 1
        return {"type": "websocket.disconnect"} if text == "GONE" else {"type": "websocket.receive", "text": text}

    async def send_text(self, data: str) -> None:
        self.got.put_nowait(json.loads(data))

    async def close(self, code: int = 1000, reason: str | None = None) -> None:
        self.code = code

    def say(self, **fields: Any) -> None:
        self.sent.put_nowait(json.dumps(fields))

    async def next(self, kind: str) -> dict[str, Any]:
        """The next message of a kind; others before it are passed over."""
        while True:
            answer = await asyncio.wait_for(self.got.get(), PATIENCE)
            if answer["type"] == kind:
                return answer

    async def frames(self, count: int) -> list[dict[str, Any]]:
        return [await self.next("frame") for _ in range(count)]


@pytest.fixture
def sessions() -> Iterator[Sessions]:
    prior = people.prior()
    pool = Sessions(lambda: prior, block=block, most=2, settings=QUICK)
    yield pool
    pool.close()


T = TypeVar("T")


def run(coroutine: Coroutine[Any, Any, T]) -> T:
    """What a coroutine returns. In a thread of its own: an open browser of other tests has this one's event loop."""
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, coroutine).result()


def talk(sessions: Sessions, *clients: Callable[[Client], Awaitable[None]]) -> list[Client]:
    """Connections one beside the other, each led by a function of its client; the clients when all are over."""

    async def one(lead: Callable[[Client], Awaitable[None]], client: Client) -> None:
        serving = asyncio.ensure_future(live_session(client, sessions))
        try:
            await lead(client)
        finally:
            client.sent.put_nowait("GONE")
            await asyncio.wait_for(serving, PATIENCE)

    async def everybody() -> list[Client]:
        there = [Client() for _ in clients]
        await asyncio.gather(*(one(lead, client) for lead, client in zip(clients, there, strict=True)))
        return there

    return run(everybody())


def test_poses_come_in_order_and_make_a_motion(sessions: Sessions) -> None:
    async def lead(client: Client) -> None:
        client.say(type="hello", seed=3, fps=60)
        hello = await client.next("welcome")
        assert (hello["joints"], hello["fps"], hello["frame"]) == (list(SMPL22.names), 60.0, 0)
        client.say(type="say", text="a person walks forward")
        frames = await client.frames(20)
        assert [frame["frame"] for frame in frames] == list(range(20))
        np.testing.assert_allclose([frame["time"] for frame in frames], np.arange(20) / 60, atol=1e-5)
        motion = Motion(SMPL22, 60, *(np.array([f[part] for f in frames]) for part in ("root", "rotations")))
        np.testing.assert_allclose(np.linalg.norm(motion.rotations, axis=-1), 1, atol=1e-4)
        client.say(type="bye")

    (client,) = talk(sessions, lead)
    assert client.code == socket.GOODBYE
    assert len(sessions) == 0


def test_what_is_recorded_is_what_was_taken_up(sessions: Sessions) -> None:
    async def lead(client: Client) -> None:
        client.say(type="hello", fps=60, seed=7)
        await client.next("welcome")
        client.say(type="steer", direction=90, speed=1.5)
        while True:
            await client.frames(1)
            client.say(type="record")
            record = await client.next("recorded")
            if record["commands"]:
                break
        (command,) = record["commands"]
        assert (command["type"], command["direction"], command["speed"]) == ("steer", 90.0, 1.5)
        assert record["seed"] == 7

    talk(sessions, lead)


def test_two_people_come_in_one_frame_and_each_is_asked_by_number(sessions: Sessions) -> None:
    async def lead(client: Client) -> None:
        client.say(type="hello", people=2, fps=60, seed=3)
        assert (await client.next("welcome"))["people"] == 2
        client.say(type="say", text="a person walks :: a person stands still")
        client.say(type="steer", direction=90, person=2)
        client.say(type="steer", speed=1.0, person=3)
        assert "1 or 2" in (await client.next("error"))["message"]
        client.say(type="say", text="a :: b :: c")
        assert "words for each person" in (await client.next("error"))["message"]
        while True:
            (frame,) = await client.frames(1)
            assert [len(one["rotations"]) for one in frame["people"]] == [22, 22]
            client.say(type="record")
            record = await client.next("recorded")
            if len(record["commands"]) == 3:
                break
        commands = {(one["person"], one["type"]): one for one in record["commands"]}
        assert commands[1, "say"]["text"] == "a person walks"
        assert commands[2, "say"]["text"] == "a person stands still"
        assert commands[2, "steer"]["direction"] == 90.0
        assert record["people"] == 2

    talk(sessions, lead)


def test_who_is_alone_has_no_second_person(sessions: Sessions) -> None:
    async def lead(client: Client) -> None:
        client.say(type="hello")
        await client.next("welcome")
        client.say(type="steer", speed=1.0, person=2)
        assert "no person 2" in (await client.next("error"))["message"]
        await client.frames(3)

    talk(sessions, lead)


def test_rubbish_is_answered_and_too_much_of_it_ends_the_connection_but_not_that_of_others(sessions: Sessions) -> None:
    over = asyncio.Event()

    async def rude(client: Client) -> None:
        client.say(type="hello")
        await client.next("welcome")
        for text in ("", "{", "[]", "null", '{"type": 3}', '{"type":"fly"}', '{"type":"say"}', "\x00", '{"a":1e999}'):
            client.sent.put_nowait(text)
            assert (await client.next("error"))["message"]
        for _ in range(60):
            client.sent.put_nowait("?")
        while not (await client.next("error")).get("last"):
            pass
        over.set()

    async def polite(client: Client) -> None:
        client.say(type="hello", fps=30)
        await client.next("welcome")
        await asyncio.wait_for(over.wait(), PATIENCE)
        await client.frames(5)

    bad, good = talk(sessions, rude, polite)
    assert (bad.code, good.code) == (socket.NOT_ALLOWED, None)


def test_a_flood_waits_outside_and_the_motion_goes_on(sessions: Sessions) -> None:
    async def lead(client: Client) -> None:
        client.say(type="hello", fps=30)
        await client.next("welcome")
        for k in range(3_000):
            client.say(type="steer", direction=k % 360, speed=1.0)
        before = client.read
        frames = await client.frames(40)
        assert [frame["frame"] for frame in frames] == list(range(40))
        assert client.read - before < 3_000, "a flood is read no faster than RATE"
        (session,) = sessions._open.values()
        assert len(session.player._inbox) <= clock.WAITING
        assert len(session.player._buffer) <= clock.LONGEST * 30 + 1

    talk(sessions, lead)


def test_who_comes_back_goes_on_where_he_was_and_others_cannot_take_his_place(sessions: Sessions) -> None:
    last: dict[str, Any] = {}

    async def first(client: Client) -> None:
        client.say(type="hello", fps=60)
        last["key"] = (await client.next("welcome"))["session"]
        last["frame"] = (await client.frames(10))[-1]["frame"]

    async def second(client: Client) -> None:
        client.say(type="hello", session=last["key"])
        hello = await client.next("welcome")
        assert (hello["session"], hello["fps"]) == (last["key"], 60.0)
        frames = await client.frames(3)
        assert frames[0]["frame"] == hello["frame"] > last["frame"]

    async def stranger(client: Client) -> None:
        client.say(type="hello", session="x" * 22)
        assert "no such" in (await client.next("error"))["message"]

    talk(sessions, first)
    talk(sessions, second, stranger)


def test_no_more_sessions_than_there_is_room_for(sessions: Sessions) -> None:
    ready, enough = [asyncio.Event(), asyncio.Event()], asyncio.Event()

    def guest(mine: asyncio.Event) -> Callable[[Client], Awaitable[None]]:
        async def lead(client: Client) -> None:
            client.say(type="hello")
            await client.next("welcome")
            mine.set()
            await asyncio.wait_for(enough.wait(), PATIENCE)

        return lead

    async def late(client: Client) -> None:
        for event in ready:
            await asyncio.wait_for(event.wait(), PATIENCE)
        client.say(type="hello")
        assert "no more" in (await client.next("error"))["message"]
        enough.set()

    *_, refused = talk(sessions, guest(ready[0]), guest(ready[1]), late)
    assert refused.code == socket.TRY_LATER


def test_who_says_nothing_or_takes_nothing_is_sent_away(sessions: Sessions, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "FIRST", 0.05)
    monkeypatch.setattr(socket, "STUCK", 0.05)

    class Stuck(Client):
        async def send_text(self, data: str) -> None:
            if json.loads(data)["type"] == "frame":
                await asyncio.sleep(PATIENCE)

    async def silent() -> Client:
        client = Client()
        await live_session(client, sessions)
        return client

    async def stuck() -> None:
        client = Stuck()
        client.say(type="hello")
        await asyncio.wait_for(live_session(client, sessions), PATIENCE)

    assert run(silent()).code == socket.NOT_ALLOWED
    run(stuck())
    assert all(session.left is not None for session in sessions._open.values())


COMMANDS = st.one_of(
    st.builds(Say, st.text(st.characters(exclude_categories=("Cc", "Cs")), max_size=LONGEST_TEXT)),
    st.builds(Steer, *(st.none() | st.floats(0, 6) for _ in range(3))),
    st.builds(Path, st.lists(st.tuples(st.floats(-99, 99), st.floats(-99, 99)), min_size=1, max_size=5).map(tuple)),
    st.builds(Reach, st.sampled_from(SMPL22.names), st.tuples(*[st.floats(0, 2)] * 3), st.floats(0.2, 9)),
    st.builds(Pose, st.lists(st.tuples(*[st.floats(0, 2)] * 3), min_size=22, max_size=22).map(tuple)),
)


@settings(max_examples=60)
@given(COMMANDS)
def test_commands_survive_json(command: Any) -> None:
    again = from_json(json.loads(json.dumps(to_json(command))))
    assert type(again) is type(command)
    if isinstance(command, Steer):
        for name in ("direction", "speed", "facing"):
            value = getattr(command, name)
            assert getattr(again, name) == (None if value is None else pytest.approx(value, abs=1e-9))
    else:
        assert again == command


JUNK = st.recursive(
    st.none() | st.booleans() | st.integers() | st.just(10**400) | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)
FIELDS = [
    "person",
    "people",
    "text",
    "direction",
    "speed",
    "facing",
    "points",
    "joint",
    "position",
    "within",
    "places",
    "seed",
    "skeleton",
]


@settings(max_examples=150)
@given(
    st.sampled_from(["say", "steer", "path", "reach", "pose", "hello", "fly"]),
    st.dictionaries(st.sampled_from(FIELDS), JUNK, max_size=4),
)
def test_whatever_a_client_says_is_a_command_or_one_sentence(kind: str, fields: dict[str, Any]) -> None:
    message = {**fields, "type": kind}
    sentence = ""
    try:
        messages.hello(message) if kind == "hello" else (from_json(message), person_of(message))
    except MotionloomError as error:
        sentence = str(error)
    assert len(sentence) < 500


@pytest.mark.parametrize(
    "wrong",
    [
        {"names": ["a"], "parents": [-1], "offsets": [[0, 0]]},
        {"names": ["a"], "parents": [-1], "offsets": [[10**400, 0, 0]]},
        {"names": ["a"], "parents": [10**400], "offsets": [[0, 0, 0]]},
        {"names": ["a"] * 400, "parents": [-1] * 400, "offsets": [[0, 0, 0]] * 400},
        {"names": ["a", "a"], "parents": [-1, 0], "offsets": [[0, 0, 0]] * 2},
        {"names": ["a", "b"], "parents": [-1, 5], "offsets": [[0, 0, 0]] * 2},
        {"names": ["a"], "parents": [True], "offsets": [[0, 0, 0]]},
        {"names": ["a"]},
        "a skeleton that nobody knows",
        7,
    ],
)
def test_a_skeleton_that_is_none_is_refused(wrong: Any) -> None:
    with pytest.raises(MotionloomError):
        messages.skeleton(wrong)


def test_poses_come_on_the_clients_skeleton(sessions: Sessions) -> None:
    mixamo = messages.skeleton("mixamo")
    own = {"names": list(mixamo.names), "parents": list(mixamo.parents), "offsets": mixamo.offsets.tolist()}

    async def lead(client: Client) -> None:
        client.say(type="hello", skeleton=own)
        hello = await client.next("welcome")
        assert hello["joints"] == own["names"]
        frames = await client.frames(4)
        turns = np.array([frame["rotations"] for frame in frames])
        root = np.array([frame["root"] for frame in frames])
        places = Motion(Skeleton(mixamo.names, mixamo.parents, mixamo.offsets), 20, root, turns).positions()
        assert places[..., 1].min() > -0.1
        assert 1.2 < places[0, :, 1].max() < 2.0

    talk(sessions, lead)
