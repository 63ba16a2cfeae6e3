"""What the panel's buttons do. From a script the same operators wait until they are done."""

import time

import bpy

from . import actions, bodies, jobs, rigify, scene, settings, takes
from .client import SERVER, Problem

SHARE = 0.1
"""Seconds of work between two looks at the window."""


class Running:
    """What is going on now, for the panel."""

    job, share, said, wrong = None, 0.0, "", False


def tell(context, sentence, *, wrong=False):
    """Show a sentence in the panel."""
    Running.said, Running.wrong = sentence, wrong
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            area.tag_redraw()


class Working:
    """An operator with work at the server, then in the scene: waits where a script calls it, else goes on beside.

    `prepare` gives the server's work, `apply` is a generator that puts its result into the scene and hands out shares.
    """

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    beside = False
    """Whether it goes on beside the window."""

    @classmethod
    def poll(cls, context):
        """One at a time."""
        return Running.job is None

    def execute(self, context):
        """Wait for all of it."""
        try:
            self.begin(context)
            self.job.join()
            for _ in self.result(context):
                pass
        except Problem as problem:
            return self.failed(context, problem)
        finally:
            Running.job = None
        return {"FINISHED"}

    def invoke(self, context, event):
        """Go on beside the window."""
        self.beside = True
        try:
            self.begin(context)
        except Problem as problem:
            return self.failed(context, problem)
        self.timer = context.window_manager.event_timer_add(SHARE, window=context.window)
        self.left = None
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Look at the work a few times a second."""
        writing = self.left is not None  # nothing may be changed or undone meanwhile: what is written to would be gone
        if event.type != "TIMER":
            self.job.cancelled = self.job.cancelled or (writing and event.type == "ESC")
            return {"RUNNING_MODAL"} if writing else {"PASS_THROUGH"}
        try:
            if self.job.is_alive():
                Running.share = self.job.progress
                tell(context, Running.said)
                return {"PASS_THROUGH"}
            self.left = self.left or self.result(context)
            until = time.monotonic() + SHARE
            for share in self.left:
                Running.share = share
                if self.job.cancelled:
                    self.left.close()
                    raise Problem("Cancelled: nothing was changed")
                if time.monotonic() > until:
                    tell(context, "Writing the motion (Esc cancels)")
                    return {"RUNNING_MODAL"}
        except Problem as problem:
            return self.ended(context, self.failed(context, problem))
        except Exception as error:
            self.ended(context, None)
            tell(context, f"The add-on failed ({error}); this is a fault of the program", wrong=True)
            raise
        return self.ended(context, {"FINISHED"})

    def begin(self, context):
        """Start the server's work."""
        self.job = jobs.Job(settings.client(), self.prepare(context))
        Running.job, Running.share = self.job, 0.0
        tell(context, "Working")
        self.job.start()

    def result(self, context):
        """Put what came into the scene, share by share."""
        if self.job.error:
            raise Problem(self.job.error)
        yield from self.apply(context, self.job.result)

    def failed(self, context, problem):
        """Say what was wrong; nothing was changed."""
        wanted = Running.job is not None and Running.job.cancelled and self.beside
        Running.job = None
        tell(context, str(problem), wrong=not wanted)
        self.report({"INFO" if wanted else "ERROR"}, str(problem))
        return {"CANCELLED"}

    def ended(self, context, answer):
        """Stop looking."""
        context.window_manager.event_timer_remove(self.timer)
        Running.job = None
        tell(context, Running.said, wrong=Running.wrong)
        return answer


def armature_of(body):
    """The armature that a body was read from. Raises `Problem` where it is gone."""
    found = bpy.data.objects.get(body.name)
    if found is None:
        raise Problem(f"{body.name} is no longer there: the motion was made and is left out")
    return found


def keys_of(body, moves, first):
    """Generator of shares; returns the `actions.Keys` of a motion on a body's armature."""
    armature = armature_of(body)
    if not body.rigify:
        yield 0.0
        return actions.keys_of(armature, body, moves, first)
    with actions.Still(armature):
        return (yield from rigify.keys_of(armature, body, moves, first))


class MOTIONLOOM_OT_generate(Working, bpy.types.Operator):
    """Make motion of the words, on the selected armature"""

    bl_idname, bl_label = "motionloom.generate", "Generate"

    def prepare(self, context):
        """The plan is read now: what is changed later counts next time."""
        self.plan = scene.plan_of(context)
        self.start = context.scene.motionloom.start
        return jobs.generate(self.plan)

    def apply(self, context, found):
        """An action for each take and person."""
        own, plan = context.scene.motionloom, self.plan
        keys = []  # of all, before anything is changed, so that it may be cancelled
        for take in found:
            for body, moves in zip(plan.bodies, take.moves):
                keys.append((yield from keys_of(body, moves, self.start)))
        keys, last = iter(keys), self.start + len(found[0].moves[0]) - 1
        for take in found:
            name, parts = f"{plan.words[0][0][:40]} #{take.seed}", []
            for body in plan.bodies:
                armature = armature_of(body)
                who = f"{armature.name}: " if len(plan.bodies) > 1 else ""
                action = actions.new_action(armature, who + name, next(keys))
                action.use_frame_range, action.use_cyclic = True, plan.loop
                action.frame_start, action.frame_end = self.start, last
                parts.append((armature, action))
            pieces = self.pieces(len(take.moves[0]))
            takes.add(own, name, seed=take.seed, parts=parts, remarks=take.remarks, pieces=pieces)
        own.take_at = len(own.takes) - len(found)
        context.scene.frame_end = max(context.scene.frame_end, last)
        remarks = own.takes[own.take_at].remark
        tell(context, f"{len(found)} {'take' if len(found) == 1 else 'takes'}" + (f": {remarks}" if remarks else ""))

    def pieces(self, frames):
        """(words, first, last frame) of each block."""
        found, at, last = [], 0.0, self.start + frames - 1
        for text, _, seconds in self.plan.words:
            begin, at = self.start + round(at * self.plan.fps), at + seconds
            found.append([text[:60], begin, min(self.start + round(at * self.plan.fps), last)])
        return found


class MOTIONLOOM_OT_redo(Working, bpy.types.Operator):
    """Make the frames of a range anew; what is before and behind them stays as it is"""

    bl_idname, bl_label = "motionloom.redo", "Redo frames"

    def prepare(self, context):
        """The motion is read from the armature, whoever made it."""
        own = context.scene.motionloom
        self.stretch = scene.Stretch(context)
        asked = {"seed": own.seed, "count": own.count, "steps": own.steps, "guidance": own.guidance}
        before = (self.stretch.poses, scene.rate(context.scene))
        return jobs.redo(self.stretch.body, before, self.stretch.span, prompt=own.redo_text.strip(), settings=asked)

    def apply(self, context, found):
        """A copy of the action for each take, other in these frames."""
        own, stretch = context.scene.motionloom, self.stretch
        armature, action = armature_of(stretch.body), bpy.data.actions.get(stretch.action)
        if action is None:
            raise Problem(f"{stretch.action} is no longer there: nothing was changed")
        pieces = takes.pieces_of(own, action)
        low, high = stretch.first - stretch.begin, stretch.last - stretch.begin + 1
        keys = []
        for take in found:
            keys.append((yield from keys_of(stretch.body, take.moves[0].part(low, high), stretch.first)))
        for take, own_keys in zip(found, keys):
            name = f"{own.redo_text.strip()[:40] or action.name} {stretch.first}-{stretch.last} #{take.seed}"
            made = actions.replaced(armature, action, name, actions.alike(armature, action, own_keys))
            takes.add(own, name, seed=take.seed, parts=[(armature, made)], remarks=take.remarks, pieces=pieces)
        own.take_at = len(own.takes) - len(found)
        tell(context, f"Frames {stretch.first} to {stretch.last} are new")


class MOTIONLOOM_OT_cancel(bpy.types.Operator):
    """Stop what is being made; nothing is changed"""

    bl_idname, bl_label = "motionloom.cancel", "Cancel"

    @classmethod
    def poll(cls, context):
        """While something is being made."""
        return Running.job is not None

    def execute(self, context):
        """The work ends at its next look."""
        Running.job.cancelled = True
        return {"FINISHED"}


class MOTIONLOOM_OT_start(Working, bpy.types.Operator):
    """Start 'motionloom serve' on this computer"""

    bl_idname, bl_label = "motionloom.start", "Start server"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def prepare(self, context):
        """The process starts now; the work is to wait for it."""
        own = settings.preferences()
        bodies.forget()
        SERVER.start(bpy.path.abspath(own.command), settings.client(), bpy.path.abspath(own.folder))
        return lambda client, job: SERVER.wait(client)

    def apply(self, context, found):
        """Say that it is there."""
        tell(context, f"The server answers at {settings.preferences().address}")
        yield 1.0


class MOTIONLOOM_OT_stop(bpy.types.Operator):
    """End the server that was started here"""

    bl_idname, bl_label = "motionloom.stop", "Stop server"

    @classmethod
    def poll(cls, context):
        """Where one runs."""
        return SERVER.running

    def execute(self, context):
        """End it."""
        SERVER.stop()
        tell(context, "The server was stopped")
        return {"FINISHED"}


CLASSES = (
    MOTIONLOOM_OT_generate,
    MOTIONLOOM_OT_redo,
    MOTIONLOOM_OT_cancel,
    MOTIONLOOM_OT_start,
    MOTIONLOOM_OT_stop,
)
