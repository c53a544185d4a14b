// What any other glTF viewer shows: the fallback materials, or a file without neural materials.

/** Draws over what the target holds. `ready` resolves when the fallback's textures are there. */
export class PlainRenderer {
  #renderer;
  #scene;
  #parts;
  #materials = [];

  constructor(renderer, scene, neural) {
    this.#renderer = renderer;
    this.#scene = scene;
    this.#parts = neural?.parts ?? [];
    this.ready = null;
  }

  /** Decodes the fallback's textures, which nobody needs who does not ask for them. */
  load() {
    this.ready ??= Promise.all(this.#parts.map((part) => part.loadFallback())).then((materials) => {
      this.#materials = materials;
    });
    return this.ready;
  }

  /** As DeferredRenderer.render; the size is the target's own. */
  render(camera, target) {
    this.#parts.forEach(({ mesh }, i) => (mesh.material = this.#materials[i] ?? mesh.material));
    this.#renderer.setRenderTarget(target);
    this.#renderer.render(this.#scene, camera);
  }

  dispose() {
    for (const material of this.#materials) material.dispose();
  }
}
