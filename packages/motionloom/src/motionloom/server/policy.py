"""Headers of every answer: what a page of this server may load, who may frame it, and that types are as declared.

The studio's page needs its own files, workers, and the pictures and downloads it makes itself (``blob:``). Nothing else
is loaded: a character that names a picture somewhere on the network does not make the browser ask for it.
"""

import base64
import hashlib

from motionloom.server.openapi import STYLE


def _hashed(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


CONTENT = {
    "default-src": "'none'",
    "script-src": "'self' 'wasm-unsafe-eval'",  # the decoders of packed characters are WebAssembly of the page's own
    "style-src": f"'self' {_hashed(STYLE)}",  # that of /docs is in the page
    "img-src": "'self' blob: data:",
    "media-src": "'self' blob:",
    "font-src": "'self'",
    "connect-src": "'self' blob: data:",  # pictures inside of a character are fetched by such addresses
    "worker-src": "'self' blob:",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}
HEADERS = [
    ("Content-Security-Policy", "; ".join(f"{name} {value}" for name, value in CONTENT.items())),
    ("X-Content-Type-Options", "nosniff"),
    ("Referrer-Policy", "no-referrer"),  # the address of the page may hold the token
]
