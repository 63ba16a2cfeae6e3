"""TransLinear, the network of HumanMAC (Chen et al. 2023, section 3.3): a transformer whose tokens are frequencies.

As published, with the published names of its weights, so that published checkpoints load; or with two additions of
ours (`beside` and `condition` of `PredictorConfig`) for networks conditioned on a mask of the numbers that are known.
"""

import math

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.models.networks.predictor import PredictorConfig


class TransLinear(nn.Module):
    """``net(x, t, condition)``: the estimate of the noise (published) or of the clean spectrum (x0), of x's shape.

    x (rows, kept, channels); t (rows,) the published counting of noise levels, 0 the first noisy one; condition (rows,
    *config.condition_shape) or None. ``keep`` (rows,) bool: the rows that get the condition; the others go without.
    """

    def __init__(self, config: PredictorConfig) -> None:
        super().__init__()
        self.config = config
        width, (rows, channels) = config.width, config.condition_shape
        self.sequence_embedding = nn.Parameter(torch.randn(config.kept, width))
        self.joint_embed = nn.Linear(config.channels + config.beside * channels, width)
        self.time_embed = nn.Sequential(nn.Linear(width, width), nn.SiLU(), nn.Linear(width, width))
        self.cond_embed = nn.Linear(rows * channels, width)
        self.temporal_decoder_blocks = nn.ModuleList(_Block(config) for _ in range(config.layers))
        self.out = _zeroed(nn.Linear(width, config.channels))

    def forward(self, x: Tensor, t: Tensor, condition: Tensor | None = None, keep: Tensor | None = None) -> Tensor:
        style = self.time_embed(waves(t, self.config.width).to(x))
        if condition is not None:
            embedding = self.cond_embed(condition.flatten(1))
            style = style + (embedding if keep is None else embedding * keep[:, None])
        if self.config.beside:
            x = torch.cat([x, self._beside(x, condition, keep)], dim=-1)
        h = self.joint_embed(x) + self.sequence_embedding
        half, skips = self.config.layers // 2, []
        for number, block in enumerate(self.temporal_decoder_blocks):
            if number < half:
                skips.append(h)
                h = block(h, style)
            else:
                h = block(h, style) + skips.pop()
        return self.out(h)

    def _beside(self, x: Tensor, condition: Tensor | None, keep: Tensor | None) -> Tensor:
        if condition is None:
            return x.new_zeros(*x.shape[:2], self.config.condition_shape[1])
        own = condition[:, : self.config.kept]
        return own if keep is None else own * keep[:, None, None]


class _Block(nn.Module):
    def __init__(self, config: PredictorConfig) -> None:
        super().__init__()
        self.sa_block, self.ffn = _Attention(config), _FeedForward(config)

    def forward(self, x: Tensor, style: Tensor) -> Tensor:
        return self.ffn(self.sa_block(x, style), style)


class _Attention(nn.Module):
    def __init__(self, config: PredictorConfig) -> None:
        super().__init__()
        width, self.heads, self.dropout = config.width, config.heads, config.dropout
        self.scale = (width // self.heads) ** -0.5
        self.norm = nn.LayerNorm(width)
        self.query, self.key, self.value = (nn.Linear(width, width, bias=False) for _ in range(3))
        self.proj_out = _Stylization(config)

    def forward(self, x: Tensor, style: Tensor) -> Tensor:
        z = self.norm(x)
        q, k, v = (m(z).unflatten(-1, (self.heads, -1)).transpose(1, 2) for m in (self.query, self.key, self.value))
        y = F.scaled_dot_product_attention(q, k, v, dropout_p=self.dropout if self.training else 0.0, scale=self.scale)
        return x + self.proj_out(y.transpose(1, 2).flatten(2), style)


class _FeedForward(nn.Module):
    def __init__(self, config: PredictorConfig) -> None:
        super().__init__()
        self.linear1 = nn.Linear(config.width, 2 * config.width)
        self.linear2 = _zeroed(nn.Linear(2 * config.width, config.width))
        self.dropout = nn.Dropout(config.dropout)
        self.proj_out = _Stylization(config)

    def forward(self, x: Tensor, style: Tensor) -> Tensor:
        return x + self.proj_out(self.linear2(self.dropout(F.gelu(self.linear1(x)))), style)


class _Stylization(nn.Module):
    """What closes a sub-block: its result scaled and shifted by time and condition, through one layer from zero."""

    def __init__(self, config: PredictorConfig) -> None:
        super().__init__()
        width = config.width
        self.emb_layers = nn.Sequential(nn.SiLU(), nn.Linear(width, 2 * width))
        self.norm = nn.LayerNorm(width)
        self.out_layers = nn.Sequential(nn.SiLU(), nn.Dropout(config.dropout), _zeroed(nn.Linear(width, width)))

    def forward(self, h: Tensor, style: Tensor) -> Tensor:
        scale, shift = self.emb_layers(style)[:, None].chunk(2, dim=-1)
        return self.out_layers(self.norm(h) * (1 + scale) + shift)


def waves(t: Tensor, width: int) -> Tensor:
    """(rows, width) of integers t (rows,): cosines, then sines, of wave lengths from 2 pi to 10,000 times that."""
    half = width // 2
    rates = torch.exp(-math.log(10_000) / half * torch.arange(half, dtype=torch.float32, device=t.device))
    angle = t[:, None].float() * rates
    return torch.cat([angle.cos(), angle.sin()], dim=-1)


def _zeroed(layer: nn.Linear) -> nn.Linear:
    nn.init.zeros_(layer.weight)
    nn.init.zeros_(layer.bias)
    return layer
