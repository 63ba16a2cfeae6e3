"""The text-motion evaluators of Guo et al. ("Generating Diverse and Natural 3D Human Motions from Text", CVPR 2022).

Three networks by the names and shapes of the published ``finest.tar``: a movement encoder (four frames to one
snippet), and a text and a motion encoder (bidirectional GRUs with a learned first state) into one space of 512 numbers.
Their sizes are read from the weights, so HumanML3D (259 channels), KIT (247) and BABEL (135) fit alike.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils.rnn import pack_padded_sequence

from motionloom.core.errors import MotionloomError
from motionloom_lab.papers.torch_file import is_plain, read_torch_file
from motionloom_train.modules import fill

UNIT = 4
"""Frames per snippet."""
PARTS = ("movement_encoder", "text_encoder", "motion_encoder")


@dataclass(frozen=True)
class GuoSizes:
    """Widths; the defaults are HumanML3D's."""

    channels: int = 259
    """Numbers per frame that are shown: 263 without the 4 contacts; BABEL 135."""
    snippet: int = 512
    text: int = 512
    """Width of the text GRU, each way."""
    motion: int = 1024
    """Width of the motion GRU, each way."""
    width: int = 512
    """Of the common space."""
    word: int = 300
    tags: int = 15
    """Parts of speech."""


class MovementEncoder(nn.Module):
    """Four frames to one snippet, twice halving the time."""

    def __init__(self, sizes: GuoSizes) -> None:
        super().__init__()
        self.main = nn.Sequential(
            nn.Conv1d(sizes.channels, sizes.snippet, 4, stride=2, padding=1),
            nn.Dropout(0.2),
            nn.LeakyReLU(0.2),
            nn.Conv1d(sizes.snippet, sizes.snippet, 4, stride=2, padding=1),
            nn.Dropout(0.2),
            nn.LeakyReLU(0.2),
        )
        self.out_net = nn.Linear(sizes.snippet, sizes.snippet)

    def forward(self, frames: Tensor) -> Tensor:
        """(rows, frames, channels) in the evaluator's units to (rows, frames // 4, snippet).

        The last snippet of a row also sees the three frames after it: what follows a row's end matters.
        """
        return self.out_net(self.main(frames.mT).mT)


class SequenceEncoder(nn.Module):
    """A padded sequence to one point: linear, bidirectional GRU, both last states, two linear layers."""

    def __init__(self, inputs: int, inner: int, joined: int, width: int) -> None:
        """inputs: numbers per item; inner: width of the GRU; joined: width between the last two layers."""
        super().__init__()
        self.input_emb = nn.Linear(inputs, inner)
        self.gru = nn.GRU(inner, inner, batch_first=True, bidirectional=True)
        self.hidden = nn.Parameter(torch.zeros(2, 1, inner))
        self.output_net = nn.Sequential(
            nn.Linear(2 * inner, joined), nn.LayerNorm(joined), nn.LeakyReLU(0.2), nn.Linear(joined, width)
        )

    def forward(self, items: Tensor, lengths: Sequence[int]) -> Tensor:
        """(rows, items, inputs) and the items that count in each row to (rows, width), in the order given."""
        rows, most = items.shape[:2]
        if len(lengths) != rows or not all(1 <= n <= most for n in lengths):
            raise ValueError(f"{rows} rows of at most {most} items cannot have lengths {list(lengths)[:8]}")
        count = torch.as_tensor(list(lengths), dtype=torch.int64)
        packed = pack_padded_sequence(self.input_emb(items), count, batch_first=True, enforce_sorted=False)
        _, last = self.gru(packed, self.hidden.expand(-1, rows, -1).contiguous())
        return self.output_net(torch.cat([last[0], last[1]], dim=-1))


class TextEncoder(SequenceEncoder):
    """A sentence of word vectors and parts of speech to one point."""

    def __init__(self, sizes: GuoSizes) -> None:
        super().__init__(sizes.word, sizes.text, sizes.text, sizes.width)
        self.pos_emb = nn.Linear(sizes.tags, sizes.word)

    def encode(self, words: Tensor, tags: Tensor, lengths: Sequence[int]) -> Tensor:
        """(rows, items, 300) vectors, (rows, items, 15) one-hot parts of speech, and lengths to (rows, width)."""
        return self(words + self.pos_emb(tags), lengths)


class GuoNets(nn.Module):
    """The three networks. Rows come back in the order they were given; one row alone is that row in a batch."""

    def __init__(self, sizes: GuoSizes) -> None:
        super().__init__()
        self.sizes = sizes
        self.movement_encoder = MovementEncoder(sizes)
        self.text_encoder = TextEncoder(sizes)
        self.motion_encoder = SequenceEncoder(sizes.snippet, sizes.motion, sizes.motion, sizes.width)

    def motions(self, frames: Tensor, lengths: Sequence[int]) -> Tensor:
        """(rows, frames, channels), standardised and without contacts, and lengths in frames to (rows, width)."""
        return self.motion_encoder(self.movement_encoder(frames), [n // UNIT for n in lengths])

    def texts(self, words: Tensor, tags: Tensor, lengths: Sequence[int]) -> Tensor:
        """Word vectors, one-hot parts of speech, and lengths in tokens with ``sos`` and ``eos`` to (rows, width)."""
        return self.text_encoder.encode(words, tags, lengths)


def published_order(lengths: Sequence[int]) -> np.ndarray:
    """The order in which the published code returns rows: by falling motion length."""
    return np.argsort(np.asarray(lengths))[::-1].copy()


def from_state_dict(state: Mapping[str, Tensor]) -> GuoNets:
    """The networks with published weights, ``movement_encoder.main.0.weight`` and so on.

    Raises MotionloomError for weights that are missing, unknown, misshapen or not finite.
    """
    sizes = _sizes(state)
    with torch.device("meta"):
        nets = GuoNets(sizes)
    # Copied: sums over memory of another alignment, such as a mapped file's, differ in the last bit.
    fill(nets, {k: v.detach().to(torch.float32, copy=True) for k, v in state.items()}, "the evaluator's file")
    return nets.eval().requires_grad_(False)


def _sizes(state: Mapping[str, Tensor]) -> GuoSizes:
    """Widths as the weights have them; whether the rest agrees is seen when the shapes are compared."""
    places = {
        "channels": ("movement_encoder.main.0.weight", 3, 1),
        "snippet": ("movement_encoder.out_net.weight", 2, 0),
        "text": ("text_encoder.hidden", 3, 2),
        "motion": ("motion_encoder.hidden", 3, 2),
        "width": ("text_encoder.output_net.3.weight", 2, 0),
        "word": ("text_encoder.pos_emb.weight", 2, 0),
        "tags": ("text_encoder.pos_emb.weight", 2, 1),
    }
    assert places.keys() == {field.name for field in fields(GuoSizes)}
    sizes = {}
    for name, (key, dimensions, axis) in places.items():
        if key not in state or state[key].ndim != dimensions or state[key].numel() == 0:
            raise MotionloomError(f"the weights lack a usable {key}; they are not those of Guo's evaluators")
        sizes[name] = state[key].shape[axis]
    return GuoSizes(**sizes)


def read_guo(path: Path | str) -> dict[str, Tensor]:
    """The weights of a published ``finest.tar`` by full name; optimisers and counters in the file are left out.

    Read as `read_torch_file` does. Raises MotionloomError for a file that is missing, larger than 2 GiB (also
    unpacked), damaged, of another kind, or that holds anything but plain values.
    """
    path = Path(path)
    if not path.is_file():
        raise MotionloomError(f"there is no checkpoint {path}")
    loaded = read_torch_file(path)
    missing = [part for part in PARTS if not isinstance(loaded, dict) or not isinstance(loaded.get(part), dict)]
    if missing:
        raise MotionloomError(f"{path} has no {missing[0]}; name the finest.tar of text_mot_match, which has all three")
    state = {f"{part}.{key}": value for part in PARTS for key, value in loaded[part].items()}
    for key, value in state.items():
        if not isinstance(value, Tensor) or not is_plain(value):
            raise MotionloomError(f"{path}: {key} is not an ordinary array of floating-point numbers; it is not read")
    return state
