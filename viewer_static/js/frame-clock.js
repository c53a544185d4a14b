// How long frames take: the median of the recent ones.

const WINDOW = 60;
const GAP_MS = 250; // a longer pause means that nothing was drawn, not that a frame took so long

export class FrameClock {
  #intervals = [];
  #last = -Infinity;

  /** @param {number} now time of this frame in ms */
  tick(now) {
    const interval = now - this.#last;
    this.#last = now;
    if (interval > GAP_MS && this.#intervals.length > 0 && interval > 4 * this.medianMs) return;
    if (Number.isFinite(interval)) this.#intervals.push(interval);
    if (this.#intervals.length > WINDOW) this.#intervals.shift();
  }

  /** Forgets everything, for another mode or size. */
  reset() {
    this.#intervals = [];
    this.#last = -Infinity;
  }

  /** The pause after which a frame starts a new run of frames. */
  pause() {
    this.#last = -Infinity;
  }

  /** Median time between frames in ms, or NaN. */
  get medianMs() {
    return median(this.#intervals);
  }
}

export function median(values) {
  if (values.length === 0) return NaN;
  const sorted = [...values].sort((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}
