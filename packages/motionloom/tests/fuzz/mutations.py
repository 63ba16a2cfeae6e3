"""How files are damaged: by what they are made of. Every mutation is a function of the bytes and a random generator."""

import random

from tests.fuzz.container_mutations import (
    NPY,
    PICKLE,
    SAFETENSORS,
    bomb,
    directory,
    glb,
    in_zip,
    npy,
    pickled,
    torch_member,
)
from tests.fuzz.plain_mutations import JSON, LARGEST, RAW, TEXT, Mutation, json_lines, unpacked, xml


def mutated(data: bytes, kind: str, rng: random.Random) -> bytes:
    """The bytes of a file of this kind, damaged one to four times."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        try:
            data = rng.choice(KINDS[kind])(data, rng)
        except Exception:
            data = rng.choice(RAW)(data, rng)  # damaged beyond its structure by the mutation before
        data = data[:LARGEST]
    return data


KINDS: dict[str, list[Mutation]] = {
    "raw": RAW,
    "text": TEXT,
    "json": JSON,
    "jsonl": [json_lines, json_lines, *TEXT],
    "jsonl.gz": [unpacked([json_lines, *TEXT]), unpacked([json_lines, *TEXT]), *RAW],
    "npy": NPY,
    "npz": [in_zip(lambda name: NPY), in_zip(lambda name: NPY), in_zip(lambda name: NPY), bomb, directory, *RAW, *RAW],
    "pickled npz": [in_zip(lambda name: [pickled, npy, *RAW]), in_zip(lambda name: PICKLE), directory, *RAW],
    "safetensors": SAFETENSORS,
    "glb": [glb, glb, glb, *RAW],
    "pickle": PICKLE,
    "torch": [in_zip(torch_member), in_zip(torch_member), directory, directory, *RAW],
    "old torch": PICKLE,
    "svg": [xml, *TEXT],
}
"""By the kind of file."""
