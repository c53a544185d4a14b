// Anti-aliased rendering: features at 2 x 2 sub-pixels, then one evaluation of the network per pixel.

import {
  BufferAttribute,
  BufferGeometry,
  Camera,
  CustomBlending,
  Matrix3,
  Mesh,
  NearestFilter,
  NoColorSpace,
  OneFactor,
  OneMinusSrcAlphaFactor,
  RGBAFormat,
  Scene,
  UnsignedByteType,
  WebGLRenderTarget,
} from "three";
import { makeMaterial } from "./neural-material.js";
import { objectRayFromNdc } from "./object-ray.js";

export const SUBPIXELS = 2; // per side

/**
 * Draws over what the target holds, premultiplied by coverage. All parts share one network and one object frame.
 */
export class DeferredRenderer {
  #renderer;
  #scene;
  #parts;
  #features = featureTarget();
  #shade;
  #screen = new Scene();
  #screenCamera = new Camera();

  constructor(renderer, scene, { parts, shaders }) {
    this.#renderer = renderer;
    this.#scene = scene;
    this.#parts = parts;
    this.#shade = makeMaterial(
      shaders,
      "shade",
      {
        u_features0: { value: this.#features.textures[0] },
        u_features1: { value: this.#features.textures[1] },
        u_object_ray_from_ndc: { value: new Matrix3() },
      },
      {
        depthTest: false,
        depthWrite: false,
        transparent: true,
        blending: CustomBlending,
        blendSrc: OneFactor,
        blendDst: OneMinusSrcAlphaFactor,
      },
    );
    const triangle = new Mesh(screenTriangle(), this.#shade);
    triangle.frustumCulled = false;
    this.#screen.add(triangle);
  }

  /**
   * @param {Camera} camera
   * @param {WebGLRenderTarget | null} target null is the canvas
   * @param {number} width of the target, in pixels
   * @param {number} height
   */
  render(camera, target, width, height) {
    this.#renderFeatures(camera, width, height);
    objectRayFromNdc(camera, this.#parts[0].mesh, this.#shade.uniforms.u_object_ray_from_ndc.value);
    this.#shade.uniformsNeedUpdate = true;
    this.#renderer.setRenderTarget(target);
    this.#renderer.render(this.#screen, this.#screenCamera);
  }

  dispose() {
    this.#features.dispose();
    this.#shade.dispose();
  }

  #renderFeatures(camera, width, height) {
    const renderer = this.#renderer;
    for (const { mesh, material } of this.#parts) mesh.material = material.features;
    this.#features.setSize(SUBPIXELS * width, SUBPIXELS * height);
    renderer.setRenderTarget(this.#features);
    renderer.setClearColor(0x000000, 0); // 0 is "not covered"
    renderer.clear();
    renderer.render(this.#scene, camera);
  }
}

function featureTarget() {
  const target = new WebGLRenderTarget(SUBPIXELS, SUBPIXELS, {
    count: 2,
    format: RGBAFormat,
    type: UnsignedByteType,
    colorSpace: NoColorSpace,
    minFilter: NearestFilter,
    magFilter: NearestFilter,
    generateMipmaps: false,
    depthBuffer: true,
    samples: 0,
  });
  target.textures.forEach((texture, i) => (texture.name = `features${i}`));
  return target;
}

function screenTriangle() {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
  return geometry;
}
