// What the page and its pictures share: elements, numbers, lines of the table of looks, and a picture whose
// words keep apart.
export const GRID = {stroke: "var(--faint)", strokeOpacity: 1}; // Lines below the marks of a picture
export const NUMBERS = {tickSize: 0, tickFormat: grouped, label: null, fill: "var(--muted)", clip: false};
export const STRONG = {weight: 600};
export const ON_FILL = {...STRONG, fill: "on-fill", halo: false};
const FONT = "system-ui, sans-serif";
const APART_PX = 3; // Between words that are side by side
const GRAZED = 0.06; // Share of words that may touch a mark, of long ones as if they were so long
const LONG_PX = 80;
const CROSSED = 3; // Points that words may not cover, where they are not needed
const MOST_DOTS = 400; // Along a line
// Right, left, above, below, and corners [gaps to the right and down]
const SPOTS = [[1, 0], [-1, 0], [0, -1], [0, 1], [0.8, -0.7], [-0.8, -0.7], [0.8, 0.7], [-0.8, 0.7]];
const SYMBOL = /(?<![\w.])(\p{L}+)(\d*)(?:_(\w+))?(?![\w])/gu; // As in T_max, η0 and y1_k
const LOWERED = {size: 0.75, down: 0.25}; // Of an index, in the size of its symbol
const EDGE_PX = 9; // From the edge, where a picture says what lies beyond it
const ruler = document.createElement("canvas").getContext("2d");

// An element of the page; every word is text, never markup.
export function make(tag, attributes = {}, ...content) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...content);
  return element;
}

export function button(words, act, attributes = {}) {
  const made = make("button", {type: "button", ...attributes}, words);
  made.addEventListener("click", () => act(made));
  return made;
}

// Parts of a formula, each with whether it is an index: T_max is T and an index max.
function partsOf(formula) {
  let end = 0;
  const parts = [];
  for (const {0: whole, 1: letters, 2: digits, 3: index, index: at} of formula.matchAll(SYMBOL)) {
    if (!digits && !index) continue;
    parts.push([formula.slice(end, at) + letters, false], [[digits, index].filter(Boolean).join(","), true]);
    end = at + whole.length;
  }
  return [...parts, [formula.slice(end), false]].filter(([words]) => words);
}

// A formula as a page writes it.
export function formula(words) {
  return partsOf(words).map(([part, lowered]) => (lowered ? make("sub", {}, part) : part));
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

// The width of words [px].
export function wide(words, size, weight = 400) {
  ruler.font = `${weight} ${size}px ${FONT}`;
  return ruler.measureText(words).width;
}

// Round values from 0 on, at most so many steps; every second where there is little room.
export function steps(most, count, coarse = false) {
  const all = d3.ticks(0, most, count / Math.SQRT2); // Which rounds steps down by as much at most
  return coarse ? all.filter((_, k) => k % 2 === 0) : all;
}

// Points along a line, for words to avoid.
export function dots(points, step = 6) {
  return d3.pairs(points).flatMap(([[x1, y1], [x2, y2]]) => {
    const count = Math.min(MOST_DOTS, Math.ceil(Math.hypot(x2 - x1, y2 - y1) / step));
    return d3.range(count + 1).map((k) => [x1 + (k / count) * (x2 - x1), y1 + (k / count) * (y2 - y1)]);
  });
}

// Spots for lines of words around a point: right, left, above, below, and the four corners; or in another
// order, the preferred first.
export function around([x, y], gap, size, {lines = 1, order = d3.range(8)} = {}) {
  const further = size * 1.25 * (lines - 1);
  const shifts = [-further, size * 0.35 - further / 2, size * 0.8]; // Above, beside and below
  return order.map((k, cost) => {
    const [across, down] = SPOTS[k];
    const anchor = ["end", "middle", "start"][Math.sign(across) + 1];
    return {x: x + across * gap, y: y + down * gap + shifts[Math.sign(down) + 1], anchor, cost};
  });
}

// A picture of Plot with its scales and edges [px]; marks that a mission lacks are left out.
export class Picture {
  #taken = []; // Boxes [left, top, right, bottom] of words and of marks that they may not cover
  #faint = []; // Points that are better left free

  constructor({width, height, size, u, symbols}, {label, margins, marks, ...options}) {
    const [marginTop, marginRight, marginBottom, marginLeft] = margins;
    const plot = Plot.plot({
      ...{width, height, marginTop, marginRight, marginBottom, marginLeft},
      inset: 0,
      axis: null,
      color: {type: "identity"},
      style: `font: ${size - 1}px ${FONT}; background: none; color: ${colour("ink")}; overflow: hidden`,
      marks: marks.flat(Infinity).filter(Boolean),
      ...options,
    });
    const [x, y] = [plot.scale("x"), plot.scale("y")];
    Object.assign(plot.dataset, {x: x.domain.join(" "), y: y.domain.join(" ")});
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", label);
    Object.assign(this, {plot, width, height, size, u, symbols});
    [this.left, this.right] = d3.extent(x.range);
    [this.top, this.bottom] = d3.extent(y.range);
    this.x = Object.assign((value) => x.apply(value), {invert: x.invert});
    this.y = Object.assign((value) => y.apply(value), {invert: y.invert});
    this.axis = {size: size - 1, fill: "muted", halo: false}; // Look of what an axis is called
  }

  has([x, y]) {
    return x >= this.left && x <= this.right && y >= this.top && y <= this.bottom;
  }

  // Keeps words from a box around a point.
  keep([x, y], across, up = across) {
    this.#taken.push([x - across, y - up, x + across, y + up]);
  }

  avoid(points) {
    this.#faint.push(...points);
  }

  // Words with a halo in the colour of the ground, or none where they are on a fill.
  write({x, y, words, size = this.size, parent = this.plot, ...look}) {
    const {anchor = "start", fill = "ink", weight = 400, halo = true, symbol = "", mark = null} = look;
    const outline = {"paint-order": "stroke", stroke: colour("panel"), "stroke-width": size / 3.2};
    const font = {"font-size": size, "text-anchor": anchor, "font-weight": weight, fill: colour(fill)};
    const text = shape(parent, "text", {
      x,
      y,
      ...font,
      ...(halo ? {...outline, "stroke-linejoin": "round"} : {}),
    }, words);
    if (symbol) this.#writeFormula(text, symbol, size);
    if (mark) shape(text, "tspan", {dx: 1.2 * size, fill: colour(mark.role)}, mark.words);
    return text;
  }

  #writeFormula(text, words, size) {
    const all = shape(text, "tspan", {class: "sym", dx: 6});
    let raised = 0;
    for (const [part, lowered] of partsOf(words)) {
      const dy = (lowered ? LOWERED.down * size : 0) - raised;
      shape(all, "tspan", {dy, ...(lowered ? {"font-size": LOWERED.size * size} : {})}, part);
      raised += dy;
    }
  }

  // An arrow at the edge and words beside it, for what lies beyond it; where it would be [px].
  beyond([x, y], words, look) {
    const edge = EDGE_PX * this.u;
    const at = [
      Math.min(Math.max(x, this.left + edge), this.right - edge),
      Math.min(Math.max(y, this.top + edge), this.bottom - edge),
    ];
    const turn = (Math.atan2(y - at[1], x - at[0]) * 180) / Math.PI;
    const transform = `translate(${at}) rotate(${turn}) scale(${this.u})`;
    const arrow = {d: "M8,0L-5,-6.5L-5,6.5Z", transform, class: "beyond", fill: colour(look.fill)};
    shape(this.plot, "path", {...arrow, stroke: colour("panel"), "stroke-width": 1.5});
    this.keep(at, edge);
    return this.put([words], around(at, 12 * this.u, this.size), {...STRONG, ...look});
  }

  // Width and height of lines of words.
  extent([first, ...others], {size = this.size, weight = 400, symbol, mark}) {
    const whole = `${first}${symbol && this.symbols ? `  ${symbol}` : ""}${mark ? ` ${mark.words}   ` : ""}`;
    const across = d3.max([whole, ...others], (words) => wide(words, size, weight));
    return [across, size * (1.25 * others.length + 1.2)];
  }

  // The box of words at a spot.
  box({x, y, anchor}, [across, down], size = this.size) {
    const left = x - across * {start: 0, middle: 0.5, end: 1}[anchor];
    const top = y - 0.95 * size;
    return [left, top, left + across, top + down];
  }

  // Writes lines of words, the first in the weight, at the best of some spots {x, y, anchor, cost}; those
  // that are not needed only where they are free.
  put(lines, spots, {needed = true, ...look} = {}) {
    const {size = this.size} = look;
    const extent = this.extent(lines, look);
    const rated = spots.map((spot) => this.#rate(spot, this.box(spot, extent, size)));
    const best = d3.least(rated, ({cost}) => cost);
    if (!best || (!needed && !best.free)) return null;
    const [left, top, right, bottom] = best.box;
    this.#taken.push([left - APART_PX, top, right + APART_PX, bottom]);
    const {x, y, anchor} = best;
    best.text = this.write({...look, x, y, anchor, words: lines[0]});
    const under = {size, fill: look.fill, halo: look.halo, x, anchor};
    lines.slice(1).forEach((words, k) => this.write({...under, y: y + 1.25 * (k + 1) * size, words}));
    return best;
  }

  // A spot inside the picture, with the cost of moving it there and of what it covers.
  #rate(wished, [left, top, right, bottom]) {
    const dx = Math.max(Math.min(0, this.right - right), this.left - left);
    const dy = Math.max(-top, Math.min(0, this.bottom - bottom));
    const [a, b, c, d] = [left + dx, top + dy, right + dx, bottom + dy];
    const moved = Math.hypot(dx, dy);
    const covered = d3.sum(this.#taken, ([e, f, g, h]) =>
      Math.max(0, Math.min(c, g) - Math.max(a, e)) * Math.max(0, Math.min(d, h) - Math.max(b, f)));
    const crossed = this.#faint.filter(([x, y]) => x > a && x < c && y > b && y < d).length;
    return {
      ...wished,
      x: wished.x + dx,
      y: wished.y + dy,
      cost: (wished.cost ?? 0) + 0.5 * moved + 20 * covered + 6 * crossed,
      free: covered <= GRAZED * Math.min(c - a, LONG_PX) * (d - b) && !moved && crossed < CROSSED,
      box: [a, b, c, d],
    };
  }
}
