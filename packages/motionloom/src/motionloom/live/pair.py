"""`LivePair`: two people who move without end in one world, and commands to either change what comes.

Both are sampled together by one frozen prior and the block for two people (`tasks.pair`): each window
knows the last half second of both and their relative pose. Their bodies follow as one person's does.
"""

from collections.abc import Sequence

import numpy as np

from motionloom.core.diffusion import row_seed
from motionloom.core.features.layout import FPS
from motionloom.core.features.pair import PairMotion
from motionloom.core.ground import GroundPose, relative
from motionloom.core.models.pair import PairBlock
from motionloom.core.models.prior import Prior
from motionloom.core.motion import Motion
from motionloom.core.skeleton import Skeleton
from motionloom.edits.steering import Correction
from motionloom.goals.roles import prompts_of
from motionloom.live.commands import Command, Say
from motionloom.live.live import Frame, Stage, check
from motionloom.live.person import Person, Request
from motionloom.live.settings import Settings
from motionloom.live.window import leaving
from motionloom.tasks.pair import PairEdits, PairSampling, pair_features
from motionloom.tasks.people import Duet, known_state


class LivePair(Stage[tuple[Frame, Frame]]):
    """Two people who move without end.

    pair = LivePair(prior, PairBlock.load("duet", prior), seed=1)
    pair.say("two people shake hands")
    pair.people[0].steer(speed=0.0)
    for first, second in pair:
        ...

    Commands for one of them go to `people[0]` or `people[1]`, as to a `Live`.
    """

    def __init__(
        self,
        prior: Prior,
        block: PairBlock,
        *,
        seed: int = 0,
        fps: float = FPS,
        start: Duet | None = None,
        skeleton: Skeleton | None = None,
        metre: float = 1.0,
        settings: Settings | None = None,
    ) -> None:
        """block: weights for two people with this prior. start: what both did before, in one world; without it
        the first person begins at the origin facing +Z and the words say where the second stands. skeleton: both are
        shown on it. Otherwise as `Live`.
        The solver and how the levels are spread are those of every duet. Raises `MotionloomError` for what cannot be.
        """
        check(prior, seed)
        chosen = settings or Settings()
        pasts: tuple[Motion | None, Motion | None] = start or (None, None)
        people = [Person(prior, chosen, start=past, skeleton=skeleton, metre=metre) for past in pasts]
        super().__init__(people, chosen, fps)
        self._prior, self._net, self._seed, self._calls = prior, block.net(prior), seed, 0

    def say(self, text: str) -> None:
        """What both do from now on, or what each does: "A :: B"."""
        self.ask(Say(text))

    def addressed(self, command: Command, person: int | None = None) -> list[tuple[Command, int]]:
        """As of `Stage`; words for everybody may have a part for each, "A :: B"."""
        if isinstance(command, Say) and person is None and command.text:
            first, second = prompts_of(command.text)
            return [(Say(first), 0), (Say(second), 1)]
        return super().addressed(command, person)

    @property
    def calls(self) -> int:
        """Guided calls of the network so far."""
        return self._calls

    def __next__(self) -> tuple[Frame, Frame]:
        first, second = self.frames()
        return first, second

    def _windows(self, requests: Sequence[Request]) -> None:
        count, frames, prior = len(requests[0].known), self.settings.ahead, self._prior
        known = np.stack([request.known.features for request in requests]).astype(np.float32)
        changes: list[Correction | None] = [None, None]
        observed = None
        if count:
            begins = np.stack([request.known.begin.numbers() for request in requests])
            observed = known_state(
                self._net, PairMotion.stack([PairMotion(known, relative(begins[0], begins))]), count + frames
            )
        for i, request in enumerate(requests):
            if count or request.edits or request.turns:
                changes[i] = leaving(prior, known[i], frames, edits=request.edits, turns=request.turns)
        frozen = [bool(request.edits or request.turns) for request in requests]
        sampled = pair_features(
            prior,
            self._net,
            [request.words for request in requests],
            count + frames,
            seeds=[row_seed(self._seed, i, self._next) for i in (0, 1)],
            edits=PairEdits(observed, changes, frozen=frozen),
            sampling=PairSampling(guidance=self.settings.guidance, steps=self.settings.steps),
        )
        self._calls += self.settings.steps
        features = sampled.features[0].astype(np.float64)
        for i, (person, request) in enumerate(zip(self.people, requests, strict=True)):
            window = np.concatenate([request.known.features, features[i, count:]])
            begin = None if count else GroundPose.of_numbers(sampled.poses[0, i])
            person.accept(request, window, self._next, begin)
