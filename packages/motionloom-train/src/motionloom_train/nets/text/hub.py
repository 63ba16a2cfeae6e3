"""Published Hugging Face text models, CLIP and DistilBERT, from a folder or the hub's local cache; never downloads.

`lab.papers.text_model` turns a folder's pytorch_model.bin into the model.safetensors that is wanted here.
"""

import html
import importlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import torch

from motionloom.core.errors import MotionloomError
from motionloom.core.models.networks.text.protocol import Row, RowCache, TextEmbedding, as_rows, cut, stack_rows

BATCH = 64


@dataclass(frozen=True)
class Pretrained:
    """A frozen float32 model in evaluation mode and its tokenizer (types of the optional transformers package)."""

    model: Any
    tokenizer: Any


def open_pretrained(model_class: str, place: Path | str, *, extra: str) -> Pretrained:
    """Load `transformers.<model_class>` and its tokenizer from a folder, or by hub name from the local cache.

    Only safetensors weights are read. Raises MotionloomError where transformers, the files or some weights are
    missing; `extra` is the name of the optional dependency to install.
    """
    try:
        transformers = importlib.import_module("transformers")
    except ImportError as error:
        raise MotionloomError(
            f"The text encoder {place} needs the package transformers, which is not installed; "
            f"pip install 'motionloom-train[{extra}]'."
        ) from error
    options = {"local_files_only": True, "trust_remote_code": False}
    with _quiet(transformers):
        try:
            tokenizer = transformers.AutoTokenizer.from_pretrained(str(place), **options)
            model, report = getattr(transformers, model_class).from_pretrained(
                str(place), use_safetensors=True, output_loading_info=True, **options
            )
        except Exception as error:  # whatever transformers meets in files from outside
            reason = " ".join(str(error).split())[:160]
            raise MotionloomError(
                f"The text encoder {place} could not be opened ({reason}); fetch it once with `hf download {place}` "
                "or name a folder with its config.json, tokenizer files and model.safetensors (made from a "
                "pytorch_model.bin by `python -m motionloom_lab.papers.text_model FOLDER`)."
            ) from error
    if report["missing_keys"]:
        missing = sorted(report["missing_keys"])
        raise MotionloomError(
            f"The text encoder {place} lacks {len(missing)} of its weights ({missing[0]} first); fetch it again."
        )
    return Pretrained(model.float().eval().requires_grad_(False), tokenizer)


@contextmanager
def _quiet(transformers: Any) -> Iterator[None]:
    """No progress bar and no list of unused weights: the text half of CLIP is all that is wanted."""
    logging = transformers.utils.logging
    level, bar = logging.get_verbosity(), logging.is_progress_bar_enabled()
    logging.set_verbosity_error()
    logging.disable_progress_bar()
    try:
        yield
    finally:
        logging.set_verbosity(level)
        if bar:
            logging.enable_progress_bar()


class PretrainedText:
    """What both towers do with texts: ids, batches, and the rows that were encoded last."""

    def __init__(self, parts: Pretrained, *, length: int, cache: int) -> None:
        self._model, self._tokenizer, self.length = parts.model, parts.tokenizer, length
        self._cache = RowCache(cache)

    @property
    def width(self) -> int:
        """Numbers of a vector."""
        return int(self._model.config.hidden_size)

    def to(self, device: torch.device | str) -> Self:
        """This encoder, moved to another device; its cache is emptied."""
        self._model.to(device)
        self._cache = RowCache(self._cache.size)
        return self

    def encode(self, texts: Sequence[str] | str) -> TextEmbedding:
        """Tokens (rows, words <= length, width), mask (rows, words), pooled (rows, width); long texts are truncated."""
        return stack_rows(self._cache.fetch(as_rows(texts), self._encode), self.width)

    def ids(self, text: str) -> list[int]:
        """Ids of one text with start and end marks, at most `length` (warns where it had to cut)."""
        tokenizer = self._tokenizer
        begin, end = tokenizer.bos_token_id, tokenizer.eos_token_id
        begin, end = (tokenizer.cls_token_id, tokenizer.sep_token_id) if begin is None else (begin, end)
        room = self.length - 2
        pieces = cut(text, lambda part: tokenizer(part, add_special_tokens=False, verbose=False).input_ids, room)
        return [begin, *pieces, end]

    @torch.no_grad()
    def _encode(self, texts: list[str]) -> list[Row]:
        rows: list[Row] = []
        for start in range(0, len(texts), BATCH):
            ids = [self.ids(text) for text in texts[start : start + BATCH]]
            longest = max(map(len, ids))
            padded = torch.tensor([row + [0] * (longest - len(row)) for row in ids])
            real = torch.tensor([[1] * len(row) + [0] * (longest - len(row)) for row in ids])
            rows += self._rows(ids, padded.to(self._model.device), real.to(self._model.device))
        return rows

    def _rows(self, ids: list[list[int]], padded: torch.Tensor, real: torch.Tensor) -> list[Row]:
        """States and pooled vector of each text; real: which ids are no padding."""
        raise NotImplementedError


CLIP = "openai/clip-vit-base-patch32"
HUMANML_LENGTH = 22  # 20 word pieces, start and end: what the HumanML3D and KIT models saw


class ClipText(PretrainedText):
    """tokens: last hidden states after the final norm; pooled: the projected state at the end mark, not normalised.

    The published code pads the ids with zeros to 77 places. The tower is causal and the end mark comes before the
    padding, so nothing here depends on it and the padding is left out.
    """

    name = "clip"

    def __init__(self, parts: Pretrained, *, length: int = HUMANML_LENGTH, cache: int = 1024) -> None:
        config = parts.model.config
        if config.hidden_size != config.projection_dim:
            raise MotionloomError(
                f"This CLIP has states of width {config.hidden_size} and pooled vectors of width "
                f"{config.projection_dim}; name one where they agree, as in {CLIP}."
            )
        places = int(config.max_position_embeddings)
        if not 2 <= length <= places:
            raise ValueError(f"length {length} is not in 2..{places}")
        super().__init__(parts, length=length, cache=cache)

    @staticmethod
    def open(place: Path | str = CLIP, *, length: int = HUMANML_LENGTH) -> "ClipText":
        """Open from a folder or the hub's cache; length counts word pieces with both marks (22 or 77).

        Raises MotionloomError where transformers (extra `clip`) or the files are missing.
        """
        return ClipText(open_pretrained("CLIPTextModelWithProjection", place, extra="clip"), length=length)

    def ids(self, text: str) -> list[int]:
        """Byte-pair ids; what HTML hides is read first, as CLIP does."""
        return super().ids(html.unescape(html.unescape(text)))

    def _rows(self, ids: list[list[int]], padded: torch.Tensor, real: torch.Tensor) -> list[Row]:
        out = self._model(padded)
        return [
            (states[: len(row)].cpu().numpy().copy(), pooled.cpu().numpy())
            for row, states, pooled in zip(ids, out.last_hidden_state, out.text_embeds)
        ]


DISTILBERT = "distilbert/distilbert-base-uncased"


class DistilBert(PretrainedText):
    """tokens: last hidden states, start and end marks included; pooled: their mean, not normalised."""

    name = "distilbert"

    def __init__(self, parts: Pretrained, *, cache: int = 1024) -> None:
        super().__init__(parts, length=int(parts.model.config.max_position_embeddings), cache=cache)

    @staticmethod
    def open(place: Path | str = DISTILBERT) -> "DistilBert":
        """Open from a folder or the hub's cache.

        Raises MotionloomError where transformers (extra `distilbert`) or the files are missing.
        """
        return DistilBert(open_pretrained("DistilBertModel", place, extra="distilbert"))

    def _rows(self, ids: list[list[int]], padded: torch.Tensor, real: torch.Tensor) -> list[Row]:
        out = self._model(padded, attention_mask=real).last_hidden_state
        words = [states[: len(row)].cpu().numpy().copy() for row, states in zip(ids, out)]
        return [(states, states.mean(0)) for states in words]
