// A running job's progress, as server-sent events.

import { eventsUrl } from "./api.js";

/**
 * Calls `onProgress({stage, fraction, psnr, preview})` until the job ends, then `onEnd()`.
 * A lost connection is taken up again by the browser itself, from the last event seen.
 *
 * @returns {() => void} stops listening
 */
export function followJob(id, onProgress, onEnd) {
  const source = new EventSource(eventsUrl(id));
  source.onmessage = (event) => onProgress(JSON.parse(event.data));
  source.addEventListener("end", () => {
    source.close();
    onEnd();
  });
  return () => source.close();
}
