// Files that are saved: the pictures as they are seen, in the colours of paper, and what the answer holds.
import {button, shape} from "./drawing.js";

const HEAD_PX = 34; // Of the title
const COPIED_MS = 2000; // For which it is told

export function save(name, blob) {
  const link = document.createElement("a");
  Object.assign(link, {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// What can be shared: a link, what the answer holds, and pictures.
export function shareMenu(root, session, model) {
  const picture = () => drawing(root, session.shown.verdict.text);
  const stem = session.shown.name.replace(/[^\p{L}\p{N}.-]+/gu, "-") || "mission";
  const vector = () => save(`${stem}.svg`, new Blob([picture()], {type: "image/svg+xml"}));
  const pixels = async () => save(`${stem}.png`, await raster(picture()));
  const files = [
    button("Mission (TOML)", () => session.file("mission")),
    button("Plan (JSON)", () => session.file("plan")),
  ];
  return [
    ...(model.get("link") ? [button("Copy link", (made) => copyLink(made, session))] : []),
    ...(session.stored ? [] : files),
    button("Picture (SVG)", vector),
    button("Picture (PNG)", pixels),
  ];
}

async function copyLink(made, session) {
  const copied = navigator.clipboard.writeText(session.link());
  made.textContent = await copied.then(() => "Link copied", () => "It is in the address bar");
  setTimeout(() => (made.textContent = "Copy link"), COPIED_MS);
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
  for (const part of plans.querySelectorAll("figcaption, h2.title, .draw > svg[role=img], .notes li")) {
    const box = part.getBoundingClientRect();
    if (!box.width) continue;
    const at = {x: box.left - left, y: box.top - top + HEAD_PX};
    if (part.tagName === "svg") whole.append(copied(part, at, root.classList.contains("symbols")));
    else shape(whole, "text", {x: at.x + 10, y: at.y + 20, "font-size": 14, ...strong}, titleOf(part));
  }
  const text = new XMLSerializer().serializeToString(whole);
  return text.replaceAll(/var\(--([\w-]+)\)/g, (_, role) => LOOKS[role].light);
}

function copied(picture, {x, y}, symbols) {
  const copy = picture.cloneNode(true);
  copy.setAttribute("x", x);
  copy.setAttribute("y", y);
  if (!symbols) copy.querySelectorAll(".sym").forEach((symbol) => symbol.remove());
  return copy;
}

function titleOf(part) {
  return part.firstChild.textContent + (part.tagName === "H2" ? part.children[0].textContent : "");
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
