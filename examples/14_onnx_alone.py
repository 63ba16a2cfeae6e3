"""A motion from words with NumPy and ONNX Runtime alone, as docs/onnx.md describes it: 14_onnx_alone.py WORDS SECONDS
SEED WEIGHTS, the last being the file that `Prior.load()` opens; writes places.npy, (frames, 22, 3) metres at 20 fps."""

import json
import struct
import sys
import unicodedata
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnxruntime

WEIGHTS = Path(__file__).parents[1] / "packages/motionloom/src/motionloom/weights/default.safetensors"
STEPS, GUIDANCE = 24, 2.5
KINDS = {"F32": "<f4", "F16": "<f2", "I8": "i1", "U8": "u1"}


def read_weights(path):
    """Arrays by their names, and the description."""
    data = memoryview(path.read_bytes())
    (size,) = struct.unpack_from("<Q", data)
    head = json.loads(bytes(data[8 : 8 + size]))
    about = json.loads(head.pop("__metadata__")["motionloom"])
    parts = {name: data[8 + size :][slice(*one["data_offsets"])] for name, one in head.items()}
    return {k: np.frombuffer(parts[k], KINDS[one["dtype"]]).reshape(one["shape"]) for k, one in head.items()}, about


def session(arrays, name):
    """One graph, with the arrays that it names as its weights, in float32."""
    graph, weights = arrays[f"graph.{name}"].tobytes(), {}
    for key in (key for key in arrays if key.encode() in graph):
        weights[key] = arrays[key].astype(np.float32)
        if f"{key}.scale" in arrays:
            weights[key] *= arrays[f"{key}.scale"].astype(np.float32)[:, None]
    options = onnxruntime.SessionOptions()
    options.add_external_initializers(list(weights), [*map(onnxruntime.OrtValue.ortvalue_from_numpy, weights.values())])
    return onnxruntime.InferenceSession(graph, options, ["CPUExecutionProvider"])


def word_pieces(text, vocabulary):
    """Numbers of the word pieces: lower case, no accents, apart at spaces and punctuation, longest piece first."""
    ids, spaced, found = {piece: number for number, piece in enumerate(vocabulary)}, "", []
    for letter in unicodedata.normalize("NFD", text.lower()):
        kind, is_plain = unicodedata.category(letter), letter.isalnum() or letter.isspace()
        apart = kind[0] == "P" or (letter.isascii() and not is_plain) or "\u4e00" <= letter <= "\u9fff"
        if kind != "Mn" and (kind[0] != "C" or letter.isspace()):
            spaced += f" {letter} " if apart else letter
    for word in spaced.split():
        pieces, start = [], 0
        while start < len(word) <= 100:
            parts = [("##" if start else "") + word[start:end] for end in range(len(word), start, -1)]
            piece = next((part for part in parts if part in ids), None)
            if piece is None:
                break
            pieces.append(ids[piece])
            start += len(piece.removeprefix("##") if start else piece)
        found += pieces if start == len(word) else [ids["[UNK]"]]
    return [ids["[CLS]"], *found[:62], ids["[SEP]"]]


def encode(arrays, text):
    """States (1, words, 384) of the word pieces, and their mean of length 1 (1, 384)."""
    ids = word_pieces(text, arrays["text.vocabulary"].tobytes().decode().split("\n"))
    rows = arrays["text.words.weight"][ids] * arrays["text.words.weight.scale"][ids].astype(np.float32)[:, None]
    pieces = (rows + arrays["text.places.weight"][: len(ids)].astype(np.float32))[None]
    [states] = session(arrays, "text").run(None, {"pieces": pieces, "mask": np.ones((1, len(ids)), bool)})
    return states, states.mean(axis=1) / np.linalg.norm(states.mean(axis=1))


def sample(arrays, about, text, frames, random):
    """Features (frames, 263), standardised."""
    states, pooled = encode(arrays, text)
    tokens = np.concatenate([states, 0 * states])  # the second row is the motion without words
    said = session(arrays, "bind").run(None, {"pooled": np.concatenate([pooled, 0 * pooled]), "tokens": tokens})
    words = np.array([[True] * tokens.shape[1], [True] + [False] * (tokens.shape[1] - 1)])
    net, patch, top = session(arrays, "prior"), about["net"]["patch"], about["schedule"]["steps"]
    level = np.cos((np.arange(top + 1) / top + 0.008) / 1.008 * np.pi / 2) ** 2
    share = np.cumprod([1.0, *(1 - np.minimum(1 - level[1:] / level[:-1], 0.999))])
    signal, noise, count = np.sqrt(share), np.sqrt(1 - share), -(-frames // patch)
    said += [words, np.ones((2, count), bool), np.zeros((2, count, about["net"]["width"]), np.float32)]
    fixed = dict(zip(("text", "keys", "values", "words", "valid", "shown"), said))
    levels = [round(top * (1 - (i / STEPS) ** 2)) for i in range(STEPS)] + [0]
    x = random.standard_normal((frames, about["net"]["features"]), np.float32)
    for t, s in pairwise(levels):
        state = np.pad(x, ((0, count * patch - frames), (0, 0))).reshape(1, count, -1).repeat(2, axis=0)
        [clean] = net.run(None, fixed | {"state": state, "level": np.full(2, t)})
        with_words, without = clean.reshape(2, count * patch, -1)[:, :frames]
        late = np.clip(1.5 - 5 * t / top, 0, 1)  # guidance rises where little noise is left
        guided = without + (1 + (GUIDANCE - 1) * (1 + 2 * late)) * (with_words - without)
        left = signal[t] * noise[s] / (signal[s] * noise[t])  # how much of the noise stays
        kept = noise[s] * left / noise[t]
        mean = (signal[s] - kept * signal[t]) * guided + kept * x
        x = (mean + noise[s] * np.sqrt(1 - left**2) * random.standard_normal(x.shape, np.float32)).astype(np.float32)
    return x


def places(features):
    """Features (frames, 263) to the places of 22 joints (frames, 22, 3) in metres: +Y up, who faces +Z at first."""
    later = np.concatenate([0 * features[:1, :3], features[:-1, :3]])
    turned = np.exp(2j * np.cumsum(later[:, 0]))  # x and z as one complex number, turned into the world
    root = np.cumsum((later[:, 1] + 1j * later[:, 2]) * turned)
    own = features[:, 4:67].reshape(-1, 21, 3)
    ground = np.column_stack([root, (own[..., 0] + 1j * own[..., 2]) * turned[:, None] + root[:, None]])
    return np.stack([ground.real, np.column_stack([features[:, 3], own[..., 1]]), ground.imag], axis=-1)


def draw(text, seconds=4.0, seed=1, weights=WEIGHTS):
    """Places (frames, 22, 3) of a motion from words."""
    arrays, about = read_weights(Path(weights))
    frames, random = round(float(seconds) * about["fps"]), np.random.Generator(np.random.PCG64(int(seed)))
    x = sample(arrays, about, text, max(frames, 4), random) * arrays["std"] + arrays["mean"]
    x = np.pad(x.astype(np.float64), ((1, 1), (0, 0)), mode="edge")  # smoothed, as a token makes several frames
    return places((x[:-2] + 4 * x[1:-1] + x[2:]) / 6)


if __name__ == "__main__":
    found = draw(*(sys.argv[1:] or ["a person walks forward"]))
    np.save("places.npy", found)
    print(f"places.npy: {len(found)} frames; the pelvis goes {np.linalg.norm(found[-1, 0] - found[0, 0]):.2f} m")
