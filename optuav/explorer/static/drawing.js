// What the page and its pictures share: elements, numbers, and lines of the table of looks.
export const LIMITS = ["charge", "deadline", "dry", "overfull", "bounds"];
export const GRID = {stroke: "var(--faint)", strokeOpacity: 1}; // Lines below the marks of a picture
export const NUMBERS = {tickSize: 0, tickFormat: grouped, label: null, fill: "var(--muted)", clip: false};
const FONT = "system-ui, sans-serif";
let ruler = null;

// An element of the page; every word is text, never markup.
export function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

export function button(words, act, {key = "", ...attributes} = {}) {
  const made = make("button", {type: "button", ...attributes}, words, ...(key ? [make("kbd", {}, key)] : []));
  made.addEventListener("click", () => act(made));
  return made;
}

// An element of a picture, drawn over what is there.
export function shape(parent, tag, attributes = {}, words = null) {
  const added = d3.select(parent).append(tag);
  for (const [name, value] of Object.entries(attributes)) added.attr(name, value);
  return added.text(words).node();
}

// As in other pictures, thousands of long numbers stand apart.
export function grouped(value) {
  return d3.format(Math.abs(value) < 10000 ? "~r" : ",~r")(Number(value)).replaceAll(",", "\u2009");
}

// A decimal number; other text as it is, for the answer to refuse.
export function decimal(text) {
  const plain = text.replaceAll(/[\s\u2009]/g, "");
  return /^[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?$/i.test(plain) ? Number(plain) : text;
}

export function colour(role) {
  return `var(--${role})`;
}

// Options of a mark for the line of a limit.
export function line(role, u = 1) {
  const {width, dash, rounded} = LOOKS[role];
  return {
    stroke: colour(role),
    strokeWidth: width * u,
    strokeLinecap: rounded ? "round" : "butt",
    strokeDasharray: dash.map((length) => length * u).join(" ") || null,
  };
}

// The line of a limit above its casing in the colour of the ground, so that it reads on any fill.
export function cased(role, u = 1) {
  return [{stroke: colour("panel"), strokeWidth: (LOOKS[role].width + 3) * u}, line(role, u)];
}

// A picture of Plot that fills its place; marks that a mission lacks are left out.
export function picture({size, label, marks, ...options}) {
  const plot = Plot.plot({
    inset: 0,
    color: {type: "identity"},
    style: `font: ${size - 1}px ${FONT}; background: none; color: ${colour("ink")}; overflow: hidden`,
    marks: marks.flat(Infinity).filter(Boolean),
    ...options,
  });
  for (const name of ["x", "y"]) plot.dataset[name] = plot.scale(name).domain.join(" ");
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", label);
  return plot;
}

// A scale of a picture as a function, with its inverse and its last pixel.
export function place(plot, name) {
  const {apply, invert, range} = plot.scale(name);
  return Object.assign((value) => apply(value), {invert, most: d3.max(range)});
}

// Words in place of a picture.
export function explain(draw, words) {
  draw.replaceChildren(make("p", {}, words));
}

// The line of a role as a small picture for a list.
export function swatch(role) {
  const mark = Plot.ruleY([0], {...line(role), ariaHidden: "true"});
  return Plot.plot({width: 30, height: 10, margin: 2, axis: null, marks: [mark]});
}

// The width of words [px].
export function wide(words, size, weight = 400) {
  ruler ??= document.createElement("canvas").getContext("2d");
  ruler.font = `${weight} ${size}px ${FONT}`;
  return ruler.measureText(words).width;
}

// Words in a picture: with a halo in the colour of the ground, or none where they are on a fill.
export function write(svg, {x, y, words, size, ...look}) {
  const {anchor = "start", fill = "ink", weight = 400, halo = true, symbol = ""} = look;
  const outline = {"paint-order": "stroke", stroke: colour("panel"), "stroke-width": size / 3.2};
  const text = shape(svg, "text", {
    x,
    y,
    "font-size": size,
    "text-anchor": anchor,
    "font-weight": weight,
    fill: colour(fill),
    ...(halo ? {...outline, "stroke-linejoin": "round"} : {}),
  }, words);
  if (symbol) shape(text, "tspan", {class: "sym", dx: 6}, symbol);
  return text;
}

// Round values from 0 on, at most so many steps; every second where there is little room.
export function steps(most, count, coarse = false) {
  const step = d3.tickStep(0, most, count / Math.SQRT2) * (coarse ? 2 : 1); // Rounded up by as much at most
  return d3.range(0, most + step / 1000, step);
}
