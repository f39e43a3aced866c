// The drone at a moment: on its way, at a stop, or falling once its available well is empty.
import {colour, shape, write} from "./drawing.js";
import {placeOf} from "./map.js";

// Steps of a fall: below, aside [px], strength, and turn.
const FALL = [
  {down: 30, aside: 0, opacity: 0.3, turn: 10},
  {down: 56, aside: 2, opacity: 0.55, turn: 28},
  {down: 86, aside: 5, opacity: 1, turn: 55},
];
const FALLEN_PX = 118; // Where it says so
const ROTORS = [[-11, -7], [11, -7], [-11, 7], [11, 7]];

export function drawDrone({plot, x, y, height, size, u}, {map, wells, verdict}, moment) {
  d3.select(plot).selectAll(".drone").remove();
  if (moment === null || !wells) return;
  const group = shape(plot, "g", {class: "drone"});
  const falls = wells.dry_s !== null && moment >= wells.dry_s;
  const [px, py] = positionAt(map, wells.phases, falls ? wells.dry_s : moment);
  const at = {x: x(px), y: y(py)};
  if (!falls) return drawCraft(group, at, {opacity: 1, turn: 0}, "ink", u);
  const room = Math.max(0.3, Math.min(1, (height - at.y - 2 * size) / (FALLEN_PX * u)));
  for (const {down, aside, ...look} of FALL) {
    drawCraft(group, {x: at.x + aside * u, y: at.y + down * room * u}, look, "dry", u);
  }
  const below = {x: at.x, y: at.y + FALLEN_PX * room * u};
  write(group, {...below, words: verdict.event, size, anchor: "middle", weight: 600, fill: "dry"});
}

// Along the way from stop to stop, by its waypoints, slow at both ends.
function positionAt(map, phases, time) {
  const k = Math.max(0, phases.findIndex(({end_s}) => time <= end_s));
  const {kind, at, by, start_s, end_s} = phases[k];
  const to = placeOf(map, at);
  if (kind !== "flight") return to;
  const from = placeOf(map, phases[k - 1]?.at ?? "origin");
  const points = [from, ...by, to];
  const length = (a, b) => Math.hypot(...a.map((m, axis) => b[axis] - m));
  const flown_m = [0, ...d3.cumsum(d3.pairs(points, length))];
  const share = d3.easeQuadInOut((time - start_s) / Math.max(end_s - start_s, 1e-9));
  return d3.scaleLinear(flown_m, points)(share * flown_m.at(-1));
}

function drawCraft(group, {x, y}, {opacity, turn}, role, u) {
  const craft = shape(group, "g", {
    transform: `translate(${x} ${y}) rotate(${turn}) scale(${u})`,
    opacity,
    stroke: colour(role),
    "stroke-width": 2.5,
    fill: "none",
  });
  shape(craft, "path", {d: "M-9,-6L9,6M-9,6L9,-6"});
  for (const [cx, cy] of ROTORS) shape(craft, "circle", {cx, cy, r: 4.5});
}
