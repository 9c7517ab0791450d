// The page's pictures, plots and numbers as one picture: canvases are copied, words and marks are written where they stand.

const LEFT_OUT = ".settings, .under, .hint, .banner, .scrubber, .unseen, .handle, script, style";
const PAINTED = ".readouts, .physics";

export const HEAD = 24; // px of the line above that says what is shown

/** A PNG of what can be seen of an element, below its `title`, as a Blob. */
export function pictureOf(element, title) {
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  const parts = [...element.children].flatMap((child) => (child.matches(".fold") ? [...child.children] : child));
  const inside = parts.filter((part) => part.offsetParent && !part.matches(LEFT_OUT)).map((part) => part.getBoundingClientRect());
  const [left, top] = [Math.min(...inside.map((box) => box.left)), Math.min(...inside.map((box) => box.top))];
  const [right, bottom] = [Math.max(...inside.map((box) => box.right)), Math.max(...inside.map((box) => box.bottom))];
  const picture = document.createElement("canvas");
  picture.width = Math.round((right - left) * ratio);
  picture.height = Math.round((bottom - top + HEAD) * ratio);
  const context = picture.getContext("2d");
  context.scale(ratio, ratio);
  writeHead(context, title, right - left);
  context.translate(-left, HEAD - top);
  context.fillStyle = getComputedStyle(document.body).backgroundColor;
  context.fillRect(left, top, right - left, bottom - top);
  const shown = [...element.querySelectorAll("*")].filter((one) => one.checkVisibility() && !one.closest(LEFT_OUT));
  for (const one of shown.filter((part) => part.matches(PAINTED))) paint(context, one);
  for (const one of shown) {
    if (one instanceof HTMLCanvasElement) copy(context, one);
    else if (one instanceof SVGSVGElement) mark(context, one);
    else for (const node of one.childNodes) if (node.nodeType === Node.TEXT_NODE) write(context, node);
  }
  return new Promise((resolve) => picture.toBlob(resolve, "image/png"));
}

/** One line across `width`, px, at the top. */
export function writeHead(context, title, width) {
  const look = getComputedStyle(document.body);
  context.fillStyle = look.backgroundColor;
  context.fillRect(0, 0, width, HEAD);
  context.font = `600 13px ${look.fontFamily}`;
  context.fillStyle = look.color;
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillText(title, 10, HEAD / 2, width - 20);
}

function paint(context, element) {
  const { left, top, width, height } = element.getBoundingClientRect();
  context.fillStyle = getComputedStyle(element).backgroundColor;
  context.fillRect(left, top, width, height);
}

export function copy(context, canvas) {
  const { left, top, width, height } = canvas.getBoundingClientRect();
  if (width && height && canvas.width && canvas.height) context.drawImage(canvas, left, top, width, height);
}

function mark(context, drawing) {
  const box = drawing.getBoundingClientRect();
  const { x, y, width, height } = drawing.viewBox.baseVal;
  const scale = Math.min(box.width / width, box.height / height);
  context.save();
  context.translate(box.left + (box.width - scale * width) / 2, box.top + (box.height - scale * height) / 2);
  context.scale(scale, scale);
  context.translate(-x, -y);
  for (const shape of drawing.querySelectorAll("path, circle")) {
    const look = getComputedStyle(shape);
    const line = new Path2D(shape.getAttribute("d") ?? undefined);
    if (shape.tagName === "circle") line.arc(shape.cx.baseVal.value, shape.cy.baseVal.value, shape.r.baseVal.value, 0, 2 * Math.PI);
    context.setLineDash(look.strokeDasharray === "none" ? [] : look.strokeDasharray.split(",").map(parseFloat));
    context.lineWidth = parseFloat(look.strokeWidth);
    if (look.fill !== "none") {
      context.fillStyle = look.fill;
      context.fill(line);
    }
    if (look.stroke !== "none") {
      context.strokeStyle = look.stroke;
      context.stroke(line);
    }
  }
  context.restore();
}

/** Text of one node, line by line where it is broken. */
function write(context, node) {
  const look = getComputedStyle(node.parentElement);
  context.font = `${look.fontStyle} ${look.fontWeight} ${look.fontSize} ${look.fontFamily}`;
  context.fillStyle = look.color;
  context.textAlign = "left";
  context.textBaseline = "middle";
  const range = document.createRange();
  let [words, line] = ["", null];
  const flush = () => words.trim() && context.fillText(words, line.left, (line.top + line.bottom) / 2);
  [...node.data].forEach((letter, k) => {
    range.setStart(node, k);
    range.setEnd(node, Math.min(k + letter.length, node.length));
    const box = range.getBoundingClientRect();
    if (!box.width) return;
    if (line && Math.abs(box.top - line.top) > 2) {
      flush();
      [words, line] = ["", null];
    }
    line ??= box;
    words += letter;
  });
  flush();
}
