"""Live sessions of a server: how many there are, and those whose client is gone and may come back."""

import secrets
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from motionloom.core.errors import MotionloomError, quoted
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.live.clock import Player
from motionloom.live.live import Frame, Live, motion_of
from motionloom.live.messages import Hello
from motionloom.live.pair import LivePair
from motionloom.live.settings import Settings
from motionloom.robots.body import Robot
from motionloom.robots.follow import Follower

Array = NDArray[np.float64]
MOST = 4
"""Sessions at once, those that wait for their client included."""
WAIT = 120.0
"""Seconds that a session waits for its client to come back."""


@dataclass(eq=False)
class Session:
    """One person or two who move for one client. Without a client they wait: the buffer is full, nothing is sampled."""

    key: str
    begun: Hello
    player: Player[Any]
    robots: tuple[Follower, ...] = ()
    """What follows each of the people with a robot's joints."""
    number: int = 0
    """Of the frame that is sent next."""
    pending: Frame | tuple[Frame, Frame] | None = None
    """A frame that was taken from the player and could not be sent."""
    angles: list[Array] = field(default_factory=list)
    """The robots' joint angles in that frame."""
    left: float | None = None
    """When the client was lost; None while there is one."""

    @property
    def hinges(self) -> tuple[str, ...]:
        """Names of the robot's hinges, where there is one."""
        return self.robots[0].robot.file.joint_names() if self.robots else ()

    def follow(self, frames: Frame | tuple[Frame, ...]) -> list[Array]:
        """(7 + hinges,) for each of the people: what the robots do in a frame, which comes after the one before."""
        people = (frames,) if isinstance(frames, Frame) else frames
        return [robot.pose(motion_of([one], robot.fps)) for robot, one in zip(self.robots, people, strict=True)]


@dataclass(eq=False)
class Sessions:
    """All live sessions of one server; used from any thread."""

    prior: Callable[[], Prior]
    """Gives the weights, called in the thread of the first session (it may take seconds)."""
    _: KW_ONLY
    block: Callable[[Prior], PairBlock] = lambda prior: PairBlock.load("duet", prior)
    """Gives the block for two people; `MotionloomError` where there is none for these weights."""
    most: int = MOST
    settings: Settings | None = None
    robots: Mapping[str, Robot] = field(default_factory=dict)
    """Those that a client may name."""
    _open: dict[str, Session] = field(default_factory=dict, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def begin(self, hello: Hello) -> Session:
        """A new session, or the one that ``hello`` names; `MotionloomError` where there is no room or none such."""
        with self._lock:
            self._forget()
            if hello.session:
                return self._again(hello.session)
            robots = self._followers(hello)
            if len(self._open) >= self.most and not self._make_room():
                raise MotionloomError(f"this server plays {self.most} live sessions and no more; come back later")
            hello = replace(hello, skeleton=robots[0].robot.skeleton) if robots else hello
            metre = robots[0].robot.metre if robots else 1.0
            session = Session(secrets.token_urlsafe(16), hello, self._player(hello, metre).start(), robots)
            self._open[session.key] = session
            return session

    def leave(self, session: Session) -> None:
        """The client is gone; it may come back."""
        with self._lock:
            session.left = time.monotonic()

    def end(self, session: Session) -> None:
        """The session is over."""
        with self._lock:
            self._open.pop(session.key, None)
        session.player.stop()

    def close(self) -> None:
        """End them all."""
        for session in list(self._open.values()):
            self.end(session)

    def __len__(self) -> int:
        return len(self._open)

    def _followers(self, hello: Hello) -> tuple[Follower, ...]:
        """A robot for each of the people, where ``hello`` names one."""
        if not hello.robot:
            return ()
        if hello.robot not in self.robots:
            there = ", ".join(self.robots) or "none (motionloom serve --robot MODEL)"
            raise MotionloomError(f"this server has no robot {quoted(hello.robot)}; it has {there}")
        how = {"max_speed": hello.max_speed, "avoid_collisions": bool(hello.avoid_collisions)}
        return tuple(Follower(self.robots[hello.robot], hello.fps, **how) for _ in range(hello.people))

    def _player(self, hello: Hello, metre: float) -> Player[Any]:
        prior = self.prior()
        options = {"fps": hello.fps, "skeleton": hello.skeleton, "metre": metre, "settings": self.settings}
        if hello.people == 1:
            return Player(Live(prior, seed=hello.seed, **options))
        return Player(LivePair(prior, self.block(prior), seed=hello.seed, **options))

    def _again(self, key: str) -> Session:
        session = self._open.get(key)
        if session is None:
            raise MotionloomError("there is no such live session, or not any more; begin another one")
        if session.left is None:
            raise MotionloomError("this live session has its client already; begin another one")
        session.left = None
        return session

    def _forget(self) -> None:
        """End sessions whose clients did not come back in time."""
        for left, session in self._waiting():
            if time.monotonic() - left > WAIT:
                self._open.pop(session.key).player.stop()

    def _make_room(self) -> bool:
        """End the session that has waited longest for its client, if any waits."""
        waiting = self._waiting()
        if waiting:
            self._open.pop(waiting[0][1].key).player.stop()
        return bool(waiting)

    def _waiting(self) -> list[tuple[float, Session]]:
        """Sessions without a client, and when it was lost, the longest ago first."""
        waiting = [(one.left, one) for one in self._open.values() if one.left is not None]
        return sorted(waiting, key=lambda pair: pair[0])
