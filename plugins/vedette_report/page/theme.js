"use strict";
// The colours of what is drawn, from the page's styles: light or dark, as the reader's system asks.

const THEME = (() => {
  const styles = getComputedStyle(document.documentElement);
  const names = ["ink", "soft", "faint", "paper", "veil", "grey", "accent", "land", "coast", "meridian", "latitude"];
  return Object.fromEntries(names.map((name) => [name, styles.getPropertyValue(`--${name}`).trim()]));
})();
const DARK = matchMedia("(prefers-color-scheme: dark)");
DARK.addEventListener("change", () => location.reload());

// Whether the reader asks for little motion.
const CALM = matchMedia("(prefers-reduced-motion: reduce)").matches;

// A colour that stands out from dark paper: the same, mixed with white until its contrast is 4.5 to 1. On light paper the colours are
// those of the pictures.
function legible(colour) {
  if (!DARK.matches) return colour;
  let parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  const linear = (part) => part <= 10.3 ? part / 3294.6 : ((part / 255 + 0.055) / 1.055) ** 2.4;
  const light = () => 0.2126 * linear(parts[0]) + 0.7152 * linear(parts[1]) + 0.0722 * linear(parts[2]);
  while (light() + 0.05 < 4.5 * 0.06) parts = parts.map((part) => part + 0.1 * (255 - part));  // the paper's own light is .01
  return `#${parts.map((part) => Math.round(part).toString(16).padStart(2, "0")).join("")}`;
}
const BLUE = legible("#0072b2");
