"""Do the feature textures hold the features that the network was made for?

A texel's fallback colour is the mean of what the network shows over some directions, so it lies between the least and
the most that the network shows over all of them. Features that were converted, permuted, premultiplied or compressed
show other colours, and fall outside.
"""

import numpy as np

from core.baked import ShaderNetwork
from core.conventions import feature_from_byte
from exporters.check.finding import Findings

TEXELS = 2048  # a sample of a page
DIRECTIONS = 48
TOLERANCE = 3 / 255  # directions between those that are tried, and rounding
# Measured on three trained scenes: at most 0.15 % of the texels as written fall outside; 48 to 98 % with the textures
# exchanged or red and blue of the first swapped, 2 to 19 % of the second, 3 to 67 % after a gamma of 2.2, 1 to 8 % with
# noise of 6 levels, which is what lossy compression adds.
OUTSIDE_SHARE = 0.01
SWAPPED = "red and blue are swapped"
PERMUTATIONS = {
    "the two textures are exchanged": [4, 5, 6, 7, 0, 1, 2, 3],
    f"in the first texture, {SWAPPED}": [2, 1, 0, 3, 4, 5, 6, 7],
    f"in the second texture, {SWAPPED}": [0, 1, 2, 3, 6, 5, 4, 7],
    f"in both textures, {SWAPPED}": [2, 1, 0, 3, 6, 5, 4, 7],
}


def check_features(
    found: Findings, features_u8: np.ndarray, color: np.ndarray, network: ShaderNetwork, name: str
) -> None:
    """Adds a finding if a page's features [h, w, 8] do not show its fallback colours [h, w, 4] (both uint8)."""
    shown = color[..., 3] > 0
    opaque = np.flatnonzero(shown)
    if len(opaque) == 0:
        return
    some = np.random.default_rng(0).choice(opaque, min(TEXELS, len(opaque)), replace=False)
    rows, columns = np.unravel_index(some, shown.shape)
    features, colors = features_u8[rows, columns], color[rows, columns, :3] / 255.0
    tolerance = TOLERANCE + (_step_of(color[shown, :3]) - 1) / 2 / 255
    outside = _outside_share(features, colors, network, tolerance)
    if outside <= OUTSIDE_SHARE:
        return
    premultiplied = [half for half in (0, 1) if _is_premultiplied(features[:, 4 * half : 4 * half + 4])]
    if premultiplied:
        which = " and ".join(("features 0-3", "features 4-7")[half] for half in premultiplied)
        found.error(
            "feature", name, f"must have straight alpha, but {which} are premultiplied: no colour exceeds alpha"
        )
        return
    message = f"must show the fallback's colours, but {100 * outside:.0f} % of the texels cannot"
    found.error("feature", name, f"{message}: {_explanation(features, colors, network, tolerance, outside)}")


def _explanation(
    features: np.ndarray, colors: np.ndarray, network: ShaderNetwork, tolerance: float, outside: float
) -> str:
    shares = {
        text: _outside_share(features[:, order], colors, network, tolerance) for text, order in PERMUTATIONS.items()
    }
    best = min(shares, key=lambda text: shares[text])
    if shares[best] <= OUTSIDE_SHARE and shares[best] < outside / 2:
        return best
    return "the textures were converted or compressed, or the network is another one"


def _outside_share(features_u8: np.ndarray, colors: np.ndarray, network: ShaderNetwork, tolerance: float) -> float:
    """Share of texels whose colour [n, 3] the network shows from no direction."""
    directions = _directions()
    features = np.repeat(feature_from_byte(features_u8)[:, None], len(directions), 1)
    with np.errstate(over="ignore", invalid="ignore"):  # weights may be as large as float32 goes
        shown = np.nan_to_num(network(features, np.broadcast_to(directions, (*features.shape[:2], 3))))
    low, high = shown.min(1) - tolerance, shown.max(1) + tolerance
    return float(((colors < low) | (colors > high)).any(-1).mean())


def _step_of(colors_u8: np.ndarray) -> int:
    """What colours [n, 3] were rounded to multiples of: the least difference of two values of a channel, at least 1."""
    values = (np.flatnonzero(np.bincount(channel, minlength=256)) for channel in colors_u8.T)
    return min((int(np.diff(found).min()) for found in values if len(found) > 1), default=1)


def _is_premultiplied(half: np.ndarray) -> bool:
    """Whether no colour [n, 4] exceeds its alpha, though alpha is not simply full."""
    return bool((half[:, :3] <= half[:, 3:]).all() and (half[:, 3] < 255).mean() > 0.5 and len(half) > 16)


def _directions() -> np.ndarray:
    """[DIRECTIONS + 6, 3] unit vectors: the axes, and points of a spiral over the sphere."""
    n = np.arange(DIRECTIONS) + 0.5
    z, angle = 1 - 2 * n / DIRECTIONS, np.pi * (1 + 5**0.5) * n
    radius = np.sqrt(1 - z * z)
    spiral = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], -1)
    return np.concatenate([spiral, np.eye(3), -np.eye(3)])
