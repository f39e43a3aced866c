// Pictures in place of the plane: power on its way along the beam, power over speed, and the day.
import {GRID, NUMBERS, colour, explain, grouped, line} from "./drawing.js";
import {make, picture, place, steps, wide, write} from "./drawing.js";
import {Labels, around, dots} from "./labels.js";

const NARROW_PX = 440;
const COVERS = "who covers";
const DRAWN = {beam: drawBeam, speed: drawSpeed, day: drawDay};
const PALE = {fill: colour("muted"), fillOpacity: 0.16};

export function drawPicture(draw, answer, look) {
  const {picture: data} = answer;
  if (data.words) return explain(draw, data.words);
  const notes = make("ul", {class: "notes"}, ...data.notes.map((words) => make("li", {}, words)));
  draw.replaceChildren(notes);
  const room = {width: draw.clientWidth, height: draw.clientHeight - notes.offsetHeight};
  draw.prepend(...DRAWN[data.name](data, {...look, axes: look.axes ?? data.axes}, room));
}

// Around a picture, with room for the widest name at its left.
function edges(size, widest, marginRight, top = 0.5) {
  return {marginLeft: widest + size, marginRight, marginTop: top * size, marginBottom: 1.9 * size};
}

// What is left at each station of the way, and what was lost before it.
function drawBeam({title, stations}, {axes: [most], size, u}, {width, height}) {
  const names = stations.map(({words}) => words);
  const narrow = width < NARROW_PX * u; // Words stand above the bars, else beside them
  const widest = (key) => (narrow ? 0 : d3.max(stations, (station) => wide(station[key], size - 1)));
  const padding = narrow ? 0.6 : 0.25;
  const above = -((1 - padding) * (height - 1.9 * size)) / stations.length / 2 - 0.4 * size;
  const words = narrow
    ? {x: 0, text: ({words: name, said}) => `${name}: ${said}`, dy: above, dx: 2}
    : {x: "before_W", text: "said", dx: 6};
  const kind = ({electric}) => colour(electric ? "ink" : "laser");
  return [picture({
    width,
    height,
    size,
    ...edges(size, widest("words"), widest("said") + size),
    label: `${title}: ${stations.map((station) => `${station.words} ${station.said}`).join("; ")}`,
    x: {domain: [0, most], axis: null},
    y: {domain: names, axis: null, padding},
    marks: [
      Plot.gridX(steps(most, 5), GRID),
      Plot.axisX(steps(most, 5), {...NUMBERS, tickFormat: (power) => `${grouped(power)} W`}),
      !narrow && Plot.axisY({...NUMBERS, tickFormat: String, fill: colour("ink")}),
      Plot.barX(stations, {y: "words", x1: "power_W", x2: "before_W", ...PALE}),
      Plot.barX(stations, {y: "words", x: "power_W", fill: kind}),
      Plot.text(stations, {y: "words", textAnchor: "start", fill: colour("ink"), ...words}),
    ],
  })];
}

// The power at the rotors over the air speed, and the speeds that stand out.
function drawSpeed({speed_m_s, power_W, marks}, {axes: [most_x, most_y], size, u}, {width, height}) {
  const rows = d3.zip(speed_m_s, power_W);
  const brief = width < NARROW_PX * u;
  const said = marks.map(({words, power_W: power}) => (brief ? words : `${words}, ${power.toFixed(0)} W`));
  const points = {x: "speed_m_s", y: "power_W", r: 5 * u, stroke: colour("ink"), strokeWidth: 1.25 * u};
  const plot = picture({
    width,
    height,
    size,
    ...edges(size, wide(grouped(most_y), size), 12 * u),
    label: `Power over air speed: ${said.join("; ")}`,
    x: {domain: [0, most_x], axis: null},
    y: {domain: [0, most_y], axis: null},
    marks: [
      Plot.gridX(steps(most_x, 7), GRID),
      Plot.gridY(steps(most_y, 7), GRID),
      Plot.axisX(steps(most_x, 7).filter((speed) => speed < 0.7 * most_x), NUMBERS),
      Plot.axisY(steps(most_y, 7), NUMBERS),
      Plot.line(rows, {stroke: colour("flight"), strokeWidth: 2.75 * u}),
      Plot.dot(marks, {...points, fill: (_, k) => colour(k ? "optimum" : "hover")}),
    ],
  });
  const [x, y] = [place(plot, "x"), place(plot, "y")];
  const labels = new Labels(width, y(0), x(0));
  const top = {x: x(0) + 8 * u, y: 1.6 * size};
  const under = {x: x(most_x), y: y(0) + size + 4};
  nameAxes(plot, labels, under, top, size, ["air speed, m/s →", "↑ power at the rotors, W"]);
  labels.avoid(dots(rows.map(([speed, power]) => [x(speed), y(power)])));
  marks.forEach((mark, k) => {
    const spots = around(x(mark.speed_m_s), y(mark.power_W), 12 * u, size);
    const found = labels.find([said[k]], spots, {size, weight: 600});
    write(plot, {...found, words: said[k], size, weight: 600});
  });
  return [plot];
}

function nameAxes(plot, labels, under, top, size, [lower, upper]) {
  const muted = {size: size - 1, fill: "muted", halo: false};
  write(plot, {...under, words: lower, anchor: "end", ...muted});
  write(plot, {...top, words: upper, ...muted});
  labels.keep([top.x, top.y - size, top.x + wide(upper, size), top.y]);
}

// Who flies when, and beside it how many drones leave no gap, by the power of their pads.
function drawDay(data, look, {width, height}) {
  const narrow = width < NARROW_PX * look.u;
  const [across, down] = narrow ? [1, 0.55] : [0.58, 1];
  const ring = drawRing(data, look, {width: across * width, height: down * height});
  const rest = narrow ? {width, height: (1 - down) * height} : {width: (1 - across) * width, height};
  const pads = drawPads(data, look, rest);
  pads.style.left = narrow ? "0" : `${across * width}px`;
  pads.style.top = narrow ? `${down * height}px` : "0";
  return [ring, pads];
}

function drawRing({turns, drones}, {axes: [end, rows], size}, {width, height}) {
  const shown = turns.slice(0, rows);
  const names = d3.range(rows).map((k) => `drone ${k + 1}`);
  const stays = shown.flatMap((phases, k) => phases.map((phase) => ({...phase, drone: names[k]})));
  const hovers = stays.filter(({kind}) => kind === "hover").map((stay) => ({...stay, drone: COVERS}));
  const more = drones > shown.length ? ` (${shown.length} of ${drones} drones)` : "";
  const bar = {y: "drone", x1: "start_h", x2: "end_h", insetLeft: 0.5};
  const every = Math.ceil((1.1 * size * (rows + 1)) / (height - 2.3 * size)); // Names that keep apart
  const hours = steps(end, 6);
  const unit = (hour) => `${grouped(hour)}${hour === hours[1] ? " h" : ""}`;
  return picture({
    width,
    height,
    size,
    ...edges(size, wide(COVERS, size), 10),
    label: `Who flies when, the first turns${more}`,
    x: {domain: [0, end], axis: null},
    y: {domain: [...names, COVERS], axis: null, padding: 0.15},
    clip: true,
    marks: [
      Plot.axisX(hours.filter((hour) => hour < 0.97 * end), {...NUMBERS, tickFormat: unit}),
      Plot.axisY([...names.filter((_, k) => k % every === 0 && k <= rows - every), COVERS],
        {...NUMBERS, tickFormat: String, fill: colour("ink")}),
      Plot.barX(stays, {...bar, fill: ({kind}) => colour(kind === "wait" ? "line" : kind)}),
      Plot.barX(hovers, {...bar, fill: colour("hover"), fillOpacity: 0.75}),
    ],
  });
}

function drawPads({pads, drones, most_W}, {axes: [, , most_x, most_y], size, u}, {width, height}) {
  const counts = steps(most_y, 5).filter(Number.isInteger);
  const plot = picture({
    width,
    height,
    size,
    ...edges(size, wide(grouped(most_y), size), 12 * u, 1.8),
    label: `Drones that leave no gap by the power of a pad: ${pads.map((pad) =>
      `${pad.drones} with ${pad.power_W.toFixed(0)} W`).join(", ")}; with the laser ${drones}`,
    x: {domain: [0, most_x], axis: null},
    y: {domain: [0, most_y], axis: null},
    marks: [
      Plot.gridY(counts, GRID),
      Plot.axisY(counts, NUMBERS),
      Plot.axisX(steps(most_x, 4).filter((power) => power < 0.5 * most_x), NUMBERS),
      Plot.ruleX([most_W], line("bounds", u)),
      Plot.ruleY([drones], line("laser", u)),
      Plot.line(pads, {x: "power_W", y: "drones", stroke: colour("ink"), strokeWidth: 1.25 * u}),
      Plot.dot(pads, {x: "power_W", y: "drones", r: 4 * u, fill: colour("ink")}),
    ],
  });
  const [x, y] = [place(plot, "x"), place(plot, "y")];
  const labels = new Labels(width, y(0), x(0));
  const under = {x: x(most_x), y: y(0) + size + 4};
  const names = ["power of a pad, W →", "↑ drones without a gap"];
  nameAxes(plot, labels, under, {x: x(0), y: size}, size, names);
  labels.avoid(dots(pads.map((pad) => [x(pad.power_W), y(pad.drones)])));
  const spots = d3.range(0.05, 0.9, 0.1).flatMap((share) => [-6, 1.1 * size].map((below) =>
    ({x: x(share * most_x), y: y(drones) + below, anchor: "start", cost: below > 0 ? 1 : 0})));
  const words = `laser: ${drones}`;
  write(plot, {...labels.find([words], spots, {size, weight: 600}), words, size, weight: 600, fill: "laser"});
  return plot;
}
