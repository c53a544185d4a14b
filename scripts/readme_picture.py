"""The README's picture: held-out photos of a capture above the renders of its .glb.

polyfield sample out/sample && polyfield convert out/sample -o out/readme
python scripts/readme_picture.py out/sample out/readme/scene.glb docs/images/sample.png
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

from core.datasets import read_capture
from core.evaluation import comparison_picture
from exporters.gltf import read_glb

VIEWS = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("capture", type=Path)
    parser.add_argument("glb", type=Path)
    parser.add_argument("picture", type=Path)
    arguments = parser.parse_args()
    views = read_capture(arguments.capture).test
    chosen = [views[i] for i in np.linspace(0, len(views), VIEWS, endpoint=False).astype(int)]
    scene = read_glb(arguments.glb.read_bytes())
    photos, renders, _ = zip(*(np.split(comparison_picture(scene, view), 3, 1) for view in chosen), strict=True)
    picture = np.concatenate([np.concatenate(photos, 1), np.concatenate(renders, 1)])
    Image.fromarray(picture).save(arguments.picture, optimize=True)


if __name__ == "__main__":
    main()
