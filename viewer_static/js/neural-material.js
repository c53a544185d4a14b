// The materials of one feature page. The GLSL is the asset's own, unchanged.

import { DoubleSide, Matrix4, NoBlending, RawShaderMaterial, Vector3 } from "three";

/** Materials of a page for the deferred pass 1 (`features`) and for forward rendering (`forward`). */
export class NeuralMaterial {
  /**
   * @param {[Texture, Texture]} textures features 0 to 3, features 4 to 7
   * @param {{version: string, programs: object}} shaders the asset's, see the extension's README
   */
  constructor(textures, shaders) {
    this.textures = textures;
    this.features = makeMaterial(shaders, "features", texturesAsUniforms(textures));
    this.forward = makeMaterial(shaders, "forward", {
      ...texturesAsUniforms(textures),
      u_camera_position_object: { value: new Vector3() },
    });
  }

  /** Call before a mesh is drawn with `forward`. */
  setCamera(mesh, camera) {
    const objectFromView = new Matrix4().multiplyMatrices(camera.matrixWorldInverse, mesh.matrixWorld).invert();
    this.forward.uniforms.u_camera_position_object.value.setFromMatrixPosition(objectFromView);
    this.forward.uniformsNeedUpdate = true;
  }

  dispose() {
    for (const disposable of [...this.textures, this.features, this.forward]) disposable.dispose();
  }
}

/** A material that runs one of the asset's programs, opaque and two-sided. */
export function makeMaterial(shaders, program, uniforms, options = {}) {
  const { vertex, fragment } = shaders.programs[program];
  return new RawShaderMaterial({
    name: program,
    glslVersion: shaders.version, // three.js writes the version line, which the texts therefore lack
    vertexShader: vertex,
    fragmentShader: fragment,
    uniforms,
    side: DoubleSide,
    blending: NoBlending,
    ...options,
  });
}

function texturesAsUniforms([features0, features1]) {
  return { u_features0: { value: features0 }, u_features1: { value: features1 } };
}
