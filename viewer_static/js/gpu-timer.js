// Time the graphics processor spends on a frame, where the browser tells it (EXT_disjoint_timer_query_webgl2).

import { median } from "./frame-clock.js";

const WINDOW = 30;
const MAX_PENDING = 4;

export class GpuTimer {
  #gl;
  #extension;
  #pending = [];
  #times = [];
  #open = null;

  /** @param {WebGL2RenderingContext} gl */
  constructor(gl) {
    this.#gl = gl;
    this.#extension = gl.getExtension("EXT_disjoint_timer_query_webgl2");
  }

  begin() {
    if (!this.#extension || this.#pending.length >= MAX_PENDING) return;
    this.#open = this.#gl.createQuery();
    this.#gl.beginQuery(this.#extension.TIME_ELAPSED_EXT, this.#open);
  }

  end() {
    if (this.#open) {
      this.#gl.endQuery(this.#extension.TIME_ELAPSED_EXT);
      this.#pending.push(this.#open);
      this.#open = null;
    }
    this.#collect();
  }

  reset() {
    this.#times = [];
  }

  /** Median in ms, or NaN where the browser does not tell. */
  get medianMs() {
    return median(this.#times);
  }

  #collect() {
    const gl = this.#gl;
    while (this.#pending.length > 0 && gl.getQueryParameter(this.#pending[0], gl.QUERY_RESULT_AVAILABLE)) {
      const query = this.#pending.shift();
      const disjoint = gl.getParameter(this.#extension.GPU_DISJOINT_EXT);
      if (!disjoint) this.#times.push(gl.getQueryParameter(query, gl.QUERY_RESULT) / 1e6);
      gl.deleteQuery(query);
    }
    while (this.#times.length > WINDOW) this.#times.shift();
  }
}
