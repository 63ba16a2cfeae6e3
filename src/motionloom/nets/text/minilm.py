"""The embedded default text encoder: all-MiniLM-L6-v2 in eight bits with a smaller vocabulary.

How it was made and how far it is from the original: docs/decisions/0002-text-encoder.md.
"""

from collections.abc import Iterator, Sequence

import torch
from torch import Tensor
from torch.nn import functional as F

from motionloom.errors import MotionloomError
from motionloom.nets.text.bert import Bert
from motionloom.nets.text.protocol import Row, RowCache, TextEmbedding, as_rows, cut, stack_rows
from motionloom.nets.text.quantise import dequantise, quantise
from motionloom.nets.text.wordpiece import END, SPECIALS, START, make_tokenizer
from motionloom.nets.unfilled import unfilled

HEAD_WIDTH = 32
LENGTH = 64  # word pieces, start and end marks included
BATCH_WORDS = 2048
VOCABULARY = "vocabulary"
SCALE = ".scale"


class MiniLM:
    """BERT of 6 layers and width 384 (head width 32); tokens are its last hidden states, pooled is their normed mean.

    Build it with `from_tensors`. Texts beyond 64 word pieces are truncated with a Python warning.
    """

    name = "minilm"

    def __init__(self, net: Bert, vocabulary: Sequence[str], packed: dict[str, Tensor], *, cache: int = 1024) -> None:
        self.net = net.eval().requires_grad_(False)
        self.vocabulary = tuple(vocabulary)
        self._packed = packed
        self._tokenizer = make_tokenizer(self.vocabulary)
        self._start, self._end = self.vocabulary.index(START), self.vocabulary.index(END)
        self._cache = RowCache(cache)

    @property
    def width(self) -> int:
        return self.net.words.embedding_dim

    @staticmethod
    def from_tensors(tensors: dict[str, Tensor], *, cache: int = 1024) -> "MiniLM":
        """Unpack what `to_tensors` or `pack` gave (int8 matrices, float16 rest, the vocabulary as UTF-8 bytes).

        Raises MotionloomError where tensors are missing, misshapen or not finite.
        """
        try:
            vocabulary = read_vocabulary(tensors[VOCABULARY])
            weights = _unpack(tensors)
            places, width = weights["places.weight"].shape
            if places < 3 or width % HEAD_WIDTH:
                raise ValueError(f"{places} places of width {width}")
            layers = len({key.split(".")[1] for key in weights if key.startswith("layers.")})
            hidden = weights["layers.0.hidden_in.weight"].shape[0]
            with unfilled():
                net = Bert(
                    vocabulary=len(vocabulary),
                    places=places,
                    width=width,
                    heads=width // HEAD_WIDTH,
                    hidden=hidden,
                    layers=layers,
                )
            net.load_state_dict(weights, assign=True)
        except (KeyError, RuntimeError, ValueError, IndexError) as error:
            reason = " ".join(str(error).split())[:200]
            raise MotionloomError(
                f"The text encoder inside the weights is damaged ({reason}); fetch the weights again."
            ) from error
        return MiniLM(net, vocabulary, dict(tensors), cache=cache)

    def to_tensors(self) -> dict[str, Tensor]:
        """The packed tensors this encoder was read from."""
        return dict(self._packed)

    def to(self, device: torch.device | str) -> "MiniLM":
        """The same encoder on another device, with an empty cache."""
        moved = MiniLM.from_tensors(self._packed, cache=self._cache.size)
        moved.net.to(device)
        return moved

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Tokens (rows, words <= 64, width), mask (rows, words), pooled (rows, width) of unit length.

        An empty text is its start and end marks. The null condition of guidance is the caller's business.
        """
        return stack_rows(self._cache.fetch(as_rows(texts), self._encode), self.width)

    def ids(self, text: str) -> list[int]:
        """Word-piece ids of one text with start and end marks, at most 64 of them (warns where it had to cut)."""
        room = self.net.places.num_embeddings - 2
        pieces = cut(text, lambda part: self._tokenizer.encode(part, add_special_tokens=False).ids, room)
        return [self._start, *pieces, self._end]

    @torch.no_grad()
    def _encode(self, texts: list[str]) -> list[Row]:
        ids = [self.ids(text) for text in texts]
        rows: dict[int, Row] = {}
        for chosen in _batches([len(row) for row in ids]):
            longest = max(len(ids[place]) for place in chosen)
            padded = torch.tensor([ids[place] + [0] * (longest - len(ids[place])) for place in chosen])
            lengths = torch.tensor([len(ids[place]) for place in chosen])
            mask = torch.arange(longest) < lengths[:, None]
            device = self.net.words.weight.device
            states = self.net(padded.to(device), mask.to(device))
            for place, row in zip(chosen, states):
                words = row[: len(ids[place])].clone()
                rows[place] = (words, F.normalize(words.mean(0), dim=0))
        return [rows[place] for place in range(len(texts))]


def _batches(lengths: list[int]) -> Iterator[list[int]]:
    """Places of rows of about equal length, at most BATCH_WORDS words a batch with padding."""
    order = sorted(range(len(lengths)), key=lambda place: lengths[place])
    batch: list[int] = []
    for place in order:
        if batch and lengths[place] * (len(batch) + 1) > BATCH_WORDS:
            yield batch
            batch = []
        batch.append(place)
    if batch:
        yield batch


def pack(weights: dict[str, Tensor], vocabulary: Sequence[str]) -> dict[str, Tensor]:
    """`Bert`'s float weights and its vocabulary -> storage: linear and word matrices int8, the rest float16."""
    tensors: dict[str, Tensor] = {VOCABULARY: write_vocabulary(vocabulary)}
    for name, value in weights.items():
        if value.ndim == 2 and name != "places.weight":
            tensors[name], tensors[name + SCALE] = quantise(value)
        else:
            tensors[name] = value.to(torch.float16)
    return tensors


def _unpack(tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    weights: dict[str, Tensor] = {}
    for name, value in tensors.items():
        if name == VOCABULARY or name.endswith(SCALE):
            continue
        packed = value.dtype == torch.int8
        weights[name] = dequantise(value, tensors[name + SCALE]) if packed else value.float()
        largest = 128 * tensors[name + SCALE].float() if packed else weights[name]  # a row's largest number, not each
        if not largest.isfinite().all():
            raise ValueError(f"{name} is not finite")
    return weights


def write_vocabulary(vocabulary: Sequence[str]) -> Tensor:
    """Pieces joined by newlines as UTF-8 bytes (uint8)."""
    return torch.frombuffer(bytearray("\n".join(vocabulary).encode()), dtype=torch.uint8)


def read_vocabulary(data: Tensor) -> list[str]:
    """The inverse of `write_vocabulary`; raises ValueError where pieces repeat or a special one is missing."""
    vocabulary = data.to(torch.uint8).cpu().numpy().tobytes().decode("utf-8").split("\n")
    if len(set(vocabulary)) != len(vocabulary) or not set(SPECIALS) <= set(vocabulary):
        raise ValueError("its vocabulary has repeated pieces or lacks a special one")
    return vocabulary
