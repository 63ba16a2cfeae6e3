"""The model that the SDK's server serves: its capabilities, and requests handed to the worker."""

import asyncio
import logging
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from motionmcp import Backbone, ModelSpec, MotionResult, ProtocolError, build_app
from motionmcp.backbone import Limits as ModelLimits
from motionmcp.schemas import GenerateRequest, Skeleton

from motionloom.requests.sampling import Sampling
from motionloom.requests.shared import LONGEST
from motionloom.server.job_request import JobRequest
from motionloom.server.mmcp.rigs import canonical
from motionloom.server.refusal import Refusal
from motionloom.server.worker import Worker

MODEL = "motionloom"
CONSTRAINTS = ["root_path", "effector_target", "pose_keyframe", "ground_height"]
SEGMENTS = ["text", "unconditioned", "pose", "motion_reference"]
PAGES = ("/docs", "/docs/oauth2-redirect", "/redoc")
log = logging.getLogger("motionloom.server")


class MotionloomBackbone(Backbone):
    """Requests sampled by the server's one worker, in their turn."""

    model_id = MODEL

    def __init__(self, worker: Worker) -> None:
        self.worker = worker
        limits = worker.limits
        self.spec = ModelSpec(
            id=MODEL,
            fps=20.0,
            canonical_skeleton=Skeleton.model_validate({"joints": canonical()}),
            supports_retargeting=True,
            supports_joint_translation=True,
            supports_loop=True,
            supported_constraints=CONSTRAINTS,
            supported_segments=SEGMENTS,
            native_clip_seconds=10.0,
            chunking="stitched",
            recommended_max_duration_seconds=30.0,
            limits=ModelLimits(
                max_duration_seconds=LONGEST,
                max_num_samples=limits.count,
                max_prompt_length=limits.prompt,
                max_request_bytes=limits.body_bytes,
                max_batch_size=8,
                max_reference_frames=3600,
                max_video_bytes=None,
                max_video_seconds=None,
            ),
        )

    def capabilities(self) -> ModelSpec:
        """What is served at ``/capabilities``."""
        return self.spec

    async def generate(self, request: GenerateRequest) -> MotionResult:
        """Answer a request; raises `ProtocolError` with the library's sentence."""
        from motionloom.server.mmcp.drawing import Answer, answer

        answers: list[Answer] = []

        def call(models: Any, progress: Callable[[int, int], None]) -> Iterator[Any]:
            answers.extend(answer(models, request, progress))
            return iter(())

        order = JobRequest("generate", None, Sampling(count=1), call=call)
        try:
            job = self.worker.submit(order, "mmcp")
        except Refusal as refusal:
            code = "rate_limited" if refusal.status == 429 else "resource_exhausted"
            raise ProtocolError(code, refusal.sentence) from None
        try:
            await job.ended()
        except asyncio.CancelledError:
            self.worker.cancel(job)
            raise
        if job.state != "done":
            mistake = not (job.error or "").startswith("the server failed")
            raise ProtocolError(
                "invalid_request" if mistake else "internal_error", job.error or "the job was cancelled"
            )
        (result,) = answers
        return MotionResult(
            rotations=result.rotations.astype(np.float32),
            root_translations=result.root.astype(np.float32),
            translations=None if result.translations is None else result.translations.astype(np.float32),
            trajectories=[None] * len(result.root) if result.root.shape[1] == 1 else None,  # a pose goes nowhere
            chunk_boundaries=result.boundaries,
            canonical_to_request=result.names or None,
            notes=result.notes,
        )


def application(worker: Worker) -> Any:
    """The SDK's application over the worker, without its pages: they load scripts from elsewhere, which
    the server's policy lets no page do."""
    app = build_app(MotionloomBackbone(worker), title="motionloom, MMCP")
    app.router.routes[:] = [one for one in app.router.routes if getattr(one, "path", "") not in PAGES]
    return app
