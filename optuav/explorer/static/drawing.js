// What the pictures share: elements, numbers, lines of the table of looks, and words that keep apart.
const FONT = "system-ui, sans-serif";
const APART_PX = 3, GRAZED = 0.06; // Words that are side by side, and the share of words that may touch a mark
let ruler = null;
export const LIMITS = ["charge", "deadline", "dry", "overfull", "bounds"];

// Elements; every word is text, never markup.
export function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

export function button(words, act, {key = "", ...attributes} = {}) {
  const made = make("button", {type: "button", ...attributes}, words, ...(key ? [make("kbd", {}, key)] : []));
  made.addEventListener("click", () => act(made));
  return made;
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

export function colour(role) { return `var(--${role})`; }

// Options of a mark for the line of a limit, and for its casing in the colour of the ground.
export function line(role, u = 1) {
  const {width, dash, rounded} = LOOKS[role];
  return {
    stroke: colour(role), strokeWidth: width * u, strokeLinecap: rounded ? "round" : "butt",
    strokeDasharray: dash.map((each) => each * u).join(" ") || null,
  };
}

export function casing(role, u = 1) { return {stroke: colour("panel"), strokeWidth: (LOOKS[role].width + 3) * u}; }

// A picture of Plot that fills its place.
export function picture({width, height, size, label, ...options}) {
  const plot = Plot.plot({
    width, height, inset: 0,
    style: {fontSize: `${size - 1}px`, fontFamily: FONT, background: "none", color: colour("ink"), overflow: "hidden"},
    ...options,
  });
  for (const name of ["x", "y"]) plot.dataset[name] = plot.scale(name).domain.join(" ");
  plot.setAttribute("role", "img");
  plot.setAttribute("aria-label", label);
  return plot;
}

export function place(plot, name) {
  const {apply, invert, range} = plot.scale(name);
  return Object.assign((value) => apply(value), {invert, most: d3.max(range)});
}

// The line of a role as a small picture for a list.
export function swatch(role) {
  const mark = Plot.ruleY([0], {...line(role), ariaHidden: "true"});
  return Plot.plot({width: 30, height: 10, margin: 2, axis: null, marks: [mark]});
}

export function wide(words, size, weight = 400) {
  ruler ??= document.createElement("canvas").getContext("2d");
  ruler.font = `${weight} ${size}px ${FONT}`;
  return ruler.measureText(words).width;
}

// Words in a picture: with a halo in the colour of the ground, or none where they are on a fill.
export function write(svg, {x, y, words, size, anchor = "start", fill = "ink", weight = 400, halo = true, symbol = ""}) {
  const text = d3.select(svg).append("text").attr("x", x).attr("y", y).attr("font-size", size).attr("text-anchor", anchor)
    .attr("font-weight", weight).attr("fill", colour(fill)).text(words);
  if (halo) {
    text.attr("paint-order", "stroke").attr("stroke", colour("panel")).attr("stroke-width", size / 3.2).attr("stroke-linejoin", "round");
  }
  if (symbol) text.append("tspan").attr("class", "sym").attr("dx", 6).text(symbol);
  return text;
}

// Places words where no others are: `taken` are boxes [left, top, right, bottom], and `faint` points that are
// better left free. Each label has candidates {x, y, anchor, cost}; one that is not needed may have no place.
export class Labels {
  #taken = [];
  #points = [];
  #width;
  #height;
  #left;
  constructor(width, height, left = 0) { [this.#width, this.#height, this.#left] = [width, height, left]; }
  keep(box) { this.#taken.push(box); }
  avoid(points) { this.#points.push(...points); }
  box({x, y, anchor}, lines, size, weight) {
    const across = d3.max(lines, (each) => wide(each, size, weight)), down = size * (1.25 * lines.length - 0.05);
    const left = x - across * {start: 0, middle: 0.5, end: 1}[anchor];
    return [left, y - 0.95 * size, left + across, y - 0.95 * size + down];
  }
  find(lines, candidates, {size, weight = 400, needed = true}) {
    let best = null;
    for (const wished of candidates) {
      const [left, top, right, bottom] = this.box(wished, lines, size, weight), dx = Math.max(Math.min(0, this.#width - right), this.#left - left), dy = Math.max(-top, Math.min(0, this.#height - bottom));
      const candidate = {...wished, x: wished.x + dx, y: wished.y + dy}, [a, b, c, d] = [left + dx, top + dy, right + dx, bottom + dy], moved = Math.hypot(dx, dy);
      const covered = d3.sum(this.#taken, ([e, f, g, h]) =>
        Math.max(0, Math.min(c, g) - Math.max(a, e)) * Math.max(0, Math.min(d, h) - Math.max(b, f)));
      const crossed = this.#points.filter(([x, y]) => x > a && x < c && y > b && y < d).length;
      const cost = (candidate.cost ?? 0) + 0.5 * moved + 20 * covered + 6 * crossed;
      if (!best || cost < best.cost) best = {...candidate, cost, free: covered <= GRAZED * (c - a) * (d - b) && !moved && crossed < 3, box: [a, b, c, d]};
    }
    if (!best || (!needed && !best.free)) return null;
    const [left, top, right, bottom] = best.box;
    this.keep([left - APART_PX, top, right + APART_PX, bottom]);
    return best;
  }
}

// Candidates around a point, at a distance.
export function around(x, y, gap, size, lines = 1) {
  const down = size * 1.25 * (lines - 1), middle = y + size * 0.35 - down / 2;
  return [
    {x: x + gap, y: middle, anchor: "start", cost: 0},
    {x: x - gap, y: middle, anchor: "end", cost: 1},
    {x, y: y - gap - down, anchor: "middle", cost: 2},
    {x, y: y + gap + size * 0.8, anchor: "middle", cost: 2},
    ...[[1, -1], [-1, -1], [1, 1], [-1, 1]].map(([a, b]) => ({
      x: x + 0.8 * a * gap, y: b < 0 ? y - 0.7 * gap - down : y + 0.7 * gap + size * 0.8, anchor: a > 0 ? "start" : "end", cost: 3,
    })),
  ];
}

// Round values from 0 on, at most so many steps; every second where there is little room.
export function steps(most, count, coarse = false) {
  const step = d3.tickStep(0, most, count / Math.SQRT2) * (coarse ? 2 : 1); // Rounded up by as much at most
  return d3.range(0, most + step / 1000, step);
}

export function dots(points, step = 6) {
  return d3.pairs(points).flatMap(([[x1, y1], [x2, y2]]) => {
    const count = Math.min(400, Math.ceil(Math.hypot(x2 - x1, y2 - y1) / step));
    return d3.range(count + 1).map((k) => [x1 + (k / count) * (x2 - x1), y1 + (k / count) * (y2 - y1)]);
  });
}
