// GLTFLoader plug-in for POLYFIELD_materials_neural. The extension's README is the specification.

import { MeshBasicMaterial } from "three";
import { MeshoptDecoder } from "three/addons/libs/meshopt_decoder.module.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { readFeatureTexture } from "./feature-texture.js";
import { NeuralMaterial } from "./neural-material.js";

export const EXTENSION = "POLYFIELD_materials_neural";
const DIALECT = "essl300";
const WEBP = "EXT_texture_webp";

/**
 * Loads a .glb.
 *
 * @param {ArrayBuffer} bytes
 * @returns {Promise<object>} GLTFLoader's result; `gltf.neural` is null where the file lacks the extension, otherwise
 *   `{parts, shaders, background, views, startView}`, see NeuralExtension.
 */
export async function loadGlb(bytes) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new NeuralExtension(parser));
  return loader.parseAsync(bytes, "");
}

/**
 * Gives `gltf.neural`:
 *   parts       [{mesh, material: NeuralMaterial, loadFallback: () => Promise<Material>}], one per textured mesh
 *   shaders     the three GLSL programs of the asset's network
 *   background  sRGB [r, g, b] in [0, 1]
 *   views       the capture's cameras as the extension gives them, each with a `name`
 *   startView   index among them of the one to start from, null where the asset does not say
 */
class NeuralExtension {
  name = EXTENSION;
  #parser;

  constructor(parser) {
    this.#parser = parser;
  }

  // A neural primitive needs no fallback texture: decoding it would cost 64 MB per page. The loader may clone what is
  // returned here (meshes without normals), so the real material takes its place only at the end.
  loadMaterial(index) {
    return this.#onlyNeural(index) ? Promise.resolve(new MeshBasicMaterial()) : null;
  }

  async afterRoot(gltf) {
    const { json, associations } = this.#parser;
    const root = json.extensions?.[EXTENSION];
    gltf.neural = null;
    if (!root) return;
    const shaders = shadersOf(root.networks[0]);
    const parts = meshesOf(gltf.scene).map((mesh) => {
      const { meshes, primitives } = associations.get(mesh) ?? {};
      const primitive = json.meshes[meshes]?.primitives[primitives ?? 0];
      return this.#readPart(mesh, primitive, shaders);
    });
    const views = (root.views ?? []).map((view, i) => ({ ...view, name: nameOfView(json, view) || `View ${i + 1}` }));
    const background = root.background ?? [1, 1, 1];
    const startView = views[root.startView] ? root.startView : null;
    gltf.neural = { parts: await Promise.all(parts.filter(Boolean)), shaders, background, views, startView };
    if (gltf.neural.parts.length === 0) gltf.neural = null;
  }

  #onlyNeural(material) {
    const primitives = this.#parser.json.meshes.flatMap((mesh) => mesh.primitives);
    const users = primitives.filter((primitive) => primitive.material === material);
    return users.length > 0 && users.every((primitive) => primitive.extensions?.[EXTENSION]);
  }

  /** The part of a neural primitive, null of another. */
  #readPart(mesh, primitive, shaders) {
    const extension = primitive?.extensions?.[EXTENSION];
    if (!extension) return null;
    // Straight to the parser's own method, past loadMaterial above.
    const loadFallback = () => this.#parser.loadMaterial(primitive.material);
    return this.#readMaterial(extension, shaders).then((material) => ({ mesh, material, loadFallback }));
  }

  async #readMaterial({ network, coding, featureTextures }, shaders) {
    if (network !== 0) throw new Error(`This viewer shows assets with one network, but a mesh uses number ${network}.`);
    if (coding !== "unorm8") throw new Error(`This viewer reads features coded as "unorm8", but got "${coding}".`);
    const textures = await Promise.all(featureTextures.map(({ index }) => this.#readTexture(index)));
    return new NeuralMaterial(textures, shaders);
  }

  async #readTexture(index) {
    const { json } = this.#parser;
    const texture = json.textures[index];
    const image = json.images[texture.extensions?.[WEBP]?.source ?? texture.source];
    const bytes = await this.#parser.getDependency("bufferView", image.bufferView);
    return readFeatureTexture(new Blob([bytes], { type: image.mimeType }));
  }
}

function shadersOf(network) {
  const shaders = network?.shaders?.[DIALECT];
  if (!shaders) throw new Error(`The asset has no shader text for ${DIALECT} (WebGL2). Export it again.`);
  return shaders;
}

function meshesOf(scene) {
  const meshes = [];
  scene.traverse((object) => object.isMesh && meshes.push(object));
  return meshes;
}

function nameOfView(json, view) {
  const node = json.nodes[view.node];
  return node?.name ?? json.cameras?.[node?.camera]?.name;
}
