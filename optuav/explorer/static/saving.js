// Files that are saved: the pictures as they are seen, in the colours of paper, and what the answer holds.
import {shape} from "./drawing.js";

const HEAD_PX = 34; // Of the title
const COPIED_MS = 2000; // For which it is told
const PARTS = "figcaption, h2.title, .draw > svg[role=img], .notes li";

export function save(name, content, type = "") {
  const link = document.createElement("a");
  Object.assign(link, {href: URL.createObjectURL(new Blob([content], {type})), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export async function copyLink(made, session) {
  const copied = navigator.clipboard.writeText(session.link());
  made.textContent = await copied.then(
    () => "Link copied", () => "Not copied: the link is in the address bar"
  );
  setTimeout(() => (made.textContent = "Copy link"), COPIED_MS);
}

export async function savePicture(kind, root, {name, verdict}) {
  const stem = name.replace(/[^\p{L}\p{N}.-]+/gu, "-") || "mission";
  const svg = drawing(root, verdict.text);
  if (kind === "svg") save(`${stem}.svg`, svg, "image/svg+xml");
  else save(`${stem}.png`, await raster(svg), "image/png");
}

function drawing(root, title) {
  const plans = root.querySelector(".plans");
  const {left, top, width, height} = plans.getBoundingClientRect();
  const whole = d3.create("svg:svg")
    .attr("xmlns", "http://www.w3.org/2000/svg")
    .attr("font-family", "system-ui, sans-serif")
    .attr("width", width)
    .attr("height", height + HEAD_PX)
    .attr("viewBox", [0, 0, width, height + HEAD_PX])
    .node();
  shape(whole, "rect", {width: "100%", height: "100%", fill: "var(--panel)"});
  const strong = {"font-weight": 600, fill: "var(--ink)"};
  shape(whole, "text", {x: 10, y: 22, "font-size": 16, ...strong}, title);
  for (const part of plans.querySelectorAll(PARTS)) {
    const box = part.getBoundingClientRect();
    if (!box.width) continue;
    const [x, y] = [box.left - left, box.top - top + HEAD_PX];
    if (part.tagName === "svg") whole.append(copied(part, x, y, root.classList.contains("symbols")));
    else shape(whole, "text", {x: x + 10, y: y + 20, "font-size": 14, ...strong}, titleOf(part));
  }
  const text = new XMLSerializer().serializeToString(whole);
  return text.replaceAll(/var\(--([\w-]+)\)/g, (_, role) => LOOKS[role].light);
}

function copied(picture, x, y, symbols) {
  const copy = d3.select(picture).clone(true).remove().attr("x", x).attr("y", y);
  if (!symbols) copy.selectAll(".sym").remove();
  return copy.node();
}

function titleOf(part) {
  if (part.tagName === "H2") return part.firstChild.textContent + part.children[0].textContent;
  return (part.children[0] ?? part).textContent;
}

async function raster(svg) {
  const image = new Image();
  const address = URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
  image.src = address;
  await image.decode();
  const canvas = new OffscreenCanvas(2 * image.width, 2 * image.height);
  const context = canvas.getContext("2d");
  context.scale(2, 2);
  context.drawImage(image, 0, 0);
  URL.revokeObjectURL(address);
  return canvas.convertToBlob();
}
