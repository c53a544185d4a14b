"""The sample's object: a glazed teapot and cup, and a blossoming branch in a copper vase, on an inlaid table.

It has what makes view synthesis hard: fine texture (wave pattern, wood grain, inlay), thin parts (bail, twigs, petals,
stretchers), and surfaces that change with the view (glaze, copper, tea). Everything lies within [-1.2, 1.2]³, z up.
"""

from __future__ import annotations

import numpy as np

from core.sample.design import Design
from core.sample.kernels import (
    BARK,
    CERAMIC_INSIDE,
    COPPER,
    GLAZE,
    GOLD,
    GRIP,
    INLAY,
    LEAF,
    PETAL,
    TEA,
    TURNED_WOOD,
)
from core.sample.mesh import Mesh, joined
from core.sample.shapes import ball, lathe, leaf, resampled, smooth_curve, tube

TABLE_Z = -0.44


def still_life(design: Design) -> Mesh:
    """The whole mesh of a design, about 60,000 vertices."""
    rng = np.random.default_rng([design.seed, 1])
    teapot = _teapot().rotated(_turn_z(design.spout_rad)).moved([-0.22, -0.10, TABLE_Z])
    cup = _cup().moved([0.56, -0.40, TABLE_Z])
    vase = _vase().moved([0.42, 0.46, TABLE_Z])
    branch = _branch(design, rng).moved([0.42, 0.46, TABLE_Z + 0.40])
    return joined([_table(), teapot, cup, vase, branch])


def _table() -> Mesh:
    """A round top on a turned column's worth of thin legs, tied by a copper ring."""
    z = TABLE_Z
    edge = [
        (0.0, z - 0.07),
        (0.9, z - 0.07),
        (0.975, z - 0.06),
        (1.0, z - 0.035),
        (0.99, z - 0.01),
        (0.975, z),
        (0.0, z),
    ]
    parts = [lathe(resampled(edge, 0.018), INLAY, 144)]
    apron = [
        (0.66, z - 0.07),
        (0.70, z - 0.085),
        (0.70, z - 0.13),
        (0.66, z - 0.145),
        (0.62, z - 0.13),
        (0.62, z - 0.07),
    ]
    parts.append(lathe(resampled(apron, 0.02), TURNED_WOOD, 96))
    for angle in np.arange(4) * np.pi / 2 + 0.4:
        outward = np.array([np.cos(angle), np.sin(angle), 0.0])
        foot = outward * 0.80 + [0, 0, z - 0.54]
        top = outward * 0.64 + [0, 0, z - 0.10]
        path = np.linspace(top, foot, 40)
        parts.append(tube(path, _turning(np.linspace(0, 1, 40)), TURNED_WOOD, 14))
        parts.append(ball(foot, 0.036, COPPER, 14))
    angle = np.linspace(0, 2 * np.pi, 97)
    ring = np.stack([0.735 * np.cos(angle), 0.735 * np.sin(angle), np.full(97, z - 0.32)], -1)
    parts.append(tube(ring, 0.016, COPPER, 10))
    return joined(parts)


def _turning(t: np.ndarray) -> np.ndarray:
    """A leg's radius along its length: beads and a taper."""
    bead = 0.014 * np.exp(-(((t - 0.18) / 0.03) ** 2)) + 0.012 * np.exp(-(((t - 0.30) / 0.02) ** 2))
    return 0.046 - 0.022 * t + bead + 0.012 * np.exp(-(((t - 0.72) / 0.03) ** 2))


def _teapot() -> Mesh:
    outside = smooth_curve(
        [(0.0, 0.0), (0.24, 0.0), (0.27, 0.03), (0.40, 0.12), (0.49, 0.28), (0.46, 0.44), (0.34, 0.55), (0.23, 0.59)],
        64,
    )
    outside[:, 0] = np.maximum(outside[:, 0], 0)
    lid = smooth_curve([(0.25, 0.585), (0.252, 0.605), (0.20, 0.64), (0.10, 0.675), (0.03, 0.69)], 24)
    knob = smooth_curve([(0.03, 0.685), (0.025, 0.71), (0.055, 0.74), (0.05, 0.775), (0.0, 0.79)], 20)
    parts = [lathe(outside, GLAZE, 128), lathe(lid, GLAZE, 96), lathe(knob, COPPER, 24)]
    rim = np.linspace(0, 2 * np.pi, 97)
    parts.append(tube(np.stack([0.24 * np.cos(rim), 0.24 * np.sin(rim), np.full(97, 0.59)], -1), 0.014, COPPER, 8))

    spout = smooth_curve([(0.40, 0, 0.20), (0.53, 0, 0.25), (0.61, 0, 0.38), (0.66, 0, 0.50), (0.74, 0, 0.57)], 40)
    radii = np.interp(np.linspace(0, 1, 40), [0, 0.3, 0.75, 1], [0.12, 0.085, 0.05, 0.046])
    parts.append(tube(spout, radii, GLAZE, 28))
    inner = spout[::-1][:14]
    parts.append(_reversed(tube(inner, np.full(14, 0.036), CERAMIC_INSIDE, 20)))
    lip = tube(spout[-2:] + (spout[-1] - spout[-2]) * np.array([[0.0], [0.4]]), np.array([0.046, 0.036]), COPPER, 28)
    parts.append(lip)

    arc = np.linspace(-0.14, np.pi + 0.14, 90)
    bail = np.stack([0.42 * np.cos(arc), np.zeros(90), 0.53 + 0.55 * np.sin(arc)], -1)
    parts.append(tube(bail, 0.017, COPPER, 10))
    parts.append(tube(bail[28:62], _rounded(34, 0.034), GRIP, 14))
    for end in (bail[0], bail[-1]):
        parts.append(ball(end, 0.036, COPPER, 16))
    return joined(parts)


def _cup() -> Mesh:
    outside = smooth_curve([(0.0, 0.0), (0.10, 0.0), (0.11, 0.025), (0.165, 0.08), (0.20, 0.18), (0.205, 0.245)], 32)
    inside = smooth_curve([(0.205, 0.245), (0.198, 0.252), (0.190, 0.245), (0.185, 0.18), (0.15, 0.09)], 24)
    tea = np.stack([np.linspace(0.188, 0.0, 16), np.full(16, 0.205)], -1)
    saucer = smooth_curve(
        [(0.0, 0.0), (0.16, 0.0), (0.29, 0.035), (0.30, 0.042), (0.29, 0.046), (0.15, 0.012), (0, 0.012)], 40
    )
    outside[:, 0], saucer[:, 0] = np.maximum(outside[:, 0], 0), np.maximum(saucer[:, 0], 0)
    ear = smooth_curve([(0.20, 0, 0.21), (0.26, 0, 0.22), (0.285, 0, 0.16), (0.25, 0, 0.09), (0.17, 0, 0.085)], 30)
    cup = [
        lathe(outside, GLAZE, 72),
        lathe(inside, CERAMIC_INSIDE, 72),
        lathe(tea, TEA, 48),
        tube(ear, 0.017, GLAZE, 10),
    ]
    return joined([lathe(saucer, CERAMIC_INSIDE, 96), joined(cup).rotated(_turn_z(-0.9)).moved([0, 0, 0.014])])


def _vase() -> Mesh:
    outside = smooth_curve(
        [
            (0.0, 0.0),
            (0.10, 0.0),
            (0.115, 0.02),
            (0.15, 0.10),
            (0.14, 0.19),
            (0.07, 0.28),
            (0.055, 0.35),
            (0.085, 0.40),
        ],
        56,
    )
    inside = smooth_curve([(0.085, 0.40), (0.075, 0.40), (0.047, 0.35), (0.06, 0.28), (0.1, 0.2)], 24)
    outside[:, 0] = np.maximum(outside[:, 0], 0)
    return joined([lathe(outside, COPPER, 64), lathe(inside, COPPER, 48)])


def _branch(design: Design, rng: np.random.Generator) -> Mesh:
    """A main stem that leans over the teapot, with twigs, leaves and cherry blossoms."""
    stem = smooth_curve(
        [(0.03, 0.02, -0.12), (-0.01, 0, 0.12), (0.02, 0.05, 0.40), (-0.12, 0.03, 0.68), (-0.38, -0.02, 0.93)], 70
    )
    parts = [tube(stem, np.linspace(0.022, 0.007, 70), BARK, 10)]
    tips = [stem[-1]]
    heading = 0.0
    for index in range(design.twigs):
        at = stem[int(np.interp(index, [0, design.twigs - 1], [24, 62]))]
        heading += 2.4 + rng.uniform(-0.3, 0.3)  # about the golden angle, as on real twigs
        reach = rng.uniform(0.16, 0.30) * (1.15 - 0.5 * index / design.twigs)
        side = np.array([np.cos(heading), np.sin(heading), 0.0])
        twig = smooth_curve([at, at + 0.5 * reach * side + [0, 0, 0.35 * reach], at + reach * side + [0, 0, reach]], 16)
        parts.append(tube(twig, np.linspace(0.010, 0.005, 16), BARK, 7))
        tips.append(twig[-1])
        parts.append(_leaf_at(twig[8], heading + 0.9, rng))
    parts += [_leaf_at(stem[index], rng.uniform(0, 6.28), rng) for index in (20, 34, 44, 58)]
    for tip in tips:
        parts.append(_blossom(rng).moved(tip))
        parts.append(_blossom(rng, 0.75).moved(tip + rng.normal(0, 1, 3) * [0.05, 0.05, 0.03] - [0, 0, 0.06]))
    return joined(parts)


def _leaf_at(position: np.ndarray, heading: float, rng: np.random.Generator) -> Mesh:
    shape = leaf(rng.uniform(0.17, 0.24), rng.uniform(0.07, 0.09), 0.9, LEAF, widest=0.42)
    return shape.rotated(_turn_z(heading) @ _turn_y(-rng.uniform(0.1, 0.7))).moved(position)


def _blossom(rng: np.random.Generator, size: float = 1.0) -> Mesh:
    petals = []
    for index in range(5):
        petal = leaf(0.085 * size, 0.078 * size, 0.5, PETAL, notch=0.22, widest=0.62)
        petals.append(petal.rotated(_turn_z(index * 2 * np.pi / 5 + rng.uniform(-0.1, 0.1)) @ _turn_y(-0.45)))
    heart = [ball([0, 0, 0.012 * size], 0.016 * size, GOLD, 8)]
    tilt = _turn_z(rng.uniform(0, 6.28)) @ _turn_y(rng.uniform(0.1, 1.2))
    return joined([*petals, *heart]).rotated(tilt)


def _rounded(count: int, radius: float) -> np.ndarray:
    """Radii of a tube that closes at both ends."""
    t = np.linspace(-1, 1, count)
    return radius * np.maximum(1 - t**8, 0) ** 0.5


def _reversed(mesh: Mesh) -> Mesh:
    """The inside of a surface."""
    return Mesh(mesh.positions, -mesh.normals, mesh.uv, mesh.material, mesh.faces[:, ::-1].copy())


def _turn_z(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def _turn_y(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1.0, 0], [-s, 0, c]])
