"""Two people from two frozen priors and a communication block (Shafir et al. 2024, section 3.2, "ComMDM").

Both people go through the same frozen network. After some of its layers the block sees what became of the one and of
the other, and corrects the one; the roles exchanged, with the same weights, it corrects the other. A state has one slot
before the frames, whose first four numbers are the person's part of D: their relative ground pose at frame 0
(`features.pair.PlaceCode`). So D is sampled along with the motion, and whatever holds, guides or edits rows of a state
(guidance, inpainting, `observe`) does it here too.

    net(state (2 * pairs, 1 + frames, numbers), level, bound) -> the same; rows a0, b0, a1, b1, ...

The block is as published, over both manners of `PriorNet`. Over `modulated`, whose level and text are in no token, the
block gets them as one, sees normalised activations (they have no norm there), and speaks through a last layer, in
units of each token's own size.
"""

import copy

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.diffusion import Schedule
from motionloom.core.errors import MotionloomError
from motionloom.core.features.layout import ric
from motionloom.core.features.pair import along
from motionloom.core.ground import compose, relative, to_world
from motionloom.core.models.networks.pair import PLACE, SEEN
from motionloom.core.models.networks.pair import PairConfig as PairConfig
from motionloom_train.nets.prior import Bound, Condition, Inner, NetConfig, PriorNet, valid_frames
from motionloom_train.nets.prior import PublishedBlock as EncoderBlock

_SPREAD = 0.7
"""Standard deviation of the numbers of D, roughly: how far a noisy one is trusted."""
_FAR = 5.0
"""Metres beyond which the other person is shown no further away."""


def fitting(prior: NetConfig, *, layers: int = 1, split: int | None = None, aware: bool = False) -> PairConfig:
    """The settings of a new block for a prior: after its last layer, unless ``split`` is another, as wide as it.

    (Table 3 of the paper: higher layers do better, and one layer does better than two or four.)
    """
    return PairConfig(
        layers, prior.layers if split is None else split, prior.width, prior.heads, prior.hidden, aware=aware
    )


class Talk(nn.Module):
    """The communication block: the weights that are trained, and nothing else.

    Untrained it changes nothing: the correction is 0, so both priors are what they were, and the estimate of D is 0.
    """

    def __init__(self, config: PairConfig, prior: NetConfig) -> None:
        super().__init__()
        config.check(prior)
        self.config = config
        self.normed, self.shape = prior.variant == "modulated", (prior.width,)
        partner = prior.patch * (PLACE + 3 * len(SEEN)) if config.aware else 0
        sizes = NetConfig(width=config.width, heads=config.heads, hidden=config.hidden, dropout=config.dropout)
        self.places = nn.Linear(2 * PLACE, config.width)
        self.both = nn.Linear(2 * prior.width + partner, config.width)
        self.blocks = nn.ModuleList(EncoderBlock(sizes) for _ in range(config.layers))
        self.place = nn.Linear(config.width, PLACE)
        self.out = nn.Linear(config.width, prior.width) if self.normed else None
        last = self.out or self.blocks[-1].norm2  # of the published block the last norm is the last layer
        for layer in (last, self.place):
            nn.init.zeros_(layer.weight)  # type: ignore[arg-type]
            nn.init.zeros_(layer.bias)  # type: ignore[arg-type]

    def forward(
        self, tokens: Tensor, places: Tensor, mask: Tensor | None, partner: Tensor | None
    ) -> tuple[Tensor, Tensor]:
        """Activations (rows, 1 + tokens, width), condition first, and D (rows, 4): a correction, and an estimate of D.

        Rows 2k and 2k + 1 are two people. mask (rows, 1, 1, 1 + tokens): True where there is something. partner: see
        `PairNet._other_seen`.
        """
        own = F.layer_norm(tokens, self.shape) if self.normed else tokens
        together = [own, other(own)] + ([] if partner is None else [F.pad(partner, (0, 0, 1, 0))])
        start = self.places(torch.cat([places, other(places)], dim=-1))[:, None]
        x = torch.cat([start, self.both(torch.cat(together, dim=-1))], dim=1)
        mask = None if mask is None else F.pad(mask, (1, 0), value=True)
        for block in self.blocks:
            x = block(x, mask)
        change = x[:, 1:]
        if self.out is not None:  # as large as what it corrects, which grows from layer to layer there
            change = self.out(change) * tokens.std(-1, keepdim=True, correction=0)
        if self.config.adds == "condition":
            change = torch.cat([change[:, :1], torch.zeros_like(change[:, 1:])], dim=1)
        return change, self.place(x[:, 0])


def other(rows: Tensor) -> Tensor:
    """For each row that of the other person: rows 2k and 2k + 1 exchanged."""
    return rows.reshape(-1, 2, *rows.shape[1:]).flip(1).reshape(rows.shape)


def join(places: Tensor, motion: Tensor) -> Tensor:
    """D (rows, 4) and motion (rows, frames, numbers) to a state (rows, 1 + frames, numbers)."""
    return torch.cat([F.pad(places, (0, motion.shape[-1] - PLACE))[:, None], motion], dim=1)


def part(state: Tensor) -> tuple[Tensor, Tensor]:
    """D (rows, 4) and the motion (rows, frames, numbers) of a state."""
    return state[:, 0, :PLACE], state[:, 1:]


class PairNet(nn.Module):
    """Two people: a frozen prior and a block. Its parameters and its state are the block's; the prior is no part of it.

    The prior is copied, stays in evaluation mode and on its device, and gets no gradients. mean, std: (263,) of its
    features, for an ``aware`` block. ``lengths`` of a condition count frames, without the slot before them.
    """

    def __init__(self, net: PriorNet, talk: Talk, schedule: Schedule, *, mean: Tensor, std: Tensor) -> None:
        super().__init__()
        talk.config.check(net.config)
        base = copy.deepcopy(net).eval().requires_grad_(False)
        self.talk, self.schedule = talk, schedule
        self._base = (base, mean, std, torch.as_tensor(schedule.signal).to(mean))  # in a tuple: not a sub-module

    @property
    def config(self) -> NetConfig:
        """Sizes of the prior's network."""
        return self._base[0].config

    def over(self, net: PriorNet) -> "PairNet":
        """The same block over another network of these sizes, such as the prior's with adapters in it."""
        _, mean, std, _ = self._base
        return PairNet(net, self.talk, self.schedule, mean=mean, std=std).eval()

    def bind(self, cond: Condition) -> Bound:
        """See `PriorNet.bind`; a row for each person."""
        return self._base[0].bind(cond)

    def forward(self, x: Tensor, level: int | Tensor, bound: Bound) -> Tensor:
        """States (2 * pairs, 1 + frames, numbers) at ``level``, one or one per row, to the denoised estimate.

        The slot of D comes back with zeros behind its four numbers.
        """
        if x.shape[0] % 2 or x.shape[1] < 2:
            raise MotionloomError(f"two people need an even number of rows, one slot and frames; got {tuple(x.shape)}")
        base, mean, _, signals = self._base
        places, motion = part(x)
        frames = motion.shape[1]
        with torch.no_grad():
            inner = base.enter(motion, level, bound)
        signal = signals[torch.as_tensor(level, device=mean.device).expand(len(x))]
        inner, place = self.spoken(inner, bound, places, signal, valid_frames(bound.lengths, frames), frames)
        return join(place, base.leave(inner, frames))

    def spoken(
        self, inner: Inner, bound: Bound, places: Tensor, signal: Tensor, valid: Tensor | None, frames: int
    ) -> tuple[Inner, Tensor]:
        """What comes out of the last block, and the estimate of D (rows, 4).

        inner: what the first block sees. places: (rows, 4) D of the state. signal: (rows,) of the levels.
        valid: (rows, frames) or None, see `valid_frames`.
        """
        base, split = self._base[0], self.talk.config.split
        with torch.no_grad():
            inner = base.through(inner, bound, slice(split))
            aware = self.talk.config.aware
            partner = self._other_seen(inner, bound, places, signal, valid, frames) if aware else None
        first = base.modulated  # the condition is no token there
        tokens = torch.cat([inner.condition[:, None], inner.x], dim=1) if first else inner.x
        mask = F.pad(inner.mask, (1, 0), value=True) if first and inner.mask is not None else inner.mask
        change, place = self.talk(tokens, places, mask, partner)
        inner = inner._replace(x=inner.x + change[:, first:])
        return base.through(inner, bound, slice(split, None)), place

    def _other_seen(
        self, inner: Inner, bound: Bound, places: Tensor, signal: Tensor, valid: Tensor | None, frames: int
    ) -> Tensor:
        """(rows, tokens, patch * 13): where the other is, faces, and has head and wrists, as the person sees it.

        By what the two priors alone estimate and by the D of the state, trusted as far as its noise lets one; numbers
        of a person in metres, `PlaceCode` mutual.
        """
        base, mean, std, _ = self._base
        denoised = base.leave(base.through(inner, bound, slice(self.talk.config.split, None)), frames) * std + mean
        rows, signal = denoised.shape[0], signal[:, None]
        trust = signal * _SPREAD**2 / (signal**2 * _SPREAD**2 + 1 - signal**2)
        way = along(denoised)
        place = relative(way, compose(self.talk.config.places.raw(trust * places)[:, None], other(way)))
        joints = torch.stack([denoised[..., ric(j)] for j in SEEN], dim=-2)
        theirs = to_world(other(joints), place[..., None, :]).flatten(-2)
        partner = torch.cat([place, theirs], dim=-1).clamp(-_FAR, _FAR)
        partner = partner if valid is None else partner * valid[..., None]
        patch = base.config.patch
        return F.pad(partner, (0, 0, 0, -frames % patch)).reshape(rows, -1, patch * partner.shape[-1])
