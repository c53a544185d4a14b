"""Do the meshes hang in the scene, so that anything is shown?"""

from exporters.check.finding import Findings
from exporters.gltf import extension
from exporters.gltf.document import Document


def check_hierarchy(found: Findings, document: Document) -> None:
    """Adds a finding where nodes are no tree, or a neural mesh is on none of the scene's nodes.

    Raises:
        AssetInvalid; KeyError, TypeError, ValueError for JSON of another structure.
    """
    scene = document.item("scenes", document.json.get("scene", 0))
    waiting, visited, shown = list(scene["nodes"]), set(), set()
    while waiting:
        index = waiting.pop()
        node = document.item("nodes", index)
        if index in visited:
            found.error("frame", f"nodes[{index}]", "must hang at one place, but hangs at several, or below itself")
            return
        visited.add(index)
        shown.add(node.get("mesh"))
        waiting += node.get("children", [])
    for index, mesh in enumerate(document.json.get("meshes", [])):
        neural = any(extension.NAME in primitive.get("extensions", {}) for primitive in mesh["primitives"])
        if neural and index not in shown:
            found.error("frame", f"meshes[{index}]", "must be on a node of the scene, but nothing shows it")
