"""The own text-motion evaluator: a motion encoder and a text encoder into one space, and their file.

A retrieval model in the manner of TMR (Petrovich, Black and Varol, ICCV 2023) without its decoder. Points are unit
vectors: a distance is then a function of the angle that the contrastive loss trained, and no free length enters FID.
Why it is as it is: docs/decisions/0010-own-evaluator.md.
"""

import hashlib
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from motionloom.core.errors import MotionloomError
from motionloom.core.features import humanml
from motionloom.core.features.layout import LAYOUT
from motionloom.core.features.representation import HUMANML3D, Representation, named
from motionloom.core.models.container import Container, check, halved
from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom.core.models.networks.text.protocol import TextEncoder
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_train.modules import arrays, shapes
from motionloom_train.tensors import tensor

EVALUATORS = Container("evaluator", "motionloom_evaluator", max_bytes=100 << 20)
KEY = EVALUATORS.key
"""Metadata entry with the file's kind."""
INPUTS = 4 + 63 + 66 + 4
"""Numbers per frame that the motion encoder reads of HumanML3D's, see `inputs`."""
STRIDE = 4
"""Frames to a token: 20 per second become 5."""
FARTHEST = 20.0
"""Standard deviations at which an input is cut off: nonsense stays finite."""
ROWS = 64
FORGET = 0.15
"""Share of motion tokens that a training step does not see."""
CARD = ("name", "licence", "data", "made")


@dataclass(frozen=True)
class EvaluatorConfig:
    """Sizes of the network."""

    width: int = 192
    layers: int = 2
    """Transformer layers over motion tokens; the text head has one."""
    heads: int = 4
    hidden: int = 384
    text: int = 384
    """Width of the word states."""
    embed: int = 128
    """Width of the common space."""
    dropout: float = 0.1
    representation: str = HUMANML3D.name
    """What the numbers are that are judged."""

    @property
    def inputs(self) -> int:
        """Numbers per frame that the motion encoder reads."""
        kind = named(self.representation)
        return INPUTS if kind is HUMANML3D else kind.width

    def __post_init__(self) -> None:
        named(self.representation)
        sizes = (self.width, self.layers, self.heads, self.hidden, self.text, self.embed)
        good = all(isinstance(n, int) and not isinstance(n, bool) and 1 <= n <= 4096 for n in sizes)
        if not good or self.layers > 64 or self.width % (2 * self.heads) or not 0 <= self.dropout < 1:
            raise MotionloomError(f"{self} is no evaluator: sizes from 1 to 4096, the width a multiple of 2 x heads")


def inputs(features: Tensor, lengths: Tensor) -> Tensor:
    """What a viewer sees, (rows, frames, numbers) unstandardised and (rows,) to (rows, frames, inputs).

    Of other representations than HumanML3D's the numbers themselves, as published for BABEL. Of HumanML3D's the
    root's four numbers and the places of the joints as stored (67), how far each joint goes to the next frame
    (66), and the way walked since frame 0: cosine and sine of the heading, x and z in metres. All of it follows from
    the first 67 features, those that `decode_positions` reads: rotations, velocities and contact flags of a generated
    motion may contradict its positions, and nobody sees them.
    """
    if features.shape[-1] != HUMANML3D.width:
        return features
    moved = humanml.displacements(features).flatten(-2)
    frames = torch.arange(features.shape[1], device=features.device)
    known = torch.minimum(frames, (lengths[:, None] - 2).clamp(min=0))  # the last frame has no next one: repeat
    moved = torch.gather(moved, 1, known[..., None].expand(-1, -1, moved.shape[-1]))
    heading, place = humanml.recover_root(features)
    cos, sin = heading[..., 0] ** 2 - heading[..., 2] ** 2, 2 * heading[..., 0] * heading[..., 2]
    way = torch.stack([cos, sin, place[..., 0], place[..., 2]], dim=-1)
    return torch.cat([features[..., : LAYOUT["ric"].stop], moved, way], dim=-1)


class Block(nn.Module):
    """Self-attention and feed-forward, normalised before each."""

    def __init__(self, config: EvaluatorConfig) -> None:
        super().__init__()
        self.heads = config.heads
        self.attention_norm = nn.LayerNorm(config.width)
        self.attention_in = nn.Linear(config.width, 3 * config.width)
        self.attention_out = nn.Linear(config.width, config.width)
        self.hidden_norm = nn.LayerNorm(config.width)
        self.hidden_in = nn.Linear(config.width, config.hidden)
        self.hidden_out = nn.Linear(config.hidden, config.width)
        self.drop = nn.Dropout(config.dropout)

    def forward(self, x: Tensor, valid: Tensor) -> Tensor:
        """(rows, tokens, width), (rows, tokens) True where there is a token."""
        parts = self.attention_in(self.attention_norm(x)).unflatten(-1, (3, self.heads, -1)).permute(2, 0, 3, 1, 4)
        mixed = F.scaled_dot_product_attention(parts[0], parts[1], parts[2], attn_mask=valid[:, None, None, :])
        x = x + self.drop(self.attention_out(mixed.transpose(1, 2).flatten(-2)))
        return x + self.drop(self.hidden_out(self.drop(F.gelu(self.hidden_in(self.hidden_norm(x))))))


class Pool(nn.Module):
    """Tokens to one point of the common space: each head weighs the tokens its own way."""

    def __init__(self, config: EvaluatorConfig) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(config.width)
        self.score = nn.Linear(config.width, config.heads)
        self.out = nn.Linear(config.width, config.embed)

    def forward(self, x: Tensor, valid: Tensor) -> Tensor:
        """(rows, tokens, width), (rows, tokens) to unit vectors (rows, embed)."""
        x = self.norm(x)
        share = self.score(x).masked_fill(~valid[..., None], float("-inf")).softmax(dim=1)  # (rows, tokens, heads)
        parts = x.unflatten(-1, (share.shape[-1], -1))
        return F.normalize(self.out((parts * share[..., None]).sum(1).flatten(-2)).float(), dim=-1)


class MotionEncoder(nn.Module):
    """Standardised `inputs` to unit vectors: 20 to 5 tokens per second by convolutions, then a transformer."""

    def __init__(self, config: EvaluatorConfig) -> None:
        super().__init__()
        self.first = nn.Conv1d(config.inputs, config.width, 4, stride=2, padding=1)
        self.second = nn.Conv1d(config.width, config.width, 4, stride=2, padding=1)
        self.blocks = nn.ModuleList(Block(config) for _ in range(config.layers))
        self.drop = nn.Dropout(config.dropout)
        self.pool = Pool(config)

    def forward(self, x: Tensor, lengths: Tensor) -> Tensor:
        """(rows, frames, inputs), zeros behind each row's length of at least `STRIDE` frames, to (rows, embed)."""
        x = F.gelu(self.first(self.drop(x).transpose(1, 2)))
        x = x * _valid(lengths // 2, x.shape[-1])[:, None]  # a row ends as it would alone
        x = F.gelu(self.second(x)).transpose(1, 2)
        valid = _valid(lengths // STRIDE, x.shape[1])
        if self.training:  # no single moment may decide: seen like this, few recordings last longer
            keep = torch.rand(valid.shape, device=valid.device) >= FORGET
            keep[:, 0] = True
            valid = valid & keep
        x = x + places(x.shape[1], x.shape[2]).to(x)
        for block in self.blocks:
            x = block(x, valid)
        return self.pool(x, valid)


class TextHead(nn.Module):
    """Word states of the frozen encoder to unit vectors."""

    def __init__(self, config: EvaluatorConfig) -> None:
        super().__init__()
        self.into = nn.Linear(config.text, config.width)
        self.block = Block(config)
        self.drop = nn.Dropout(config.dropout)
        self.pool = Pool(config)

    def forward(self, words: Tensor, valid: Tensor) -> Tensor:
        """(rows, words, text), (rows, words) to (rows, embed)."""
        x = self.into(self.drop(words))
        return self.pool(self.block(x + places(x.shape[1], x.shape[2]).to(x), valid), valid)


class EvaluatorNet(nn.Module):
    """Both encoders and the temperature of the contrastive loss."""

    def __init__(self, config: EvaluatorConfig) -> None:
        super().__init__()
        self.config = config
        self.motion, self.text = MotionEncoder(config), TextHead(config)
        self.sharpness = nn.Parameter(torch.tensor(math.log(1 / 0.07)))
        """Logarithm of one over the temperature."""

    def forward(self, x: Tensor, lengths: Tensor, words: Tensor, valid: Tensor) -> tuple[Tensor, Tensor]:
        """Points of motions and of texts, (rows, embed) each; the two may have different numbers of rows."""
        return self.motion(x, lengths), self.text(words, valid)


def places(count: int, width: int) -> Tensor:
    """Sines and cosines of a token's place (Vaswani et al. 2017, section 3.5), (count, width), a fifth as large."""
    rate = torch.exp(torch.arange(0, width, 2) * (-math.log(1000.0) / width))
    angle = torch.arange(count)[:, None] * rate
    return 0.2 * torch.cat([angle.sin(), angle.cos()], dim=-1)


def _valid(lengths: Tensor, count: int) -> Tensor:
    return torch.arange(count, device=lengths.device) < lengths[:, None]


def standardised(x: Tensor, lengths: Tensor, mean: Tensor, std: Tensor) -> Tensor:
    """`inputs` in units of their spread, cut at `FARTHEST`, zero behind each row's length."""
    scaled = ((x - mean) / std).clamp(-FARTHEST, FARTHEST)
    return scaled * _valid(lengths, x.shape[1])[..., None]


@dataclass(frozen=True, eq=False)
class Embedder:
    """A finished `Evaluator`: everything its file holds, and the text encoder that the file names."""

    net: EvaluatorNet
    mean: Tensor
    """(inputs,) of the training data."""
    std: Tensor
    text: TextEncoder
    card: dict[str, str]
    """name, licence, data, made: see `CARD`."""

    @property
    def name(self) -> str:
        """See `Evaluator`."""
        return self.card["name"]

    @property
    def about(self) -> dict[str, str]:
        """See `Evaluator`."""
        return dict(self.card)

    @property
    def representation(self) -> Representation:
        """See `Evaluator`."""
        return named(self.net.config.representation)

    @torch.no_grad()
    def motions(self, features: Sequence[np.ndarray]) -> np.ndarray:
        """Motions (frames, numbers) unstandardised to unit vectors (motions, embed) float64.

        Each row is independent of the others. Raises MotionloomError for other shapes, fewer than 4 frames, NaN.
        """
        points, width = np.zeros((len(features), self.net.config.embed)), self.representation.width
        for number, one in enumerate(features):
            if one.ndim != 2 or one.shape[1] != width or len(one) < STRIDE or not np.isfinite(one).all():
                raise MotionloomError(
                    f"motion {number} cannot be judged: it must be ({STRIDE} or more frames, {width}) finite numbers; "
                    f"got shape {one.shape}"
                )
        order = sorted(range(len(features)), key=lambda i: len(features[i]))
        for first in range(0, len(order), ROWS):
            rows = order[first : first + ROWS]
            lengths = torch.tensor([len(features[i]) for i in rows])
            batch = torch.zeros(len(rows), int(lengths.max()), width, dtype=torch.float64)
            for row, i in enumerate(rows):
                batch[row, : lengths[row]] = torch.from_numpy(np.asarray(features[i], dtype=np.float64))
            x = standardised(inputs(batch, lengths), lengths, self.mean.double(), self.std.double())
            points[rows] = self.net.motion(x.float(), lengths).double().numpy()
        return points

    @torch.no_grad()
    def texts(self, captions: Sequence[Caption]) -> np.ndarray:
        """Sentences to unit vectors (captions, embed) float64; tokens are not read."""
        points = np.zeros((len(captions), self.net.config.embed))
        for first in range(0, len(captions), ROWS):
            code = self.text.encode([caption.text for caption in captions[first : first + ROWS]])
            points[first : first + ROWS] = self.net.text(tensor(code.tokens), tensor(code.mask)).double().numpy()
        return points


def text_digest(text: TextEncoder) -> str:
    """SHA-256 of an embedded text encoder's weights: the head was trained on the states of exactly this one."""
    if not isinstance(text, MiniLM):
        raise MotionloomError(f"the evaluator reads the embedded text encoder minilm; these weights have {text.name!r}")
    digest = hashlib.sha256()
    for name, value in sorted(text.to_tensors().items()):
        digest.update(f"{name} torch.{value.dtype} {tuple(value.shape)};".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()


def save_embedder(embedder: Embedder, path: Path | str) -> Path:
    """Write an evaluator (float16, without its text encoder, whose digest it keeps) and give the path back."""
    tensors = {f"net.{k}": v for k, v in halved(arrays(embedder.net)).items()}
    tensors |= {"mean": embedder.mean.float().numpy(), "std": embedder.std.float().numpy()}
    about = {"net": asdict(embedder.net.config), "text": text_digest(embedder.text), "card": embedder.card}
    return EVALUATORS.write(path, tensors, about)


def is_embedder(path: Path) -> bool:
    """True for a file of `save_embedder`, damaged or not, by its head."""
    return EVALUATORS.signed(path)


def load_embedder(path: Path | str, text: TextEncoder) -> Embedder:
    """Read an evaluator for use with ``text``.

    Raises MotionloomError where the file is damaged, of another kind or for another text encoder.
    """
    path = Path(path)
    about, tensors = _read(path)
    if text_digest(text) != about["text"]:
        raise MotionloomError(
            f"{path} was trained with another text encoder than the one given; use the weights whose encoder it names"
        )
    with torch.device("meta"):
        net = EvaluatorNet(about["net"])
    weights = {k[4:]: tensor(v).float() for k, v in tensors.items() if k.startswith("net.")}
    own = {f"net.{k}": shape for k, shape in shapes(net).items()}
    read = (about["net"].inputs,)
    check(tensors, own | {"mean": read, "std": read}, str(path))
    if float(tensors["std"].min()) <= 0:
        raise MotionloomError(f"{path} has a spread of 0; fetch the evaluator again")
    net.load_state_dict(weights, assign=True)
    net = net.eval().requires_grad_(False)
    mean, std = (tensor(tensors[key]).float() for key in ("mean", "std"))
    return Embedder(net, mean, std, text, about["card"])


def _read(path: Path) -> tuple[dict, dict[str, np.ndarray]]:
    about, tensors = EVALUATORS.read(path)
    with EVALUATORS.parsing(path):
        names = {field.name for field in fields(EvaluatorConfig)}
        about["net"] = {"representation": HUMANML3D.name, **about["net"]}  # older files do not say
        if set(about["net"]) != names or not isinstance(about["text"], str):
            raise ValueError("sizes of another kind")
        about["net"] = EvaluatorConfig(**about["net"])
        about["card"] = {name: str(about["card"][name])[:4000] for name in CARD}
        return about, tensors
