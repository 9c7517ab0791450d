// The next seconds of the rig and its lens as a film (WebM).

import { HEAD, copy, writeHead } from "./picture.js";

const LONG = 5e3; // ms
const RATE = 30; // pictures per second
const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm"];

/** A film of the canvases in an element, `long` ms, below a `title`, as a Blob. */
export function filmOf(element, long = LONG, title = "BirthSIM") {
  const type = window.MediaRecorder && KINDS.find((kind) => MediaRecorder.isTypeSupported(kind));
  if (!type) throw new Error("film: this browser records none; allowed: one with MediaRecorder and WebM");
  const { left, top, width, height } = element.getBoundingClientRect();
  const picture = Object.assign(document.createElement("canvas"), { width: 2 * Math.round(width / 2), height: 2 * Math.round((height + HEAD) / 2) });
  const context = picture.getContext("2d");
  const recorder = new MediaRecorder(picture.captureStream(RATE), { mimeType: type, videoBitsPerSecond: 4e6 });
  const pieces = [];
  recorder.addEventListener("dataavailable", ({ data }) => pieces.push(data));
  const begun = performance.now();
  const draw = () => {
    writeHead(context, title, width);
    context.save();
    context.translate(-left, HEAD - top);
    context.fillStyle = getComputedStyle(document.body).backgroundColor;
    context.fillRect(left, top, width, height);
    for (const canvas of element.querySelectorAll("canvas")) copy(context, canvas);
    context.restore();
    if (performance.now() < begun + long) requestAnimationFrame(draw);
    else recorder.stop();
  };
  return new Promise((resolve) => {
    recorder.addEventListener("stop", () => resolve(new Blob(pieces, { type: "video/webm" })));
    recorder.start();
    draw();
  });
}
