"""Does the motion do what the words say? Twenty prompts in everyday words, each with a check by physics.

A check is data: bounds on the numbers of :func:`motionloom.lab.metrics.actions.measure`, all of which must hold.
The bounds were set by looking at real clips of the action and of all other actions; ``words`` finds such clips by their
captions, so that anybody can count again how many real clips pass and how many wrong ones slip through
(docs/evaluate.md).
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from motionloom.errors import MotionloomError
from motionloom.kinematics.physics import Array
from motionloom.kinematics.wholeness import ENOUGH
from motionloom.lab.metrics.actions import Measures, measure

_INFINITY = float("inf")


@dataclass(frozen=True)
class Bound:
    """A range for one measure."""

    measure: str
    why: str
    """The reason, in plain words."""
    low: float = -_INFINITY
    high: float = _INFINITY

    def holds(self, measures: Measures) -> bool:
        """True where the measure lies in the range, ends included."""
        return self.low <= measures[self.measure] <= self.high

    def wanted(self) -> str:
        """The range as text, such as ``advance >= 1.2``."""
        if self.low == -_INFINITY:
            return f"{self.measure} <= {self.high:g}"
        lower = f"{self.measure} >= {self.low:g}"
        return lower if self.high == _INFINITY else f"{lower} and <= {self.high:g}"


WHOLE = Bound("whole", "the body is a person's: pelvis, trunk, head, knees and elbows", low=ENOUGH)
"""Every check of every set asks for this first; somebody who is folded obeys nothing."""


@dataclass(frozen=True)
class Check:
    """One prompt and what a body must do to obey it."""

    name: str
    prompt: str
    seconds: float
    """Length to generate."""
    paraphrases: tuple[str, ...]
    """The same prompt in other words."""
    limits: tuple[Bound, ...]
    words: str
    """Pattern of captions of real clips that show the action."""
    unless: str = r"(?!)"
    """Pattern of captions that say too much or too little to count as a pure example."""
    related: str = r"(?!)"
    """Pattern of captions of clips that may rightly pass as well; they count neither for nor against."""

    @property
    def bounds(self) -> tuple[Bound, ...]:
        """The limits, and the one that holds for everybody: a whole body."""
        return (*self.limits, WHOLE)

    def measured(self, positions: Array, fps: float) -> Measures:
        """All numbers of one motion, (frames, 22, 3) metres, at ``fps`` frames per second."""
        return measure(positions, fps)

    def obeyed(self, measures: Measures) -> bool:
        """True where every bound holds."""
        return all(bound.holds(measures) for bound in self.bounds)

    def failed(self, measures: Measures) -> tuple[Bound, ...]:
        """The bounds that do not hold."""
        return tuple(bound for bound in self.bounds if not bound.holds(measures))

    def role(self, captions: Sequence[str]) -> str:
        """What a real clip with these captions is to this check: ``example``, ``related`` or ``other``."""
        texts = [caption.lower() for caption in captions]
        hits = sum(bool(re.search(self.words, text)) for text in texts)
        if 2 * hits >= len(texts) > 0 and not any(re.search(self.unless, text) for text in texts):
            return "example"
        loose = f"{self.words}|{self.related}"
        return "related" if any(re.search(loose, text) for text in texts) else "other"


_GOES = Bound("travel", "somebody who goes somewhere leaves the spot", low=1.0)
_STAYS = Bound("travel", "it is done on the spot or with a few steps", high=2.0)
_MANY = r"then|danc|salsa|ballet|while|and (turn|sit|jump|climb|kick|wave)"
_LOCOMOTION = r"walk|\brun|jog|sprint|dash|strid|step|march|stroll|dribbl|danc|salsa|turn|skip"

CHECKS: tuple[Check, ...] = (
    Check(
        "walk forward",
        "a person walks forward",
        4.0,
        ("someone is walking straight ahead", "a man strolls forwards"),
        (
            Bound("advance", "a few steps cover more than a metre", low=1.2),
            Bound("facing_share", "the way gone is where the chest points", low=0.8),
            Bound("top_pace", "faster than 2.1 m/s people run", high=2.1),
            Bound("jump_rise", "walking never leaves the floor", high=0.12),
        ),
        words=r"\bwalk|strid|stroll",
        unless=r"back|sideway|circle|turn|run|jog|jump|hop|ladder|stair|step|climb|dribbl|"
        r"punch|kick|karate|left|right|side to side|stop|sit|cartwheel|pretend|balanc|bounc|" + _MANY,
        related=_LOCOMOTION,
    ),
    Check(
        "walk backward",
        "a person walks backwards",
        4.0,
        ("someone steps back several times", "a man is walking in reverse"),
        (
            Bound("advance", "a few steps back cover most of a metre", high=-0.8),
            Bound("facing_share", "the way gone is away from the chest", high=-0.75),
        ),
        words=r"walk[- ]backw|walks? back\b|backward|reverse",
        unless=r"then|danc|circle|forward|salsa|sit|turn",
        related=r"back|salsa|danc",
    ),
    Check(
        "walk sideways",
        "a person walks sideways",
        4.0,
        ("someone side steps to the left", "a man shuffles to the side"),
        (
            Bound("sidestep", "a few side steps cover most of a metre", low=0.7),
            Bound("side_share", "most of the way is across the chest", low=0.6),
        ),
        words=r"sideways",
        unless=r"danc|arabesque|up to the|angle|then|^walks sideways to",
        related=r"walk (left|right)|side|danc|salsa",
    ),
    Check(
        "run",
        "a person runs forward",
        3.0,
        ("someone sprints ahead", "a man is running fast"),
        (
            Bound("top_pace", "people walk at less than 2 m/s", low=2.0),
            Bound("facing_share", "the way gone is where the chest points", low=0.7),
            _GOES,
        ),
        words=r"\brun|sprint|\bdash",
        unless=r"jog|walk|stop|jump|leap|duck|roll|crouch|over\b|hump|side|hand|" + _MANY,
        related=r"\brun|jog|sprint|dash|leap|skip|dart|race|roll",
    ),
    Check(
        "jog",
        "a person jogs slowly",
        3.0,
        ("someone is jogging along", "a man goes for an easy jog forward"),
        (
            Bound("top_pace", "a jog is faster than a walk and slower than a sprint", low=1.9, high=4.2),
            Bound("facing_share", "the way gone is where the chest points", low=0.7),
            _GOES,
        ),
        words=r"\bjog",
        unless=r"jack|stretch|twist|on the spot|squat|" + _MANY,
        related=r"\brun|jog|sprint|dash|leap|skip|dart|race|roll",
    ),
    Check(
        "jump",
        "a person jumps up",
        3.0,
        ("someone leaps into the air with both feet", "a man jumps up and down"),
        (
            Bound("jump_rise", "the body leaves its usual height by a hand's length", low=0.15),
            Bound("jump_clearance", "both feet leave the floor by a hand's width", low=0.12),
        ),
        words=r"\bjump",
        unless=r"jack|run|walk|basket|shot|climb|hop|sit|down from|playground|cover|balanc|" + _MANY,
        related=r"jump|\bhop|leap|jete|skip|cartwheel",
    ),
    Check(
        "hop",
        "a person hops on one leg",
        4.0,
        ("someone is hopping on the left foot", "a man jumps several times on his right leg"),
        (Bound("hops", "the same foot takes off and lands at least twice while the other is held up", low=2),),
        words=r"(hop|jump)[a-z]* .*\b(one|left|right|each) (foot|leg)",
        unless=r"danc",
        related=r"\bhop|jump",
    ),
    Check(
        "turn left",
        "a person turns to the left",
        4.0,
        ("someone makes a left turn", "a man walks and turns left"),
        (Bound("turn", "half of a quarter turn or more, to the left", low=45.0, high=300.0),),
        words=r"turn[- ]left|left turn|turns? (to (the|his|their|her) )?left",
        unless=r"climb|sit|arm|head|step|right|danc",
        related=r"turn|circle|clockwise|spin|twirl|twist|rotat|danc|salsa|ballet|pirouette|around|left|pivot",
    ),
    Check(
        "turn right",
        "a person turns to the right",
        4.0,
        ("someone makes a right turn", "a man walks and turns right"),
        (Bound("turn", "half of a quarter turn or more, to the right", low=-300.0, high=-45.0),),
        words=r"turn[- ]right|right turn|turns? (to (the|his|their|her) )?right",
        unless=r"climb|sit|arm|head|step|left|danc",
        related=r"turn|circle|clockwise|spin|twirl|twist|rotat|danc|salsa|ballet|pirouette|around|right|pivot",
    ),
    Check(
        "walk in a circle",
        "a person walks in a circle",
        8.0,
        ("someone walks around in a big circle", "a man is going round in a circle"),
        (
            Bound("winding", "the path bends round by three quarters of a circle or more", low=270.0),
            Bound("travel", "a circle that can be walked is two metres long or more", low=2.0),
            Bound("facing_share", "the way gone is where the chest points, for most of it", low=0.5),
        ),
        words=r"walk[a-z]* (around )?in an? [a-z\- ]*circle",
        unless=r"semi|half|danc",
        related=r"circle|around|turn|danc|salsa",
    ),
    Check(
        "punch",
        "a person punches",
        4.0,
        ("someone throws a punch", "a man is boxing"),
        (
            Bound("punch_speed", "a fist shoots away from the body at chest height", low=1.4),
            Bound("top_pace", "the arms of a runner do not count", high=2.0),
        ),
        words=r"\bpunch|\bboxing",
        unless=r"kick|danc|stance|walk|playing",
        related=r"punch|box|strik|karate|martial|fight|oiduki|heian|syutouuke",
    ),
    Check(
        "kick",
        "a person kicks",
        4.0,
        ("someone kicks a ball", "a man does a karate kick"),
        (
            Bound("kick", "a foot in front or at the side is well above the other", low=0.18),
            Bound("kick_speed", "a kick is faster than a step", low=4.0),
        ),
        words=r"\bkick|geri\b",
        unless=r"punch|squat|danc|robot",
        related=r"kick|karate|martial|fight|heian|soccer",
    ),
    Check(
        "wave",
        "a person waves with one hand",
        4.0,
        ("someone waves hello", "a man raises his hand and waves goodbye"),
        (
            Bound("wave_swings", "a raised hand goes to and fro twice", low=4),
            Bound("hand_over_neck", "the waving hand is near shoulder height or above", low=-0.25),
            _STAYS,
        ),
        words=r"\bwav(e|es|ing)\b|byebye|bye,|goodbye",
        unless=r"heavy|danc|animal|object|rotate|point",
        related=r"wav|\bbye|traffic|flap|swing|shak",
    ),
    Check(
        "raise both arms",
        "a person raises both arms",
        3.0,
        ("someone lifts both hands up", "a man puts his arms in the air"),
        (
            Bound("arms_raised", "both wrists stay up at the shoulders or above for a third of a second", low=0.3),
            _STAYS,
        ),
        words=r"raise[a-z]* (up )?both|both (arms|hands) (up|in the air|over)|lifts? both (arms|hands)",
        unless=r"leg|danc",
        related=r"rais|arms|both hands|hands (up|in the air|over|above)|climb|hang|reach|jack|jumpshot|shoot",
    ),
    Check(
        "bend down",
        "a person bends down",
        4.0,
        ("someone bends over", "a man bows forward"),
        (
            Bound("bend", "the back leans forward by more than a quarter of a right angle", low=26.0),
            _STAYS,
        ),
        words=r"\bbow\b|bends? (over|down|forward)|picks? .* up from|picks up something",
        unless=r"danc|jack|jump|box|laugh",
        related=r"\bbend|\bbow|pick|squat|crouch|roll|duck|cartwheel|fold|curl|hunch|mop|stretch|kneel",
    ),
    Check(
        "sit down",
        "a person sits down",
        5.0,
        ("someone takes a seat on a chair", "a man sits down and stays seated"),
        (
            Bound("pelvis_low", "on a seat the hips are clearly lower than standing", high=0.85),
            Bound("low_seconds", "somebody who sits stays down for a second", low=1.0),
            Bound("low_still", "who sits does not move about", high=0.15),
            Bound("bend_when_low", "the back is upright on a seat", high=45.0),
            Bound("feet_ahead_when_low", "the feet are in front of the hips, not under them", low=0.1),
        ),
        words=r"\bsits?\b|\bsitting|seat",
        unless=r"climb|playground|danc|hang|roof|ladder",
        related=r"\bsit|seat|squat|crouch|curl",
    ),
    Check(
        "dance",
        "a person dances",
        6.0,
        ("someone is dancing to music", "a man dances the salsa"),
        (
            Bound("leg_energy", "the feet keep moving", low=0.3),
            Bound("arm_energy", "the arms keep moving", low=0.25),
            Bound("turning", "the body keeps turning this way and that", low=12.0),
            Bound("facing_share", "a dancer does not simply walk ahead", low=-0.8, high=0.8),
            Bound("rise", "a dance stays on one floor", high=0.35),
        ),
        words=r"danc|salsa|ballet|ballerina",
        unless=r"pose|robot|walks? forward|teapot|mimick|flap|moves their arms|random",
        related=r"danc|salsa|ballet|ballerina|twirl|pirouette|arabesque|jete",
    ),
    Check(
        "climb",
        "a person climbs up a ladder",
        6.0,
        ("someone climbs up the stairs", "a man is climbing up steps"),
        (Bound("rise", "both feet end up clearly higher than they were", low=0.35),),
        words=r"climb",
        unless=r"down the|position|danc|hang|swing",
        related=r"climb|stair|ladder|steps? up|upstairs|hang|playground|acrobatics",
    ),
    Check(
        "stand still",
        "a person stands still",
        4.0,
        ("someone is standing and not moving", "a man stands in place"),
        (
            Bound("mean_stir", "the joints hardly move", high=0.1),
            Bound("hand_speed", "the hands rest", high=0.4),
            Bound("travel", "nobody goes anywhere", high=0.3),
            Bound("turn", "nobody turns round", low=-30.0, high=30.0),
            Bound("pelvis_low", "it is standing, not sitting", low=0.85),
        ),
        words=r"stands? still|standing still|standing in place|static|poses? in",
        unless=r"danc|while|then|folded",
        related=r"stand|still|pose|balanc",
    ),
    Check(
        "crouch",
        "a person squats down",
        4.0,
        ("someone crouches low", "a man goes down into a squat and comes up again"),
        (
            Bound("pelvis_low", "the hips come well down towards the heels", high=0.8),
            Bound("knees", "both knees are bent by about a right angle", low=80.0),
            Bound("low_seconds", "the hips are down for a third of a second", low=0.3),
        ),
        words=r"crouch|squat",
        unless=r"danc|fight|while|karate|stance",
        related=r"crouch|squat|\bsit|duck|roll|curl",
    ),
)


def check(name: str) -> Check:
    """The check called ``name``; an error lists them all."""
    for candidate in CHECKS:
        if candidate.name == name:
            return candidate
    raise MotionloomError(f"no check called {name!r}; the checks are {', '.join(c.name for c in CHECKS)}")


def check_of(prompt: str) -> Check | None:
    """The one check that a prompt belongs to: by its own words or a paraphrase, else where it names one action alone.

    None for prompts of other actions, of several, and of actions done in a way that no check looks at.
    """
    said = " ".join(prompt.lower().split()).rstrip(".!")
    for candidate in CHECKS:
        if said in (candidate.prompt, *candidate.paraphrases):
            return candidate
    fitting = [candidate for candidate in CHECKS if candidate.role([said]) == "example"]
    return fitting[0] if len(fitting) == 1 else None


def obeys(prompt: str, positions: Array, fps: float) -> bool | None:
    """Whether a motion does what its prompt says, by the check of `check_of`; None where no check knows the prompt.

    positions: (frames, 22, 3) metres on the uniform person, the floor near y = 0.
    """
    found = check_of(prompt)
    return None if found is None else found.obeyed(found.measured(positions, fps))
