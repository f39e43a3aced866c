// Pictures in place of the plane: power on its way along the beam, power over speed, and the day.
import {GRID, NUMBERS, Picture, STRONG, around, colour} from "./drawing.js";
import {dots, grouped, line, make, steps, wide} from "./drawing.js";

const NARROW_PX = 440;
const COVERS = "on station";
const DRAWN = {beam: drawBeam, speed: drawSpeed, day: drawDay};
const FLIGHT = {fill: "flight"};
const INK = {fill: "ink"};
const PALE = {fill: colour("muted"), fillOpacity: 0.16};
const NAMES = {...NUMBERS, tickFormat: String, fill: colour("ink")};

export function drawPicture(draw, {picture: data}, {axes, ...look}) {
  const named = look.width < NARROW_PX * look.u ? [] : [data.title]; // Above the picture
  const said = [data.title, ...data.notes].filter((words) => !named.includes(words));
  const key = data.key ? [make("li", {class: "key"}, ...data.key.map(keyed))] : [];
  const notes = make("ul", {class: "notes"}, ...key, ...said.map((words) => make("li", {}, words)));
  draw.replaceChildren(notes);
  const height = look.height - notes.offsetHeight;
  draw.prepend(...DRAWN[data.name](data, {...look, height, axes: axes ?? data.axes}));
}

// The colour of a phase, and its words.
function keyed([kind, words]) {
  const swatch = make("i");
  swatch.style.background = phaseColour(kind);
  return make("span", {}, swatch, words);
}

function phaseColour(kind) {
  return colour(kind === "wait" ? "line" : kind);
}

// Around a picture, with room for the widest name at its left.
function edges(size, widest, right, top = 0.5) {
  return [top * size, right, 1.9 * size, widest + size];
}

// What is left at each station of the way, and what was lost before it.
function drawBeam({title, stations}, {axes: [most], ...look}) {
  const {width, height, size, u} = look;
  const narrow = width < NARROW_PX * u; // Words stand above the bars, else beside them
  const widest = (key) => (narrow ? 0 : d3.max(stations, (station) => wide(station[key], size - 1)));
  const padding = narrow ? 0.6 : 0.25;
  const uncut = ({before_W, said}) => (before_W > most ? `→ ${said}` : said);
  const above = -((1 - padding) * (height - 1.9 * size)) / stations.length / 2 - 0.4 * size;
  const words = narrow
    ? {x: 0, text: (station) => `${station.words}: ${uncut(station)}`, dy: above, dx: 2}
    : {x: ({before_W}) => Math.min(before_W, most), text: uncut, dx: 6};
  const left = {x: "power_W", fill: ({electric}) => colour(electric ? "ink" : "laser")};
  return [new Picture(look, {
    margins: edges(size, widest("words"), widest("said") + size),
    label: `${title}: ${stations.map((station) => `${station.words} ${station.said}`).join("; ")}`,
    x: {domain: [0, most]},
    y: {domain: stations.map((station) => station.words), padding},
    marks: [
      Plot.gridX(steps(most, 5), GRID),
      Plot.axisX(steps(most, 5), {...NUMBERS, tickFormat: (power) => `${grouped(power)} W`}),
      !narrow && Plot.axisY(NAMES),
      Plot.barX(stations, {y: "words", x1: "power_W", x2: "before_W", ...PALE, clip: true}),
      Plot.barX(stations, {y: "words", ...left, clip: true}),
      Plot.text(stations, {y: "words", textAnchor: "start", fill: colour("ink"), ...words}),
    ],
  }).plot];
}

// The power at the rotors over the air speed, and the speeds that stand out.
function drawSpeed({speed_m_s, power_W, marks}, {axes: [most_x, most_y], ...look}) {
  const {width, size, u} = look;
  const rows = d3.zip(speed_m_s, power_W);
  const brief = width < NARROW_PX * u;
  const said = marks.map(({words, power_W: power}) => (brief ? words : `${words}, ${power.toFixed(0)} W`));
  const within = ({speed_m_s: speed, power_W: power}) => speed <= most_x && power <= most_y;
  const edge = {stroke: colour("ink"), strokeWidth: 1.25 * u, filter: within};
  const points = {x: "speed_m_s", y: "power_W", r: 5 * u, ...edge};
  const picture = new Picture(look, {
    margins: edges(size, wide(grouped(most_y), size), 12 * u),
    label: `Power against airspeed: ${said.join("; ")}`,
    x: {domain: [0, most_x]},
    y: {domain: [0, most_y]},
    marks: [
      Plot.gridX(steps(most_x, 7), GRID),
      Plot.gridY(steps(most_y, 7), GRID),
      Plot.axisX(steps(most_x, 7).filter((speed) => speed < 0.7 * most_x), NUMBERS),
      Plot.axisY(steps(most_y, 7), NUMBERS),
      Plot.line(rows, {stroke: colour("flight"), strokeWidth: 2.75 * u, clip: true}),
      Plot.dot(marks, {...points, fill: (_, k) => colour(k ? "optimum" : "hover")}),
    ],
  });
  const {x, y, left} = picture;
  nameAxes(picture, ["air speed, m/s →", "↑ power at the rotors, W"], {x: left + 8 * u, y: 1.6 * size});
  picture.avoid(dots(rows.map(([speed, power]) => [x(speed), y(power)]).filter((at) => picture.has(at))));
  const highest = d3.greatest(rows.filter(([speed]) => speed <= most_x), ([, power]) => power);
  if (highest[1] > most_y) {
    picture.beyond(highest.map((value, k) => [x, y][k](value)), `up to ${highest[1].toFixed(0)} W`, FLIGHT);
  }
  marks.forEach((mark, k) => {
    const spots = around([x(mark.speed_m_s), y(mark.power_W)], 12 * u, size);
    if (within(mark)) picture.put([said[k]], spots, STRONG);
  });
  return [picture.plot];
}

function nameAxes(picture, [lower, upper], top) {
  const {right, bottom, size, axis} = picture;
  picture.write({x: right, y: bottom + size + 4, words: lower, anchor: "end", ...axis});
  picture.put([upper], [{...top, anchor: "start"}], axis);
}

// Who flies when, and beside it how many drones leave no gap, by the power of their pads.
function drawDay(data, look) {
  const {width, height, u} = look;
  const narrow = width < NARROW_PX * u;
  const [across, down] = narrow ? [1, 0.54] : [0.58, 1];
  const ring = drawRing(data, {...look, width: across * width, height: down * height});
  const rest = narrow ? {height: (1 - down) * height} : {width: (1 - across) * width};
  const pads = drawPads(data, {...look, ...rest});
  Object.assign(pads.style, narrow ? {top: `${down * height}px`} : {left: `${across * width}px`});
  return [ring, pads];
}

function drawRing({turns, drones}, {axes: [end, rows], ...look}) {
  const {height, size} = look;
  const shown = turns.slice(0, rows);
  const names = d3.range(rows).map((k) => `drone ${k + 1}`);
  const stays = shown.flatMap((phases, k) => phases.map((phase) => ({...phase, drone: names[k]})));
  const more = drones > shown.length ? ` (${shown.length} of ${drones} drones)` : "";
  const numbered = (name) => (more && name === names[0] ? `1 of ${drones}` : name);
  const bar = {x1: "start_h", x2: "end_h", insetLeft: 0.5};
  const covers = {y: () => COVERS, filter: ({kind}) => kind === "hover", fillOpacity: 0.75};
  const covered_h = stays.find(({kind}) => kind === "hover").start_h;
  const others = {...bar, y: () => COVERS, fill: colour("hover"), fillOpacity: 0.4}; // Not drawn above
  const every = Math.ceil((1.1 * size * (rows + 1)) / (height - 2.3 * size)); // Names that keep apart
  const named = names.filter((_, k) => k % every === 0 && k <= rows - every);
  const hours = steps(end, 6);
  const unit = (hour) => `${grouped(hour)}${hour === hours[1] ? " h" : ""}`;
  return new Picture(look, {
    margins: edges(size, wide(COVERS, size), 10),
    label: `Which drone flies when, the first turns${more}`,
    x: {domain: [0, end]},
    y: {domain: [...names, COVERS], padding: 0.15},
    clip: true,
    marks: [
      Plot.axisX(hours.filter((hour) => hour < 0.97 * end), {...NUMBERS, tickFormat: unit}),
      Plot.axisY([...named, COVERS], {...NAMES, tickFormat: numbered}),
      more && Plot.barX([{start_h: covered_h, end_h: end}], others),
      Plot.barX(stays, {...bar, y: "drone", fill: ({kind}) => phaseColour(kind)}),
      Plot.barX(stays, {...bar, ...covers, fill: colour("hover")}),
    ],
  }).plot;
}

function drawPads({pads, drones, most_W}, {axes: [, , most_x, most_y], ...look}) {
  const {height, size, u} = look;
  const [top, bottom] = [1.8 * size, 3.2 * size]; // With room for what the axes are called
  const levels = Math.max(2, Math.min(5, (height - top - bottom) / (1.4 * size)));
  const counts = steps(most_y, levels).filter(Number.isInteger);
  const place = {x: "power_W", y: "drones"};
  const each = pads.map((pad) => `${pad.drones} with ${pad.power_W.toFixed(0)} W`).join(", ");
  const picture = new Picture(look, {
    margins: [top, 14 * u, bottom, wide(grouped(most_y), size) + size],
    label: `Drones that leave no gap, against pad power: ${each}; with the laser ${drones}`,
    x: {domain: [0, most_x]},
    y: {domain: [0, most_y]},
    marks: [
      Plot.gridY(counts, GRID),
      Plot.axisY(counts, NUMBERS),
      Plot.axisX(steps(most_x, 5), NUMBERS),
      Plot.ruleX([most_W], line("bounds", u)),
      Plot.ruleY([drones], {...line("laser", u), clip: true}),
      Plot.line(pads, {...place, stroke: colour("ink"), strokeWidth: 1.25 * u, clip: true}),
      Plot.dot(pads, {...place, r: 4 * u, fill: colour("ink"), filter: (pad) => pad.drones <= most_y}),
    ],
  });
  const {x, y, left, right, axis} = picture;
  picture.write({...axis, x: right, y: height - 0.5 * size, words: "power of each pad, W", anchor: "end"});
  picture.write({...axis, x: left - 0.5 * size, y: size, words: "↑ drones without a gap"});
  const points = pads.map((pad) => [x(pad.power_W), y(pad.drones)]);
  picture.avoid(dots(points.filter((at) => picture.has(at))));
  const most = d3.greatest(pads, (pad) => pad.drones);
  if (most?.drones > most_y) picture.beyond([x(most.power_W), y(most.drones)], `${most.drones}`, INK);
  const spots = d3.range(0.05, 0.9, 0.1).flatMap((share) => [-6, 1.1 * size].map((below) =>
    ({x: x(share * most_x), y: y(drones) + below, anchor: "start", cost: below > 0 ? 1 : 0})));
  const beside = d3.range(1, 8).map(
    (row) => ({x: x(most_W) - 5 * u, y: y(most_y) + row * size, anchor: "end"}),
  );
  const accepts = `${most_W.toFixed(0)} W`;
  for (const words of [`most the battery accepts: ${accepts}`, `battery: ${accepts}`]) {
    if (most_W <= most_x && picture.put([words], beside, {...axis, needed: false})) break;
  }
  if (drones <= most_y) picture.put([`laser: ${drones}`], spots, {...STRONG, fill: "laser"});
  else picture.beyond([left, y(drones)], `laser: ${drones}`, {fill: "laser"});
  return picture.plot;
}
