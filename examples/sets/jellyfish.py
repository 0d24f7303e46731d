# SPDX-License-Identifier: Apache-2.0
"""Three jellyfish among bubbles: skins, morph targets, instances, and a loop of four seconds."""
from __future__ import annotations

import math
import random
from typing import List

from scene_kit.glb import Geometry, Glb
from scene_kit.motion import Animation, Binding, bind, instances, morph, skin
from scene_kit.shapes import graded_wall, lathe, sphere, tube
from scene_kit.vec import X, Y, Z, Vec2, Vec3, Vec4, axis_angle, quat_mul, smoothstep, srgb

DURATION = 4.0
JOINTS = 8  # joints in the chain; the first is at the rim of the bell
REACH = 1.30  # length of the tentacles in metres
# Each animal: name, colour of the bell, place, size, turn, and phase in the cycle.
ANIMALS = (
    ("rose", "#ff7a9c", (0.0, 0.15, 0.0), 1.0, 12.0, 0.0),
    ("amber", "#ffb454", (-1.05, -0.22, -0.55), 0.72, 80.0, 0.37),
    ("sky", "#6cc4ff", (0.98, 0.36, -0.75), 0.80, -35.0, 0.71),
)


def _bell(contraction: float) -> Geometry:
    """Returns a dome with an inner wall, 0.42 m in radius; contraction makes it narrower and higher."""
    wide, high = 0.42 * (1 - 0.30 * contraction), 0.34 * (1 + 0.22 * contraction)
    outer: List[Vec2] = []
    inner: List[Vec2] = []
    for i in range(25):
        a = math.pi / 2 * i / 24
        # The rim curls inward.
        curl = 1 - 0.14 * smoothstep(0.75, 1.0, 1 - i / 24) * (1 + contraction)
        outer.append((wide * math.cos(a) * curl if i < 24 else 0.0, high * math.sin(a)))
        thin = 0.86 + 0.10 * (1 - math.sin(a))
        inside = wide * math.cos(a) * curl * thin if i < 24 else 0.0
        inner.append((inside, high * math.sin(a) * 0.80))
    inner.reverse()
    rim = [inner[-1], outer[0]]
    return lathe([inner, rim, outer], segments=56)


def _tentacles(contraction: float) -> Geometry:
    """Returns eight thin tentacles at the rim and four broad arms in the middle, all hanging straight down."""
    out = Geometry()
    for k in range(12):
        arm = k >= 8
        angle = 2 * math.pi * (k % 8 + (0.5 if arm else 0.0)) / (4 if arm else 8)
        radius = 0.09 if arm else 0.35
        length = REACH * (0.62 if arm else 0.86 + 0.14 * math.sin(5.0 * k))
        steps = 40
        path: List[Vec3] = []
        radii: List[float] = []
        for i in range(steps + 1):
            t = i / steps
            narrow = 1 - 0.30 * contraction * (1 - smoothstep(0.0, 0.6, t))
            wave = (0.02 if arm else 0.035) * math.sin(9.0 * t + 1.7 * k) * t
            path.append(
                (
                    (radius * narrow + wave) * math.cos(angle),
                    (0.06 if arm else 0.02) - length * t,
                    (radius * narrow + wave) * math.sin(angle),
                )
            )
            radii.append((0.034 if arm else 0.011) * (1 - 0.85 * t))
        out.append(tube(path, radii, segments=10))
    return out


def _bindings(geometry: Geometry) -> List[Binding]:
    """Binds each vertex to the joints next above and below it."""
    result: List[Binding] = []
    for _, y, _ in geometry.positions:
        along = min(max(-y / REACH * JOINTS, 0.0), JOINTS - 1.001)
        first = int(along)
        result.append((first, first + 1, along - first))
    return result


def _sway(joint: int, phase: float) -> Vec4:
    """Returns the rotation of a joint in a wave that runs down the chain."""
    angle = 2 * math.pi * (phase - 0.11 * joint)
    bend = 5.0 + 1.8 * joint
    return quat_mul(
        axis_angle(X, bend * math.sin(angle)), axis_angle(Z, 0.7 * bend * math.cos(angle))
    )


def build() -> Glb:
    glb = Glb("Jellyfish")
    times = [DURATION * i / 16 for i in range(17)]
    life = Animation(glb, "swim")

    bell, contracted = _bell(0.0), _bell(1.0)
    tentacles, drawn_in = _tentacles(0.0), _tentacles(1.0)
    stored_bell = glb.store(bell)
    stored_tentacles = bind(glb, glb.store(tentacles), _bindings(tentacles))
    places: List[Vec3] = [(0.0, -REACH * j / JOINTS, 0.0) for j in range(JOINTS)]
    for name, hue, at, size, turn, ahead in ANIMALS:
        skirt = glb.glass(f"{name} bell", hue, 0.30, 0.25)
        threads = glb.glass(f"{name} tentacles", hue, 0.62, 0.45)
        body = glb.node(name, at=at, turn=axis_angle(Y, turn), size=(size, size, size))
        mesh = glb.mesh(f"{name} bell", (stored_bell, skirt))
        morph(glb, mesh, 0, bell, contracted)
        dome = glb.node(f"{name}/bell", mesh, parent=body)
        strands = glb.mesh(f"{name} tentacles", (stored_tentacles, threads))
        morph(glb, strands, 0, tentacles, drawn_in)
        hanging = glb.node(f"{name}/tentacles", strands)
        joints: List[int] = []
        for j in range(JOINTS):
            step: Vec3 = (0.0, -REACH / JOINTS, 0.0) if j else (0.0, 0.0, 0.0)
            above = joints[-1] if joints else body
            joints.append(glb.node(f"{name}/joint {j}", at=step, parent=above))
        skin(glb, f"{name} tentacles", hanging, joints, places)

        # The bell contracts fast and opens slowly. The body rises with each beat, and sinks between beats.
        beats = [(t / DURATION * 2 + ahead) % 1.0 for t in times]
        pulse = [smoothstep(0.0, 0.22, b) * (1 - smoothstep(0.22, 0.9, b)) for b in beats]
        for node in (dome, hanging):
            life.move(node, "weights", times, [[p] for p in pulse])
        for j, joint in enumerate(joints):
            turns = [_sway(j, t / DURATION * 2 + ahead) for t in times]
            life.move(joint, "rotation", times, turns)
        rise: List[List[float]] = []
        for i in range(5):
            angle = 2 * math.pi * (i / 4 + ahead)
            slope = [0.0, 0.10 * math.cos(angle) * 2 * math.pi / DURATION, 0.0]
            rise += [slope, [at[0], at[1] + 0.10 * math.sin(angle), at[2]], slope]
        life.move(body, "translation", [i * DURATION / 4 for i in range(5)], rise, "CUBICSPLINE")

    rng = random.Random(1998)
    film = glb.glass("bubble", "#dff4ff", 0.16, 0.05)
    cloud = glb.node("bubbles", glb.mesh("bubble", (glb.store(sphere(1.0, 20)), film)))
    low, high = (-2.2, -1.5, -1.8), (2.2, 1.4, 0.9)
    everywhere: List[Vec3] = []
    for _ in range(160):
        x, y, z = (rng.uniform(a, b) for a, b in zip(low, high))
        everywhere.append((x, y, z))
    instances(glb, cloud, everywhere, [0.012 + 0.045 * rng.random() ** 3 for _ in everywhere])
    life.move(cloud, "translation", [0.0, DURATION], [[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]])

    water = glb.material("water", roughness=1.0)
    wall = glb.store(graded_wall(6.0, -3.0, 3.0, srgb("#04101f"), srgb("#1f6f8f")))
    glb.node("backdrop", glb.mesh("backdrop", (wall, water)), at=(0.0, 0.0, -3.2))
    glb.perspective("main", (0.35, 0.25, 4.4), (0.0, -0.18, 0.0), math.radians(28.0))
    return glb
