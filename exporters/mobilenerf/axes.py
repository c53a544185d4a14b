"""The two axis conventions of the layout, and the frame that a scene's OBJ files are in.

The files do not say which one they follow; the viewer must be the right one.

z-up      The OBJ holds (x, z, -y) of the object frame, which is glTF's frame, and the viewer turns directions back
          before they enter the network. Synthetic and unbounded scenes (view_synthetic.html, view_unbounded.html).
forward   The OBJ's frame is the network's. The viewer starts at its origin and looks along -z, with +y up.
          Forward-facing scenes (view_forwardfacing.html).
"""

from typing import Literal

import numpy as np

from core.baked import BakedScene, ShaderNetwork, similarity_scale
from core.camera import Camera
from core.conventions import ASSET_FROM_Z_UP

Axes = Literal["z-up", "forward"]

# view_synthetic.html looks at the origin from a distance of 4, where an object frame's cameras have a distance of 1;
# view_unbounded.html starts at 1. A power of two, so that no position is rounded.
OBJECT_SCALE = 4.0
NEAREST_SHARE = 0.01  # of the vertices may be nearer than 1 in the forward-facing viewer, whose near plane is at 0.5
SMALLEST_DEPTH = 1e-3  # object frame: nothing that close decides about a scene's scale


def obj_from_object(scene: BakedScene, axes: Axes) -> np.ndarray:
    """[4, 4] float64 similarity: where the reference implementation's viewer for `axes` shows the scene best."""
    if axes == "z-up":
        scale = OBJECT_SCALE if scene.start_camera is None else 1.0
        return np.asarray(ASSET_FROM_Z_UP @ np.diag([scale, scale, scale, 1.0]))
    if scene.start_camera is None:
        return np.eye(4)
    return _seen_from(scene, scene.cameras[scene.start_camera])


def network_from_object(axes: Axes, obj_from_object: np.ndarray) -> np.ndarray:
    """[3, 3]: the direction that a viewer feeds to the network, of one in the object frame."""
    rotation = obj_from_object[:3, :3] / similarity_scale(obj_from_object)
    viewer: np.ndarray = (ASSET_FROM_Z_UP[:3, :3].T if axes == "z-up" else np.eye(3)) @ rotation
    return viewer


def turned(network: ShaderNetwork, rotation: np.ndarray) -> ShaderNetwork:
    """The network that shows for the direction `rotation @ d` what `network` shows for d; exactly it for no turn."""
    if np.array_equal(rotation, np.eye(3)):
        return network
    first = network.weights[0].copy()
    first[:, 8:] = (first[:, 8:].astype(np.float64) @ rotation.T).astype(np.float32)
    return ShaderNetwork((first, *network.weights[1:]), network.biases)


def guessed_axes(positions: np.ndarray) -> Axes:
    """The convention of OBJ vertices [n, 3], best guess: forward-facing scenes lie in front of the origin, along -z."""
    return "forward" if (positions[:, 2] < 0).all() else "z-up"


def moved(positions: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """float32 positions [n, 3] after a similarity [4, 4]."""
    return (positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32) + np.float32(0)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Of a similarity [4, 4]; exact for quarter turns and scales that are powers of two."""
    scale = similarity_scale(matrix)
    result = np.eye(4)
    result[:3, :3] = (matrix[:3, :3] / scale).T / scale
    result[:3, 3] = -result[:3, :3] @ matrix[:3, 3]
    return result + 0.0


def fitting_axes(scene: BakedScene) -> Axes:
    """The convention of the viewer that a scene is made for: "forward" if all of it lies before its start camera."""
    if scene.start_camera is None:
        return "z-up"
    ahead = (_depths(scene, scene.cameras[scene.start_camera].world_from_camera) > 0).all()
    return "forward" if ahead else "z-up"


def _depths(scene: BakedScene, object_from_camera: np.ndarray) -> np.ndarray:
    """[vertices] float64, along a camera's axis."""
    offsets = np.concatenate([page.positions for page in scene.pages]) - object_from_camera[:3, 3]
    depths: np.ndarray = offsets @ -object_from_camera[:3, 2]
    return depths


def _seen_from(scene: BakedScene, camera: Camera) -> np.ndarray:
    """The camera at the origin, and what is nearest to it about one unit away."""
    u, _, vt = np.linalg.svd(camera.world_from_camera[:3, :3])
    matrix = np.eye(4)
    matrix[:3, :3] = (u @ vt).T
    matrix[:3, 3] = -matrix[:3, :3] @ camera.position
    depths = _depths(scene, camera.world_from_camera)
    ahead = depths[depths > SMALLEST_DEPTH]
    scale = 1.0 / float(np.quantile(ahead, NEAREST_SHARE)) if len(ahead) else 1.0
    return np.asarray(np.diag([scale, scale, scale, 1.0]) @ matrix)
