"use strict";
// Paper shows what is drawn with at least two pixels a point sharp; uPlot, too, asks the window.
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
  const count = { source: 4, axis: 3 }[ink.of];
  return color(count ? ink.of + "-" + (ink.index % count) : "text");
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
