"""Guo's published evaluator: the judge behind nearly every text-to-motion table on HumanML3D.

Source: Guo et al., "Generating Diverse and Natural 3D Human Motions from Text", CVPR 2022. Weights, statistics and word
vectors are the user's own files; `motionloom import finest.tar` writes one file of them.
"""

import itertools
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from torch import Tensor

from motionloom.core.errors import MotionloomError
from motionloom.core.features.representation import Representation, of_width
from motionloom.core.models.container import Container
from motionloom.kinematics.physics import Array
from motionloom_lab.evaluator.evaluators import Caption
from motionloom_lab.papers.guo_nets import UNIT, GuoNets, from_state_dict, read_guo
from motionloom_lab.papers.guo_words import SPECIAL, TAGS, TOKENS, Words, padded, read_array, read_words
from motionloom_train.modules import arrays
from motionloom_train.tensors import tensor

CapLen = Literal["true", "published"]
GUO = Container("evaluator of Guo's", "motionloom", kind="guo-evaluator")
WINDOW = 196
"""Frames to which the published loader fills a clip with zeros."""
CONTACTS = 4
"""Numbers at the end of HumanML3D's and KIT's features that the evaluator is not shown."""
_ROWS = 64
_HEIGHT_TO_POSITIONS = 1.2579
"""HumanML3D's std of the root's height (feature 3) by that of joint positions (4:67): .153766 / .122244."""


@dataclass(frozen=True, eq=False)
class GuoEvaluator:
    """The three networks with what prepares their input; an `Evaluator`.

    mean, std: (features,) the EVALUATOR's statistics (``t2m_mean.npy``, ``t2m_std.npy``). On HumanML3D they differ from
    the data set's Mean and Std: the root (0:4) and the contacts (259:263) are divided by a 25 times smaller number.
    """

    nets: GuoNets
    mean: np.ndarray | None = None
    std: np.ndarray | None = None
    words: Words | None = None
    cap_len: CapLen = "true"
    """``true``: a caption is as long as it is, with sos and eos. ``published``: every caption counts 22 items, as the
    code of priorMDM, and of MDM before January 2024, had it for generated motions; it lowers R-precision and raises
    MM-Dist. Real motions were always measured with the true length."""
    card: Mapping[str, str] = field(default_factory=dict)
    name: str = "guo"

    def __post_init__(self) -> None:
        if self.cap_len not in ("true", "published"):
            raise MotionloomError(f"cap_len is 'true' or 'published', not {self.cap_len!r}")
        if (self.mean is None) != (self.std is None):
            raise MotionloomError("the evaluator needs mean and std together: t2m_mean.npy and t2m_std.npy")
        if self.mean is not None and self.std is not None:
            _check_statistics(self.mean, self.std, self.nets.sizes.channels)
        sizes = self.nets.sizes
        if self.words is not None and (self.words.vectors.shape[1] != sizes.word or sizes.tags != len(TAGS)):
            raise MotionloomError(
                f"the word vectors have {self.words.vectors.shape[1]} numbers and these weights read "
                f"{sizes.word} with {sizes.tags} parts of speech; take GloVe's {sizes.word}"
            )

    @property
    def about(self) -> dict[str, str]:
        """What a report prints: where it comes from and which of the published forks was taken."""
        count = sum(p.numel() for p in self.nets.parameters())
        lengths = {
            "true": "true, with sos and eos",
            "published": f"published: {TOKENS} for every caption, as priorMDM's code had it for generated motions",
        }
        return {
            "networks": f"movement, text and motion encoder of Guo et al. (CVPR 2022), {count:,} parameters",
            **self.card,
            "statistics": _statistics_line(self.mean, self.std),
            "words": _words_line(self.words),
            "caption length": lengths[self.cap_len],
            "frames": f"cut to a multiple of {UNIT}; zeros after the end of clips shorter than {WINDOW}",
        }

    @property
    def representation(self) -> Representation:
        """See `Evaluator`; raises MotionloomError for numbers that nothing here makes, such as KIT's."""
        if self.mean is None:
            raise MotionloomError("this evaluator has no statistics; import it again with --mean and --std")
        return of_width(len(self.mean))

    def with_caption_length(self, cap_len: CapLen) -> "GuoEvaluator":
        """The same evaluator with the other behaviour; report both."""
        return replace(self, cap_len=cap_len)

    def motions(self, features: Sequence[np.ndarray]) -> Array:
        """Motions (frames, features), NOT standardised, as (motions, 512) float64.

        A prior's output is de-normalised with the prior's own statistics first. A row's embedding does not depend on
        the rows beside it. Raises MotionloomError for another width, fewer than 4 frames or values that are not finite.
        """
        frames = [self._length(one) for one in features]
        result = np.zeros((len(frames), self.nets.sizes.width))
        for rows in _chunks(frames):
            lengths = [frames[row] for row in rows]
            after = UNIT if max(lengths) < WINDOW else 0  # the last snippet sees three frames beyond the end
            batch = torch.zeros(len(rows), max(lengths) + after, self.nets.sizes.channels)
            for place, row in enumerate(rows):
                batch[place, : lengths[place]] = torch.from_numpy(self._prepared(features[row]))
            with torch.inference_mode():
                result[rows] = self.nets.motions(batch, lengths).double().numpy()
        return result

    def texts(self, captions: Sequence[Caption]) -> Array:
        """Captions with their tokens as (captions, 512) float64.

        Raises MotionloomError where a caption has no tokens, or the evaluator no word vectors.
        """
        if self.words is None:
            raise MotionloomError(
                "this evaluator has no word vectors and cannot read captions; import it again with --glove"
            )
        result = np.zeros((len(captions), self.nets.sizes.width))
        for first in range(0, len(captions), _ROWS):
            words, tags, lengths = self._sentences(self.words, captions[first : first + _ROWS])
            if self.cap_len == "published":
                lengths = [TOKENS] * len(lengths)
            with torch.inference_mode():
                result[first : first + _ROWS] = self.nets.texts(words, tags, lengths).double().numpy()
        return result

    def _length(self, features: np.ndarray) -> int:
        """The frames that are read, a multiple of 4; MotionloomError where the motion is not of the right form."""
        if self.mean is None:
            raise MotionloomError("this evaluator has no statistics; import it again with --mean and --std")
        motion = np.asarray(features)
        if motion.ndim != 2 or motion.shape[1] != len(self.mean) or len(motion) < UNIT:
            raise MotionloomError(
                f"Guo's evaluator reads motions of {UNIT} or more frames by {len(self.mean)}; got {motion.shape}"
            )
        if motion.dtype.kind != "f" or not np.isfinite(motion).all():
            raise MotionloomError("a motion has values that are no finite numbers; it cannot be judged")
        return len(motion) // UNIT * UNIT

    def _prepared(self, features: np.ndarray) -> np.ndarray:
        """Standardised for the evaluator, without contacts, a whole number of snippets; float32."""
        assert self.mean is not None
        assert self.std is not None
        whole = np.asarray(features)[: len(features) // UNIT * UNIT].astype(np.float64)
        return ((whole - self.mean) / self.std)[:, : self.nets.sizes.channels].astype(np.float32)

    @staticmethod
    def _sentences(words: Words, captions: Sequence[Caption]) -> tuple[Tensor, Tensor, list[int]]:
        """Vectors (captions, 22, 300), one-hot parts of speech (captions, 22, 15), items that count."""
        vectors = torch.zeros(len(captions), TOKENS, words.vectors.shape[1])
        tags = torch.zeros(len(captions), TOKENS, len(TAGS))
        lengths = []
        for row, caption in enumerate(captions):
            if not caption.tokens:
                raise MotionloomError(
                    f"the caption {caption.text[:60]!r} has no tokens; Guo's evaluator reads words with their part "
                    "of speech, as HumanML3D's text files have them"
                )
            tokens, length = padded(caption.tokens)
            for place, token in enumerate(tokens):
                vector, tag = words.look_up(token)
                vectors[row, place] = torch.from_numpy(vector)
                tags[row, place, tag] = 1
            lengths.append(length)
        return vectors, tags, lengths


def tokens_of(line: str) -> tuple[str, ...]:
    """The ``word/POS`` tokens of a line of HumanML3D's text files, ``caption#token token#start#end``.

    Raises MotionloomError for a line of another form.
    """
    parts = line.rstrip("\r\n").split("#")
    if len(parts) != 4:
        raise MotionloomError(f"{line[:60]!r} is no line of a HumanML3D text file: caption#tokens#start#end")
    return tuple(parts[1].split())


def read_published(
    path: Path | str,
    *,
    mean: Path | str | None = None,
    std: Path | str | None = None,
    glove: Path | str | None = None,
    lists: Path | str | None = None,
    card: Mapping[str, str] | None = None,
) -> GuoEvaluator:
    """The evaluator of a published ``finest.tar`` with the user's statistics and word files.

    What is not named is taken from beside the checkpoint where it lies there under its published name: ``t2m_mean.npy``
    and ``t2m_std.npy``, ``our_vab_data.npy`` (also in ``glove/``), ``word_vectorizer.py``. Warns of what is missing or
    looks wrong. Raises MotionloomError for files that are damaged or do not fit.
    """
    path = Path(path)
    nets = from_state_dict(read_guo(path))
    folder = path.parent
    mean = mean or _beside(folder / "t2m_mean.npy")
    std = std or _beside(folder / "t2m_std.npy")
    vectors = _beside(folder / "our_vab_data.npy") or _beside(folder / "glove" / "our_vab_data.npy")
    glove = glove or (vectors.parent if vectors else None)
    if lists and not glove:
        raise MotionloomError(f"{lists} is of use only with word vectors; name them with --glove")
    lists = lists or _beside(folder / "word_vectorizer.py")
    evaluator = GuoEvaluator(
        nets,
        read_array(mean) if mean else None,
        read_array(std) if std else None,
        read_words(glove, lists=lists) if glove else None,
        card={"file": path.name, "licence": "as its authors say", **(card or {})},
    )
    _warn(evaluator)
    return evaluator


def save_guo(evaluator: GuoEvaluator, path: Path | str) -> Path:
    """Write the whole evaluator as one .safetensors file (float32) and give the path back."""
    tensors = {f"net.{k}": v for k, v in arrays(evaluator.nets).items()}
    if evaluator.mean is not None and evaluator.std is not None:
        tensors |= {"mean": evaluator.mean, "std": evaluator.std}
    special = None
    if evaluator.words is not None:
        text = np.frombuffer("\n".join(evaluator.words.names).encode(), dtype=np.uint8)
        tensors |= {"words.text": text, "words.vectors": evaluator.words.vectors.astype(np.float32)}
        special = None if evaluator.words.special is None else dict(evaluator.words.special)
    return GUO.write(path, tensors, {"card": dict(evaluator.card), "special": special})


def is_guo(path: Path | str) -> bool:
    """Whether a file calls itself Guo's evaluator: a ``.tar``, or a .safetensors file that `save_guo` wrote."""
    path = Path(path)
    return path.suffix == ".tar" or (path.suffix == ".safetensors" and GUO.signed(path))


def load_guo(path: Path | str, *, cap_len: CapLen = "true") -> GuoEvaluator:
    """Read an evaluator: `save_guo`'s file, or a published ``.tar`` with its files beside it.

    Raises MotionloomError for a file that is missing, damaged, of another kind or of a newer format.
    """
    path = Path(path)
    if path.suffix == ".tar":
        return read_published(path).with_caption_length(cap_len)
    if not path.is_file():
        raise MotionloomError(f"there is no evaluator {path}")
    about, tensors = GUO.read(path)
    with GUO.parsing(path):
        special = about["special"]
        if not _texts(about["card"]) or not (special is None or _texts(special)):
            raise ValueError("values of the wrong kind")
        if not set((special or {}).values()) <= set(SPECIAL):
            raise ValueError("an unknown class of words")
    nets = from_state_dict({key[4:]: tensor(value) for key, value in tensors.items() if key.startswith("net.")})
    mean, std = (tensors[key].astype(np.float64) if key in tensors else None for key in ("mean", "std"))
    return GuoEvaluator(nets, mean, std, _words(path, tensors, special), cap_len, about["card"])


def _texts(values: object) -> bool:
    return isinstance(values, dict) and all(isinstance(v, str) for v in [*values, *values.values()])


def _words(path: Path, tensors: Mapping[str, np.ndarray], special: dict[str, str] | None) -> Words | None:
    if "words.text" not in tensors:
        return None
    try:
        names = tensors["words.text"].astype(np.uint8).tobytes().decode().split("\n")
        return Words(tuple(names), tensors["words.vectors"].astype(np.float32), special)
    except (KeyError, ValueError, RuntimeError) as error:
        if isinstance(error, MotionloomError):
            raise
        raise MotionloomError(f"{path} has word vectors that cannot be read; import it again") from None


def _beside(path: Path) -> Path | None:
    return path if path.is_file() else None


def _check_statistics(mean: np.ndarray, std: np.ndarray, channels: int) -> None:
    sizes = (channels, channels + CONTACTS)
    if mean.shape != std.shape or mean.ndim != 1 or len(mean) not in sizes:
        raise MotionloomError(
            f"mean and std must both be {sizes[0]} or {sizes[1]} numbers for these weights; "
            f"got shapes {mean.shape} and {std.shape}"
        )
    if not (np.isfinite(mean).all() and np.isfinite(std).all() and (std > 0).all()):
        raise MotionloomError("mean and std must be finite and std above zero; name t2m_mean.npy and t2m_std.npy")


def _root_weight(std: np.ndarray) -> float:
    """How many times more the root weighs than with HumanML3D's own Std: 25 in ``t2m_std.npy``, 1 in ``Std.npy``."""
    return float(_HEIGHT_TO_POSITIONS * std[4:67].mean() / std[3])


def _statistics_line(mean: np.ndarray | None, std: np.ndarray | None) -> str:
    if mean is None or std is None:
        return "none: motions cannot be read"
    if len(std) != 263:
        return f"{len(std)} numbers"
    return f"263 numbers; the root weighs {_root_weight(std):.3g} times what it does by HumanML3D's Std"


def _words_line(words: Words | None) -> str:
    if words is None:
        return "none: captions cannot be read"
    lists = "no special words: parts of speech stay as tagged, which is not the published input"
    if words.special is not None:
        lists = f"{len(words.special)} special words override the part of speech"
    return f"{len(words.names):,} vectors of {words.vectors.shape[1]}; {lists}"


def _warn(evaluator: GuoEvaluator) -> None:
    std, words = evaluator.std, evaluator.words
    if std is not None and len(std) == 263 and _root_weight(std) < 5:
        warnings.warn(
            "these statistics do not weigh the root as the evaluator's do (25 times); they look like the data set's "
            "Mean.npy and Std.npy, with which every number changes: name t2m_mean.npy and t2m_std.npy",
            stacklevel=3,
        )
    if words is not None and words.special is None:
        warnings.warn(
            "no lists of special words are given, so parts of speech stay as tagged, which is not the published input: "
            "name word_vectorizer.py with --vip",
            stacklevel=3,
        )


def _chunks(lengths: Sequence[int]) -> Iterator[list[int]]:
    """Rows of like length together; rows with nothing after their end only with others of exactly their length."""
    order = sorted(range(len(lengths)), key=lambda row: lengths[row])
    for _, group in itertools.groupby(order, key=lambda row: lengths[row] if lengths[row] >= WINDOW else 0):
        rows = list(group)
        yield from (rows[first : first + _ROWS] for first in range(0, len(rows), _ROWS))
