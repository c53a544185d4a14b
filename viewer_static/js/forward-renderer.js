// One sample per pixel, shaded at once: cheaper, without anti-aliasing.

/** Draws over what the target holds. */
export class ForwardRenderer {
  #renderer;
  #scene;
  #parts;

  constructor(renderer, scene, { parts }) {
    this.#renderer = renderer;
    this.#scene = scene;
    this.#parts = parts;
  }

  /** As DeferredRenderer.render; the size is the target's own. */
  render(camera, target) {
    for (const { mesh, material } of this.#parts) {
      mesh.material = material.forward;
      material.setCamera(mesh, camera);
    }
    this.#renderer.setRenderTarget(target);
    this.#renderer.render(this.#scene, camera);
  }

  dispose() {}
}
