"""The prior's network: a transformer over frames that estimates the clean motion (x0). One code, two variants.

`published`: the MDM encoder (Tevet et al. 2023, "Human Motion Diffusion Model"; also the network of Shafir et al.
2024): one condition token (noise level + pooled text) before one token per frame, post-norm blocks. Published
checkpoints load.

`modulated`: the default. Several frames make one token; text is attended word by word, because pooled sentence vectors
of "turn left" and "turn right" nearly coincide; the noise level and the pooled text shift and scale every block
(adaptive layer norm after Peebles & Xie 2023, with one shared projection as in Chen et al. 2024).

Both: ``net(state, level, bound)`` with ``bound = net.bind(condition)`` computed once per sample, before the loop, so
that everything that depends on the text alone (projections, keys, values) is computed once.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.sizes import NetConfig as NetConfig


class Condition(NamedTuple):
    """What a motion should be, one entry per row. Zeros in place of a text mean: no text."""

    pooled: Tensor
    """(rows, text) one vector per text."""
    tokens: Tensor
    """(rows, words, text) one vector per word piece; (rows, 0, text) where the network reads none."""
    words: Tensor
    """(rows, words) bool: True where there is a word piece."""
    lengths: Tensor
    """(rows,) valid frames; frames behind them are padding that nothing attends to. -1: all frames are valid."""
    flags: Tensor
    """(rows, frames) integers 0 or 1: transition flags; (rows, 0) for networks without them."""

    def null(self) -> "Condition":
        """The same rows without their text."""
        words = torch.zeros_like(self.words)
        words[:, :1] = True
        return self._replace(pooled=torch.zeros_like(self.pooled), tokens=torch.zeros_like(self.tokens), words=words)

    def choose(self, keep: Tensor) -> "Condition":
        """Text where ``keep`` (rows,) is True, none elsewhere: condition dropout in training."""
        null = self.null()
        return self._replace(
            pooled=torch.where(keep[:, None], self.pooled, null.pooled),
            tokens=torch.where(keep[:, None, None], self.tokens, null.tokens),
            words=torch.where(keep[:, None], self.words, null.words),
        )


def condition(
    pooled: Tensor,
    *,
    tokens: Tensor | None = None,
    words: Tensor | None = None,
    lengths: Tensor | Sequence[int] | None = None,
    flags: Tensor | None = None,
) -> Condition:
    """A `Condition` with the parts that are not given left empty."""
    rows, width = pooled.shape
    device = pooled.device
    tokens = pooled.new_zeros(rows, 0, width) if tokens is None else tokens
    words = torch.ones(tokens.shape[:2], dtype=torch.bool, device=device) if words is None else words
    valid = torch.full((rows,), -1, device=device) if lengths is None else torch.as_tensor(lengths, device=device)
    flags = torch.zeros(rows, 0, dtype=torch.long, device=device) if flags is None else flags
    return Condition(pooled, tokens, words, valid, flags)


class Bound(NamedTuple):
    """A condition as the network's layers read it; rows stay the first axis of every part."""

    text: Tensor
    """(rows, width) projected pooled text."""
    keys: Tensor
    """(rows, layers, heads, words, head width)."""
    values: Tensor
    words: Tensor
    """(rows, 1, 1, words) bool."""
    lengths: Tensor
    flags: Tensor


class Inner(NamedTuple):
    """What goes through a network's blocks; rows are the first axis of every part."""

    x: Tensor
    """(rows, tokens, width); published: the condition token first."""
    condition: Tensor
    """(rows, width) level and pooled text."""
    mask: Tensor | None
    """(rows, 1, 1, tokens) True where there is something; None: everywhere."""
    change: Tensor
    """Modulated: (rows, 6, width) for every block; else (rows, 0)."""
    last: Tensor
    """Modulated: (rows, 1, 2 * width) behind them; else (rows, 0)."""
    clock: Tensor
    """With a clock: (rows, tokens, 2 * width), added to the two shifts of every block; else (rows, 0)."""


def sinusoids(positions: Tensor, width: int) -> Tensor:
    """(n,) positions to (n, width): sines in even, cosines in odd channels, base 10000 (Vaswani et al. 2017)."""
    rates = torch.exp(torch.arange(0, width, 2, device=positions.device) * (-math.log(10000.0) / width))
    angles = positions[:, None].float() * rates
    return torch.stack([angles.sin(), angles.cos()], dim=-1).flatten(1)


class Attention(nn.Module):
    """Multi-head self-attention with one projection for query, key and value, and the fused kernel."""

    def __init__(self, width: int, heads: int, dropout: float = 0.0) -> None:
        super().__init__()
        self.heads, self.dropout = heads, dropout
        self.scale = (width // heads) ** -0.5
        self.project = nn.Linear(width, 3 * width)
        self.out = nn.Linear(width, width)

    def forward(self, x: Tensor, mask: Tensor | None) -> Tensor:
        rows, tokens, width = x.shape
        q, k, v = self.project(x).view(rows, tokens, 3, self.heads, -1).permute(2, 0, 3, 1, 4)
        drop = self.dropout if self.training else 0.0
        y = F.scaled_dot_product_attention(q, k, v, attn_mask=mask, dropout_p=drop, scale=self.scale)
        return self.out(y.transpose(1, 2).reshape(rows, tokens, width))


class PublishedBlock(nn.Module):
    """Post-norm encoder layer: attention, add, norm, feed-forward with exact GELU, add, norm."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.attention = Attention(config.width, config.heads, config.dropout)
        self.linear1 = nn.Linear(config.width, config.hidden)
        self.linear2 = nn.Linear(config.hidden, config.width)
        self.norm1 = nn.LayerNorm(config.width)
        self.norm2 = nn.LayerNorm(config.width)
        self.drop = nn.Dropout(config.dropout)

    def forward(self, x: Tensor, mask: Tensor | None) -> Tensor:
        x = self.norm1(x + self.drop(self.attention(x, mask)))
        return self.norm2(x + self.drop(self.linear2(self.drop(F.gelu(self.linear1(x))))))


class ModulatedBlock(nn.Module):
    """Pre-norm layer: self-attention, attention to the words, feed-forward; six vectors shift, scale and gate."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        width = self.width = config.width
        self.heads = config.heads
        self.attention = Attention(width, config.heads)
        self.query = nn.Linear(width, width)
        self.heard = nn.Linear(width, width)
        self.norm = nn.LayerNorm(width)
        self.linear1 = nn.Linear(width, config.hidden)
        self.linear2 = nn.Linear(config.hidden, width)
        self.table = nn.Parameter(torch.zeros(6, width))
        self.drop = nn.Dropout(config.dropout)

    def forward(self, x: Tensor, inner: Inner, *, keys: Tensor, values: Tensor, words: Tensor) -> Tensor:
        rows, tokens, _ = x.shape
        width = self.width
        shift1, scale1, gate1, shift2, scale2, gate2 = (inner.change + self.table).unsqueeze(2).unbind(1)
        if inner.clock.shape[1]:
            shift1, shift2 = shift1 + inner.clock[..., :width], shift2 + inner.clock[..., width:]
        y = F.layer_norm(x, (width,)) * (1 + scale1) + shift1
        x = x + (1 + gate1) * self.drop(self.attention(y, inner.mask))
        q = self.query(self.norm(x)).view(rows, tokens, self.heads, -1).transpose(1, 2)
        y = F.scaled_dot_product_attention(q, keys, values, attn_mask=words, scale=self.attention.scale)
        x = x + self.heard(y.transpose(1, 2).reshape(rows, tokens, width))
        y = F.layer_norm(x, (width,)) * (1 + scale2) + shift2
        return x + (1 + gate2) * self.drop(self.linear2(F.gelu(self.linear1(y), approximate="tanh")))


class PriorNet(nn.Module):
    """Guesses clean motion features (rows, frames, features) from a noisy state, its level and a condition."""

    def __init__(self, config: NetConfig) -> None:
        super().__init__()
        self.config = config
        width = config.width
        self.embed = nn.Linear(config.patch * (config.features + 4 * config.flags), width)
        self.time1, self.time2 = nn.Linear(width, width), nn.Linear(width, width)
        self.text = nn.Linear(config.text, width)
        self.out = nn.Linear(width, config.patch * config.features)
        self.drop = nn.Dropout(config.dropout)
        self.flag = nn.Embedding(2, 4) if config.flags else None
        self.modulated = config.variant == "modulated"
        if self.modulated:
            self.blocks = nn.ModuleList(ModulatedBlock(config) for _ in range(config.layers))
            self.words = nn.Linear(config.text, 2 * width * config.layers)
            self.change = nn.Linear(width, 6 * width)
            self.last = nn.Linear(width, 2 * width)
            zeroed = [self.change, self.last]
            if config.clock:
                self.place, self.clock = nn.Linear(width, width), nn.Linear(width, 2 * width)
                zeroed.append(self.clock)
            for layer in zeroed:
                nn.init.zeros_(layer.weight)
                nn.init.zeros_(layer.bias)
        else:
            self.blocks = nn.ModuleList(PublishedBlock(config) for _ in range(config.layers))

    def bind(self, cond: Condition) -> Bound:
        """Everything that depends on the condition alone."""
        rows, words = cond.words.shape
        keys = values = cond.pooled.new_zeros(
            rows, self.config.layers, self.config.heads, 0, self.config.width // self.config.heads
        )
        if self.modulated:
            if not words:
                raise MotionloomError(
                    "this network attends to word vectors and the condition has none; use its own text encoder"
                )
            both = self.words(cond.tokens).view(rows, words, self.config.layers, 2, self.config.heads, -1)
            keys, values = both.permute(3, 0, 2, 4, 1, 5)
        return Bound(self.text(cond.pooled), keys, values, cond.words[:, None, None], cond.lengths, cond.flags)

    def forward(self, x: Tensor, level: int | Tensor, bound: Bound) -> Tensor:
        """(rows, frames, features) standardised, at ``level`` (one, or one per row; 1..T) to the denoised estimate."""
        return self.leave(self.through(self.enter(x, level, bound), bound), x.shape[1])

    def enter(self, x: Tensor, level: int | Tensor, bound: Bound) -> Inner:
        """What `forward` is given, to what the first block sees."""
        rows, frames, _ = x.shape
        if self.flag is not None:
            flags = (
                bound.flags if bound.flags.shape[1] else torch.zeros(rows, frames, dtype=torch.long, device=x.device)
            )
            x = torch.cat([x, self.flag(flags)], dim=-1)
        valid = valid_frames(bound.lengths, frames)
        levels = torch.as_tensor(level, device=x.device).expand(rows)
        return self.begin(self.embed(self._patches(x, valid)), levels, bound.text, self._mask(valid))

    def begin(self, tokens: Tensor, levels: Tensor, text: Tensor, mask: Tensor | None) -> Inner:
        """What the first block sees, of embedded frames.

        tokens: (rows, tokens, width), without the condition token. levels: (rows,). text: (rows, width) of `Bound`.
        mask: see `Inner`.
        """
        rows, width = tokens.shape[0], self.config.width
        # published noise index t is level - 1
        time = self.time2(F.silu(self.time1(sinusoids(levels - 1, width).to(tokens.dtype))))
        both, change = time + text, tokens.new_zeros(rows, 0)
        last = change
        if self.modulated:
            shaping = F.silu(both)
            change, last = self.change(shaping).view(rows, 6, -1), self.last(shaping)[:, None]
        else:
            tokens = torch.cat([both[:, None], tokens], dim=1)
        places = torch.arange(tokens.shape[1], device=tokens.device) * self.config.patch
        times = sinusoids(places, width).to(tokens.dtype)
        clock = tokens.new_zeros(rows, 0)
        if self.modulated and self.config.clock:  # what a text requests at a time, on a path without noise
            clock = self.clock(F.silu(both[:, None] + self.place(times)))
        return Inner(self.drop(tokens + times), both, mask, change, last, clock)

    def through(self, inner: Inner, bound: Bound, layers: slice = slice(None)) -> Inner:
        """Through some of the blocks."""
        x = inner.x
        for i in range(*layers.indices(len(self.blocks))):
            if self.modulated:
                words = {"keys": bound.keys[:, i], "values": bound.values[:, i], "words": bound.words}
                x = self.blocks[i](x, inner, **words)
            else:
                x = self.blocks[i](x, inner.mask)
        return inner._replace(x=x)

    def leave(self, inner: Inner, frames: int) -> Tensor:
        """What the last block gives, to features (rows, frames, features)."""
        return self.end(inner).reshape(inner.x.shape[0], -1, self.config.features)[:, :frames]

    def end(self, inner: Inner) -> Tensor:
        """The same as tokens (rows, tokens, patch * features)."""
        x = inner.x
        if self.modulated:
            shift, scale = inner.last.chunk(2, dim=-1)
            x = F.layer_norm(x, (self.config.width,)) * (1 + scale) + shift
        else:
            x = x[:, 1:]
        return self.out(x)

    def _patches(self, x: Tensor, valid: Tensor | None) -> Tensor:
        """(rows, frames, numbers) to (rows, tokens, patch * numbers), padded with zeros."""
        patch = self.config.patch
        if patch == 1:
            return x
        if valid is not None:
            x = x * valid[..., None]  # a token may be part motion and part padding
        return F.pad(x, (0, 0, 0, -x.shape[1] % patch)).reshape(len(x), -1, patch * x.shape[2])

    def _mask(self, valid: Tensor | None) -> Tensor | None:
        """(rows, 1, 1, tokens): the condition token, and tokens of which a frame is valid."""
        if valid is None:
            return None
        patch = self.config.patch
        if not self.modulated:
            return F.pad(valid, (1, 0), value=True)[:, None, None]
        return F.pad(valid, (0, -valid.shape[1] % patch)).view(len(valid), -1, patch).any(-1)[:, None, None]


def valid_frames(lengths: Tensor, frames: int) -> Tensor | None:
    """(rows, frames) bool, or None where all frames of all rows are valid."""
    if lengths.device.type == "cpu" and bool(((lengths < 0) | (lengths >= frames)).all()):
        return None
    return (torch.arange(frames, device=lengths.device) < lengths[:, None]) | (lengths < 0)[:, None]
