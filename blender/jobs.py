"""What is asked of the server, and its answer: no Blender in here, so that it runs in a thread of its own."""

import threading
import time

import numpy as np

from . import glb
from .client import Problem
from .reach import reached

POLL = 0.2
"""Seconds between two looks at a job."""


class Goal:
    """Where a joint is to be: joint: the server's name; points: (seconds, (3,) of Blender's world), rising."""

    def __init__(self, joint, points, label):
        self.joint, self.points, self.label = joint, points, label


class Plan:
    """All that a new motion is made of.

    bodies: one `Body` or two. words: (text, text of the second person or "", seconds) one after the other.
    fps: of the scene. path: (points, 3) of Blender's world, or None; closed: back to the first point; facing: "along"
    or "free". goals: of the first body. poses: (seconds, (joints, 4, 4) of Blender's world) of the first body.
    seed, count, loop, steps, guidance, root: as the server has them.
    """

    def __init__(self, bodies, words, fps):
        self.bodies, self.words, self.fps = bodies, words, fps
        self.path, self.closed, self.facing, self.goals, self.poses = None, False, "along", [], []
        self.seed, self.count, self.loop, self.steps, self.guidance, self.root = 0, 1, False, 24, 2.5, "motion"

    @property
    def seconds(self):
        """Of the whole."""
        return sum(seconds for *_, seconds in self.words)


class Take:
    """One motion that was made: its seed, a `Moves` for each body, and what was remarked."""

    def __init__(self, seed, moves, remarks):
        self.seed, self.moves, self.remarks = seed, moves, remarks


class Job(threading.Thread):
    """Work that asks a server, with progress from 0 to 1, and a way to cancel it.

    work: called with the client and the job; what it returns becomes `result`, a `Problem` becomes `error`.
    """

    def __init__(self, client, work):
        super().__init__(daemon=True)
        self.client, self.work = client, work
        self.progress, self.error, self.result, self.cancelled = 0.0, "", None, False

    def run(self):
        try:
            self.result = self.work(self.client, self)
        except Problem as problem:
            self.error = str(problem)
        except Exception as error:
            self.error = f"The add-on failed ({type(error).__name__}: {error}); this is a fault of the program"

    def ask(self, body):
        """The job of the server, once it is done. Raises `Problem` where it failed or was cancelled."""
        made = self.client.json("POST", "/jobs", body | {"levels": False})
        while True:
            state = self.client.json("GET", f"/jobs/{made['id']}")
            self.progress = float(state["progress"])
            if state["state"] == "done":
                return state
            if state["state"] in ("failed", "cancelled"):
                raise Problem(state["error"] or "Cancelled: nothing was changed")
            if self.cancelled:
                self.client.json("DELETE", f"/jobs/{made['id']}")
                raise Problem("Cancelled: nothing was changed")
            time.sleep(POLL)


def generate(plan):
    """The work that makes a plan's takes."""

    def work(client, job):
        for body in plan.bodies:
            body.settle(client)
            body.stage = plan.bodies[0]
        state = job.ask(request(client, plan))
        return [_take(client, plan, result, state["remarks"]) for result in state["results"]]

    return work


def redo(body, before, span, *, prompt, settings):
    """The work that makes some seconds of a motion anew.

    body, before: an armature and its `Moves` (of Blender's frames), in the server's world once the body is settled:
    ``before`` is (world matrices, fps). span: seconds from and to. prompt: words, or empty. settings: seed, count,
    steps, guidance as the server has them.
    """

    def work(client, job):
        body.settle(client)
        moves = body.moves(*before)
        data = glb.pack(body.names, body.parents, body.inside(body.rest_places), motion=moves)
        sent = client.send("motions", "before.glb", data)
        asked = {"task": "edit", "motion": sent["id"], "between": [list(span)], **settings}
        state = job.ask(asked | ({"prompt": prompt} if prompt else {}))
        return [
            Take(one["seed"], [glb.unpack(client.ask("GET", f"/motions/{one['id']}.npz"))], state["remarks"])
            for one in state["results"]
        ]

    return work


# Requests


def request(client, plan):
    """The job of a plan, as JSON; poses are sent to the server first."""
    found = {"seed": plan.seed, "count": plan.count, "loop": plan.loop, "steps": plan.steps, "guidance": plan.guidance}
    goals = _goals(client, plan)
    two = len(plan.bodies) > 1
    words = [{"text": f"{one} :: {other}" if two and other else one, "seconds": sec} for one, other, sec in plan.words]
    task = "duet" if two else "control" if goals else "generate" if len(words) == 1 else "compose"
    if len(words) == 1:
        found |= {"task": task, "prompt": words[0]["text"], "seconds": words[0]["seconds"]}
        return found | ({"goals": goals} if goals else {})
    timeline = {"segments": words}
    if goals and not two:
        return found | {"task": task, "timeline": timeline, "goals": goals}
    return found | {"task": task, "timeline": timeline | ({"path": goals} if goals else {})}


def _goals(client, plan):
    """Path, joints and poses in the world of the server's person, whose legs have another length than the body's."""
    body, found = plan.bodies[0], {}
    if plan.path is not None:
        points = body.inside(plan.path)[:, [0, 2]] / body.scale
        found["path"] = {"points": points.round(5).tolist(), "facing": plan.facing, "closed": plan.closed}
    if plan.goals:
        found["joints"] = [
            {
                "joint": goal.joint,
                "points": [
                    {"time": round(time, 4), "position": (body.inside(place) / body.scale).round(5).tolist()}
                    for time, place in goal.points
                ],
            }
            for goal in plan.goals
        ]
    if plan.poses:
        poses = body.moves(np.array([pose for _, pose in plan.poses] + [plan.poses[-1][1]]), 20.0)
        data = glb.pack(body.names, body.parents, body.inside(body.rest_places), motion=poses)
        name = client.send("motions", "poses.glb", data)["id"] + ".npz"
        found["poses"] = [
            {"time": round(time, 4), "from": name, "at": number / 20}
            | ({} if "path" in found else _stand(body, poses, number))
            for number, (time, _) in enumerate(plan.poses)
        ]
    return found


def _stand(body, poses, frame):
    """Where the person of a pose is and faces, as goals have it."""
    place = {
        joint: np.mean([poses.places[frame, poses.names.index(bone)] for bone in body.joints[joint]], axis=0)
        for joint in ("pelvis", "left_hip", "right_hip", "left_shoulder", "right_shoulder")
    }
    left = place["left_hip"] - place["right_hip"] + place["left_shoulder"] - place["right_shoulder"]
    facing = np.degrees(np.arctan2(-left[2], left[0]))
    position = (place["pelvis"][[0, 2]] / body.scale).round(5).tolist()
    return {"position": position, "facing": round(float(facing), 3)}


# Answers


def _take(client, plan, result, remarks):
    """A result of the server on the plan's bodies."""
    moves, said = [], [*remarks, *result["remarks"]]
    for number, body in enumerate(plan.bodies):
        where = f"/motions/{result['id']}.npz?skeleton={body.id}&root={plan.root}&person={number}"
        moves.append(glb.unpack(client.ask("GET", where)))
        if len(plan.bodies) > 1:
            _stand_unscaled(body, moves[-1])
    first = plan.bodies[0]
    frames = int((len(moves[0]) - 1) / moves[0].fps * plan.fps + 1e-6) + 1
    moves = [one.of(plan.fps, frames) for one in moves]
    moves[0], missed = reached(first, moves[0], plan.goals)
    return Take(result["seed"], moves, [*said, *missed] if plan.goals else said)


def _stand_unscaled(body, moves):
    """Of two people, bodies of any size begin where the server's person does: only their own way is scaled."""
    start = moves.places[0, moves.names.index(body.bone("pelvis") or body.names[0])]
    moves.places += start * [1.0, 0.0, 1.0] * (1.0 / body.scale - 1.0)
