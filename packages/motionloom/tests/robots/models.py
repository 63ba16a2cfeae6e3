"""Small humanoid robots as MJCF, written here: boxes, capsules, and the joint names of well-known robots."""

from collections.abc import Sequence

UNITREE = (
    "{side}_hip_pitch_joint",
    "{side}_hip_roll_joint",
    "{side}_hip_yaw_joint",
    "{side}_knee_joint",
    "{side}_ankle_pitch_joint",
    "{side}_ankle_roll_joint",
    "waist_yaw_joint",
    "{side}_shoulder_pitch_joint",
    "{side}_shoulder_roll_joint",
    "{side}_shoulder_yaw_joint",
    "{side}_elbow_joint",
)
"""Legs pitch, roll, yaw, knee, ankle pitch and roll; waist; arms pitch, roll, yaw, elbow: G1, H1-2."""
H1 = (
    "{side}_hip_yaw_joint",
    "{side}_hip_roll_joint",
    "{side}_hip_pitch_joint",
    "{side}_knee_joint",
    "{side}_ankle_joint",
    "",
    "torso_joint",
    "{side}_shoulder_pitch_joint",
    "{side}_shoulder_roll_joint",
    "{side}_shoulder_yaw_joint",
    "{side}_elbow_joint",
)
"""Ankles of one hinge, and the waist is called torso."""
FOURIER = (
    "{side}_hip_pitch_joint",
    "{side}_hip_roll_joint",
    "{side}_hip_yaw_joint",
    "{side}_knee_pitch_joint",
    "{side}_ankle_roll_joint",
    "{side}_ankle_pitch_joint",
    "waist_yaw_joint",
    "{side}_shoulder_pitch_joint",
    "{side}_shoulder_roll_joint",
    "{side}_shoulder_yaw_joint",
    "{side}_elbow_pitch_joint",
)
"""N1."""
BOOSTER = (
    "{Side}_Hip_Pitch",
    "{Side}_Hip_Roll",
    "{Side}_Hip_Yaw",
    "{Side}_Knee_Pitch",
    "{Side}_Ankle_Pitch",
    "{Side}_Ankle_Roll",
    "Waist",
    "{Side}_Shoulder_Pitch",
    "{Side}_Shoulder_Roll",
    "{Side}_Elbow_Pitch",
    "{Side}_Elbow_Yaw",
)
ENGINEAI = (
    "J00_HIP_PITCH_{S}",
    "J01_HIP_ROLL_{S}",
    "J02_HIP_YAW_{S}",
    "J03_KNEE_PITCH_{S}",
    "J04_ANKLE_PITCH_{S}",
    "J05_ANKLE_ROLL_{S}",
    "J12_WAIST_YAW",
    "J13_SHOULDER_PITCH_{S}",
    "J14_SHOULDER_ROLL_{S}",
    "J15_SHOULDER_YAW_{S}",
    "J16_ELBOW_PITCH_{S}",
)
ATLAS = (
    "{s}_leg_hpy",
    "{s}_leg_hpx",
    "{s}_leg_hpz",
    "{s}_leg_kny",
    "{s}_leg_aky",
    "{s}_leg_akx",
    "back_bkz",
    "{s}_arm_shz",
    "{s}_arm_shx",
    "{s}_arm_shy",
    "{s}_arm_ely",
)
NAMELESS = (*(f"m{i}_{{s}}x" for i in range(6)), "m6", *(f"m{i}_{{s}}x" for i in range(7, 11)))
"""Motors with numbers alone: the shape has to say which is which."""


def humanoid(names: Sequence[str] = UNITREE, *, size: float = 1.0, free: str = "<freejoint/>", extra: str = "") -> str:
    """A robot 1.1 m tall, times ``size``, that stands with straight legs, its arms hanging, its elbows straight;
    without the hinges whose names are empty."""

    def joint(number: int, side: str, axis: str, span: str) -> str:
        if not names[number]:
            return ""
        name = names[number].format(side=side, Side=side.title(), s=side[0], S=side[0].upper())
        return f'<joint name="{name}" axis="{axis}" range="{span}"/>'

    def at(x: float, y: float, z: float) -> str:
        return f'pos="{x * size} {y * size} {z * size}"'

    def limb(*, length: float, thick: float = 0.03) -> str:
        ends = f"0 0 0 0 0 {-length * size}"
        return f'<geom type="capsule" fromto="{ends}" size="{thick * size}" contype="0" conaffinity="0"/>'

    sides = (("left", 1.0), ("right", -1.0))
    mirrored = {"left": "-0.5 2.2", "right": "-2.2 0.5"}
    legs = "".join(
        f"""
        <body name="{side}_thigh_a" {at(0, 0.1 * y, -0.05)}>{joint(0, side, "0 1 0", "-2 1.2")}{_ball()}
        <body name="{side}_thigh_b">{joint(1, side, "1 0 0", "-0.8 0.8")}{_ball()}
        <body name="{side}_thigh_c">{joint(2, side, "0 0 1", "-1 1")}{limb(length=0.3)}
        <body name="{side}_shin_a" {at(0, 0, -0.3)}>{joint(3, side, "0 1 0", "0 2.4")}{limb(length=0.3)}
        <body name="{side}_foot_a" {at(0, 0, -0.3)}>{joint(4, side, "0 1 0", "-0.9 0.6")}{_ball()}
        <body name="{side}_foot_b">{joint(5, side, "1 0 0", "-0.4 0.4")}
        <geom type="box" size="{0.1 * size} {0.04 * size} {0.02 * size}" {at(0.04, 0, -0.03)} friction="1"/>
        </body></body></body></body></body></body>"""
        for side, y in sides
    )
    arms = "".join(
        f"""
        <body name="{side}_arm_a" {at(0, 0.16 * y, 0.3)}>{joint(7, side, "0 1 0", "-3 1.5")}{_ball()}
        <body name="{side}_arm_b">{joint(8, side, "1 0 0", mirrored[side])}{_ball()}
        <body name="{side}_arm_c">{joint(9, side, "0 0 1", "-1.6 1.6")}{limb(length=0.2)}
        <body name="{side}_fore_a" {at(0, 0, -0.2)}>{joint(10, side, "0 1 0", "-2.2 0")}{limb(length=0.2)}
        <body name="{side}_palm" {at(0, 0, -0.2)}>{_ball()}</body>
        </body></body></body></body>"""
        for side, y in sides
    )
    return f"""<mujoco model="tin"><compiler angle="radian"/><worldbody>
      <body name="base" {at(0, 0, 0.7)}>{free}
        <geom type="box" size="{0.08 * size} {0.1 * size} {0.05 * size}"/>{legs}
        <body name="chest" {at(0, 0, 0.05)}>{joint(6, "left", "0 0 1", "-1.5 1.5")}
        <geom type="box" size="{0.08 * size} {0.12 * size} {0.12 * size}" {at(0, 0, 0.18)}/>{arms}{extra}</body>
      </body></worldbody></mujoco>"""


def _ball() -> str:
    return '<geom type="sphere" size="0.02" contype="0" conaffinity="0"/>'


def on_legs(count: int) -> str:
    """A robot on so many legs of three hinges, and nothing else."""
    legs = "".join(
        f"""<body name="leg{i}" pos="{0.2 * (i // 2) - 0.2} {0.2 * (-1) ** i} 0">
        <joint name="a{i}" axis="1 0 0" range="-1 1"/>
        <geom type="sphere" size="0.02"/><body name="mid{i}"><joint name="b{i}" axis="0 1 0" range="-1 1"/>
        <geom type="sphere" size="0.02"/><body name="low{i}" pos="0 0 -0.2">
        <joint name="c{i}" axis="0 1 0" range="-2 2"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02"/></body></body></body>"""
        for i in range(count)
    )
    body = f'<body name="trunk" pos="0 0 0.4"><freejoint/><geom type="box" size="0.3 0.1 0.05"/>{legs}</body>'
    return f"<mujoco><compiler angle='radian'/><worldbody>{body}</worldbody></mujoco>"


def on_wheels() -> str:
    """A box on four wheels that turn without end."""
    wheels = "".join(
        f'<body name="w{i}" pos="{0.2 * (-1) ** (i // 2)} {0.2 * (-1) ** i} 0"><joint name="wheel{i}" axis="0 1 0"/>'
        '<geom type="cylinder" size="0.05 0.02"/></body>'
        for i in range(4)
    )
    body = f'<body name="cart" pos="0 0 0.1"><freejoint/><geom type="box" size="0.3 0.1 0.05"/>{wheels}</body>'
    return f"<mujoco><worldbody>{body}</worldbody></mujoco>"
