// Numbers as people read them.

/** 1536 -> "1.5 kB"; decimal units, as file managers and browsers show them. */
export function formatBytes(bytes) {
  const units = ["B", "kB", "MB", "GB"];
  let value = bytes;
  let unit = 0;
  while (value >= 999.5 && unit < units.length - 1) {
    value /= 1000;
    unit += 1;
  }
  return `${unit > 0 && value < 99.5 ? value.toFixed(1) : Math.round(value)} ${units[unit]}`;
}

export const formatCount = (count) => count.toLocaleString("en").replaceAll(",", "\u202f");

export const plural = (count, one, many = `${one}s`) => `${formatCount(count)} ${count === 1 ? one : many}`;

export const formatPsnr = (psnr) => `${psnr.toFixed(2)} dB`;

/** "just now", "5 min ago", "yesterday"; an empty string for a time that cannot be read. */
export function formatAgo(time, now = Date.now()) {
  const seconds = (now - new Date(time).getTime()) / 1000;
  if (Number.isNaN(seconds)) return "";
  const relative = new Intl.RelativeTimeFormat("en", { numeric: "auto" });
  if (seconds < 60) return "just now";
  if (seconds < 3600) return relative.format(-Math.round(seconds / 60), "minute");
  if (seconds < 86400) return relative.format(-Math.round(seconds / 3600), "hour");
  return relative.format(-Math.round(seconds / 86400), "day");
}
