"""The BERT encoder (Devlin et al. 2019): post-norm transformer layers over word, place and segment embeddings."""

import torch
from torch import Tensor, nn
from torch.nn import functional as F

EPSILON = 1e-12


class Layer(nn.Module):
    """Self-attention and feed-forward, each added to its input and then normalised."""

    def __init__(self, width: int, heads: int, hidden: int) -> None:
        super().__init__()
        self.heads, self.scale = heads, (width // heads) ** -0.5
        self.attention_in = nn.Linear(width, 3 * width)  # query, key and value stacked
        self.attention_out = nn.Linear(width, width)
        self.attention_norm = nn.LayerNorm(width, EPSILON)
        self.hidden_in = nn.Linear(width, hidden)
        self.hidden_out = nn.Linear(hidden, width)
        self.hidden_norm = nn.LayerNorm(width, EPSILON)

    def forward(self, x: Tensor, allowed: Tensor | None) -> Tensor:
        rows, words, width = x.shape
        parts = self.attention_in(x).view(rows, words, 3, self.heads, width // self.heads)
        query, key, value = parts.permute(2, 0, 3, 1, 4)
        mixed = F.scaled_dot_product_attention(query, key, value, attn_mask=allowed, scale=self.scale)
        x = self.attention_norm(x + self.attention_out(mixed.transpose(1, 2).reshape(rows, words, width)))
        return self.hidden_norm(x + self.hidden_out(F.gelu(self.hidden_in(x))))


class Bert(nn.Module):
    """ids (rows, words) and mask (rows, words; True = real) -> last hidden states (rows, words, width).

    The embedding tables hold no values until a state dict is loaded.
    """

    def __init__(self, *, vocabulary: int, places: int, width: int, heads: int, hidden: int, layers: int) -> None:
        super().__init__()
        # Tables are left undrawn: drawing normal numbers on torch's meta device costs a second of imports.
        self.words = nn.Embedding.from_pretrained(torch.empty(vocabulary, width))
        self.places = nn.Embedding.from_pretrained(torch.empty(places, width))  # segment 0 is already added
        self.norm = nn.LayerNorm(width, EPSILON)
        self.layers = nn.ModuleList(Layer(width, heads, hidden) for _ in range(layers))

    def forward(self, ids: Tensor, mask: Tensor) -> Tensor:
        allowed = None if bool(mask.all()) else mask[:, None, None, :]
        return self.layered(self.words(ids) + self.places.weight[: ids.shape[1]], allowed)

    def layered(self, pieces: Tensor, allowed: Tensor | None) -> Tensor:
        """Embedded word pieces (rows, words, width) to hidden states; allowed: (rows, 1, 1, words) or None."""
        x = self.norm(pieces)
        for layer in self.layers:
            x = layer(x, allowed)
        return x


def from_huggingface(weights: dict[str, Tensor], *, places: int) -> dict[str, Tensor]:
    """Rename a Hugging Face `BertModel` state into `Bert`'s: fuse query, key and value; fold in segment 0."""
    start = "embeddings."
    out = {
        "words.weight": weights[start + "word_embeddings.weight"],
        "places.weight": weights[start + "position_embeddings.weight"][:places]
        + weights[start + "token_type_embeddings.weight"][0],
        "norm.weight": weights[start + "LayerNorm.weight"],
        "norm.bias": weights[start + "LayerNorm.bias"],
    }
    names = {
        "attention_out": "attention.output.dense",
        "attention_norm": "attention.output.LayerNorm",
        "hidden_in": "intermediate.dense",
        "hidden_out": "output.dense",
        "hidden_norm": "output.LayerNorm",
    }
    layers = len({key.split(".")[2] for key in weights if key.startswith("encoder.layer.")})
    for index in range(layers):
        source, target = f"encoder.layer.{index}.", f"layers.{index}."
        for kind in ("weight", "bias"):
            parts = [weights[f"{source}attention.self.{part}.{kind}"] for part in ("query", "key", "value")]
            out[f"{target}attention_in.{kind}"] = torch.cat(parts)
            for ours, theirs in names.items():
                out[f"{target}{ours}.{kind}"] = weights[f"{source}{theirs}.{kind}"]
    return out
