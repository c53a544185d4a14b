"""Run by a Python that has `bpy`: imports an asset into Blender, renders it from its first camera, and reports as JSON.

python blender_import.py ASSET PICTURE WIDTH HEIGHT
"""

import json
import sys

import bpy
import mathutils
import numpy as np

DISTANCE = 1.4  # of a camera from the scene's middle, in diagonals of its box


def main(asset: str, picture: str, width: str, height: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if asset.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=asset)
    else:
        bpy.ops.wm.usd_import(filepath=asset, import_cameras=True)
    cameras = sorted((o for o in bpy.data.objects if o.type == "CAMERA"), key=lambda o: o.name)
    report = {"bounds": bounds(), "cameras": len(cameras), "textures": textures()}
    render(cameras or [camera_around(*map(np.array, bounds()))], picture, int(width), int(height))
    print("REPORT " + json.dumps(report))


def bounds() -> list[list[float]]:
    """Lowest and highest corner of all meshes, in Blender's world (+z up)."""
    points = []
    for thing in bpy.data.objects:
        if thing.type == "MESH":
            local = np.empty(3 * len(thing.data.vertices), "f4")
            thing.data.vertices.foreach_get("co", local)
            matrix = np.array(thing.matrix_world)
            points.append(local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
    everything = np.concatenate(points)
    return [everything.min(0).tolist(), everything.max(0).tolist()]


def camera_around(low: np.ndarray, high: np.ndarray) -> bpy.types.Object:
    """A camera that looks down a little on all that is between two corners."""
    direction = np.array([0.55, -0.72, 0.42]) / np.linalg.norm([0.55, -0.72, 0.42])
    camera = bpy.data.objects.new("around", bpy.data.cameras.new("around"))
    camera.location = (low + high) / 2 + DISTANCE * np.linalg.norm(high - low) * direction
    camera.rotation_euler = mathutils.Vector(-direction).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(camera)
    return camera


def textures() -> dict[str, list[str]]:
    """Of each material in use, the images that are there."""
    used = {slot.material for o in bpy.data.objects for slot in o.material_slots if slot.material}
    nodes = {material.name: material.node_tree.nodes for material in used}
    return {
        name: [n.image.name for n in tree if n.type == "TEX_IMAGE" and min(n.image.size)]
        for name, tree in nodes.items()
    }


def render(cameras: list, picture: str, width: int, height: int) -> None:
    """With Cycles, on the processor: it needs no screen."""
    scene = bpy.context.scene
    names = [camera.name for camera in cameras]
    scene.camera = cameras[names.index("front") if "front" in names else 0]
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 16
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"
    scene.render.filepath = picture
    bpy.ops.render.render(write_still=True)


main(*sys.argv[1:])
