// Elements, numbers in words, keys, histograms and ticks: what the page is made of, without its data.
"use strict";

// An element with attributes and children: texts, elements, or nothing.
function make(tag, attributes = {}, ...children) {
  const svg = ["svg", "g", "path", "rect", "line", "text"].includes(tag);
  const element = svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== undefined && value !== false) element.setAttribute(name, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

const is_number = (value) => typeof value === "number" && Number.isFinite(value);

// At most six digits, groups of three from 10,000 on.
function number(value) {
  if (!is_number(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e9 || size < 1e-4)) return value.toExponential(3);
  return value.toLocaleString("en", { maximumSignificantDigits: Math.max(6, Math.ceil(Math.log10(size + 1))), useGrouping: size >= 1e4 });
}
const short = (value) => number(Number(value.toPrecision(4)));
const milliseconds = (seconds) => `${short(seconds * 1000)} ms`;

function percent(part, whole) {
  const value = (100 * part) / whole;
  return part === 0 ? "0 %" : value < 0.01 ? "< 0.01 %" : value > 99.99 && part < whole ? "> 99.99 %" : `${Number(value.toPrecision(3))} %`;
}

const key_of = (color, text) => {
  const swatch = make("i");
  swatch.style.background = color;
  return make("span", {}, swatch, text);
};

function histogram_of(counts, width) {
  const height = 96, bottom = 4, top = 20, most = Math.max(...counts, 1);
  const svg = make("svg", { class: "plot histogram", viewBox: `0 0 ${width} ${height}`, height, role: "img" });
  const total = counts.reduce((a, b) => a + b, 0);
  svg.setAttribute("aria-label", total ? `Histogram: the fullest of ${counts.length} bins holds ${percent(most, total)} of the values` : "Histogram: no value");
  const step = width / counts.length;
  counts.forEach((count, i) => {
    const tall = ((height - bottom - top) * count) / most;
    if (count) svg.append(make("rect", { x: i * step + 0.5, y: height - bottom - Math.max(1, tall), width: Math.max(0.5, step - 1), height: Math.max(1, tall), fill: "var(--series)" }));
  });
  svg.append(make("line", { class: "axis", x1: 0, x2: width, y1: height - bottom + 0.5, y2: height - bottom + 0.5 }));
  if (total) svg.append(make("text", { x: width, y: 12, "text-anchor": "end" }, `highest bar ${percent(most, total)}`));
  return svg;
}

function nice_ticks(low, high, most) {
  if (!(high > low)) return [low];
  let step = 10 ** Math.floor(Math.log10((high - low) / most));
  for (const factor of [2, 2.5, 2]) if ((high - low) / step > most) step *= factor;
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

const range_of = (values) => {
  const finite = values.filter(is_number);
  return [Math.min(...finite), Math.max(...finite)];
};
