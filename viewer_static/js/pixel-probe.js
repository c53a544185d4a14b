// Exact pixels for tests and measurements: no canvas, no background, no scaling.

import { NearestFilter, NoColorSpace, Vector3, WebGLRenderTarget } from "three";
import { exactCamera, worldFromCamera } from "./capture-view.js";
import { readTextureBytes } from "./texture-bytes.js";

export class PixelProbe {
  #stage;

  constructor(stage) {
    this.#stage = stage;
  }

  /**
   * Renders a view.
   *
   * @param {number | object} which index among the asset's views, or a view as the extension describes it
   * @param {"deferred" | "forward" | "plain"} mode
   * @param {number} width in pixels
   * @param {number} height
   * @returns {Promise<Uint8Array>} RGBA, top row first, premultiplied by coverage
   */
  async renderToPixels(which, mode, width, height) {
    const { gltf, webgl, rig } = this.#stage;
    const { views, parts } = gltf.neural;
    const view = typeof which === "number" ? views[which] : which;
    const position = new Vector3().setFromMatrixPosition(worldFromCamera(view, parts[0].mesh));
    const camera = exactCamera(view, parts[0].mesh, rig.depthRange(position));
    const renderer = this.#stage.rendererOf(mode);
    await renderer.load?.();
    const target = new WebGLRenderTarget(width, height, { colorSpace: NoColorSpace, minFilter: NearestFilter, magFilter: NearestFilter });
    webgl.setRenderTarget(target);
    webgl.setClearColor(0x000000, 0);
    webgl.clear();
    renderer.render(camera, target, width, height);
    const pixels = new Uint8Array(4 * width * height);
    webgl.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    webgl.setRenderTarget(null);
    target.dispose();
    this.#stage.setMode(this.#stage.mode); // the meshes carry the probe's materials
    return flipRows(pixels, width, height);
  }

  /**
   * The bytes of a feature texture as the graphics processor has them.
   *
   * @param {number} page
   * @param {0 | 1} half features 0 to 3, or 4 to 7
   * @returns {{width: number, height: number, bytes: Uint8Array}} RGBA, the image's top row first
   */
  readFeatureTexture(page, half) {
    const { webgl, gltf } = this.#stage;
    return readTextureBytes(webgl, gltf.neural.parts[page].material.textures[half]);
  }
}

function flipRows(pixels, width, height) {
  const flipped = new Uint8Array(pixels.length);
  const row = 4 * width;
  for (let y = 0; y < height; y += 1) flipped.set(pixels.subarray(y * row, (y + 1) * row), (height - 1 - y) * row);
  return flipped;
}
