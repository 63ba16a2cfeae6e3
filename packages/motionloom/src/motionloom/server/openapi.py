"""What the server answers, as an OpenAPI document and as a plain page made from it; both work without a network.

``openapi.yaml`` is the document but for what depends on requests and limits. `tests/server/test_documents.py` holds it
to the routes that there are, `tests/server/test_client.py` makes a client of it.
"""

import html
import json
from importlib.metadata import version
from typing import Any

from motionloom.requests.export import Export
from motionloom.requests.fields import specs
from motionloom.requests.schema import schema
from motionloom.server.components import components, fixed_document, ref
from motionloom.server.limits import Limits

STYLE = "body{font:16px sans-serif;max-width:50em;margin:2em auto;padding:0 1em}pre{overflow:auto}h2{font-size:1em}"
"""Of the plain page; `policy` lets it in by its hash."""


def document(limits: Limits) -> dict[str, Any]:
    """The OpenAPI document of a server with these limits."""
    found = fixed_document()
    found["info"]["version"] = version("motionloom")
    found["components"]["schemas"] = components(limits)
    exported = found["paths"]["/motions/{id}.{format}"]["get"]["parameters"]
    for name, spec in specs(Export).items():
        if name not in ("motion", "format", "name"):
            kind = ref(name.title()) if spec.words else schema(spec, {})
            about = {"name": name, "in": "query", "required": False, "description": spec.help, "schema": kind}
            exported.append(about)
    return found


def as_page(found: dict[str, Any]) -> str:
    """The document as one page of HTML that needs nothing else."""
    rows = [
        f"<h2><code>{method.upper()} {html.escape(path)}</code></h2><p>{html.escape(about['summary'])}</p>"
        f"<details><summary>in detail</summary><pre>{html.escape(json.dumps(about, indent=1))}</pre></details>"
        for path, methods in found["paths"].items()
        for method, about in methods.items()
    ]
    schemas = html.escape(json.dumps(found["components"]["schemas"], indent=1))
    return (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>motionloom: the server</title><style>{STYLE}</style>"
        f"<h1>motionloom {html.escape(found['info']['version'])}</h1><p>The same as JSON: "
        f"<a href=openapi.json>openapi.json</a></p>{''.join(rows)}<h2>Schemas</h2><pre>{schemas}</pre></html>"
    )
