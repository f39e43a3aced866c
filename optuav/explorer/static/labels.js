// Words that keep apart: places for labels in a picture where no other words or marks are.
import {wide} from "./drawing.js";

const APART_PX = 3; // Between words that are side by side
const GRAZED = 0.06; // Share of words that may touch a mark
const CROSSED = 3; // Points that words may not cover, where they are not needed
const MOST_DOTS = 400; // Along a line

// `taken` are boxes [left, top, right, bottom], and `faint` points that are better left free. A label
// has candidates {x, y, anchor, cost}; one that is not needed may have no place.
export class Labels {
  #taken = [];
  #faint = [];
  #frame;

  constructor(width, height, left = 0) {
    this.#frame = {width, height, left};
  }

  keep(box) {
    this.#taken.push(box);
  }

  // Keeps words from a point of the picture.
  keepAround([x, y], across, up = across) {
    this.keep([x - across, y - up, x + across, y + up]);
  }

  avoid(points) {
    this.#faint.push(...points);
  }

  box({x, y, anchor}, lines, size, weight) {
    const across = d3.max(lines, (words) => wide(words, size, weight));
    const down = size * (1.25 * lines.length - 0.05);
    const left = x - across * {start: 0, middle: 0.5, end: 1}[anchor];
    const top = y - 0.95 * size;
    return [left, top, left + across, top + down];
  }

  find(lines, candidates, {size, weight = 400, needed = true}) {
    const rated = candidates.map((wished) => this.#rate(wished, this.box(wished, lines, size, weight)));
    const best = d3.least(rated, ({cost}) => cost);
    if (!best || (!needed && !best.free)) return null;
    const [left, top, right, bottom] = best.box;
    this.keep([left - APART_PX, top, right + APART_PX, bottom]);
    return best;
  }

  // A candidate inside the picture, with the cost of moving it there and of what it covers.
  #rate(wished, [left, top, right, bottom]) {
    const {width, height, left: edge} = this.#frame;
    const dx = Math.max(Math.min(0, width - right), edge - left);
    const dy = Math.max(-top, Math.min(0, height - bottom));
    const box = [left + dx, top + dy, right + dx, bottom + dy];
    const [a, b, c, d] = box;
    const moved = Math.hypot(dx, dy);
    const covered = d3.sum(this.#taken, (other) => overlap(box, other));
    const crossed = this.#faint.filter(([x, y]) => x > a && x < c && y > b && y < d).length;
    return {
      ...wished,
      x: wished.x + dx,
      y: wished.y + dy,
      cost: (wished.cost ?? 0) + 0.5 * moved + 20 * covered + 6 * crossed,
      free: covered <= GRAZED * (c - a) * (d - b) && !moved && crossed < CROSSED,
      box,
    };
  }
}

function overlap([a, b, c, d], [e, f, g, h]) {
  return Math.max(0, Math.min(c, g) - Math.max(a, e)) * Math.max(0, Math.min(d, h) - Math.max(b, f));
}

// Candidates around a point, at a distance: right, left, above, below, and the four corners.
export function around(x, y, gap, size, lines = 1) {
  const down = size * 1.25 * (lines - 1);
  const middle = y + size * 0.35 - down / 2;
  const corners = [[1, -1], [-1, -1], [1, 1], [-1, 1]].map(([across, below]) => ({
    x: x + 0.8 * across * gap,
    y: below < 0 ? y - 0.7 * gap - down : y + 0.7 * gap + size * 0.8,
    anchor: across > 0 ? "start" : "end",
    cost: 3,
  }));
  return [
    {x: x + gap, y: middle, anchor: "start", cost: 0},
    {x: x - gap, y: middle, anchor: "end", cost: 1},
    {x, y: y - gap - down, anchor: "middle", cost: 2},
    {x, y: y + gap + size * 0.8, anchor: "middle", cost: 2},
    ...corners,
  ];
}

// Points along a line, for words to avoid.
export function dots(points, step = 6) {
  return d3.pairs(points).flatMap(([[x1, y1], [x2, y2]]) => {
    const count = Math.min(MOST_DOTS, Math.ceil(Math.hypot(x2 - x1, y2 - y1) / step));
    return d3.range(count + 1).map((k) => [x1 + (k / count) * (x2 - x1), y1 + (k / count) * (y2 - y1)]);
  });
}
