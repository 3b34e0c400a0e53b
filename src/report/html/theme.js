"use strict";
// Paper shows what is drawn with at least two pixels a point sharp; uPlot, too, asks the window, when it is loaded.
const sharpness = Math.max(2, Math.min(3, window.devicePixelRatio || 1));
Object.defineProperty(window, "devicePixelRatio", { get: () => sharpness, configurable: true });

const PHASES = ["single", "overlap", "bridged", "extrapolated"];
const DASH = "–";

/** A colour of the page's palette, as it is now. */
function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
}

/** The colour of an `Ink` of the report. */
function ink(ink) {
  const count = { source: 4, axis: 3, rejected: 3 }[ink.of];
  return color(count ? ink.of + "-" + (ink.index % count) : "text");
}

/** What was thrown out has a sign by its reason, too, for who can't tell the colours apart. */
const SIGNS = ["×", "+", "▽"];

/** Adds the sign of a reason about a place to a path, or an arrow where the place is `beyond`, 1 above or -1 below. */
function addSign(path, index, x, y, r, beyond) {
  const stroke = (...points) => points.forEach(([a, b], i) => (i ? path.lineTo(x + a * r, y + b * r) : path.moveTo(x + a * r, y + b * r)));
  if (beyond) stroke([-1, beyond], [0, -beyond], [1, beyond]);
  else if (index % 3 === 0) {
    stroke([-1, -1], [1, 1]);
    stroke([-1, 1], [1, -1]);
  } else if (index % 3 === 1) {
    stroke([-1.3, 0], [1.3, 0]);
    stroke([0, -1.3], [0, 1.3]);
  } else stroke([-1.2, -0.9], [1.2, -0.9], [0, 1.2], [-1.2, -0.9]);
}

/** The colour, let through by so much. */
function faded(hex, alpha) {
  return hex + Math.round(alpha * 255).toString(16).padStart(2, "0");
}

function element(parent, name, className, text) {
  const made = parent.appendChild(document.createElement(name));
  if (className) made.className = className;
  if (text) made.textContent = text;
  return made;
}
