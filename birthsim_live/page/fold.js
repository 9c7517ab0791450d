// The lab on a phone: a sheet below the rig, as high as its handle is dragged; a tap folds it away and back.

const LEAST = 40; // px: the handle alone
const USUAL = 0.42; // of the window
const MOST = 0.7;
const TAP = 5; // px
const STEP = 60; // px of an arrow key

export function foldable(sheet, handle) {
  const set = (height) => {
    const given = Math.min(Math.max(height, LEAST), MOST * innerHeight);
    sheet.style.setProperty("--fold", `${given}px`);
    handle.setAttribute("aria-valuenow", Math.round((100 * given) / innerHeight));
  };
  let held = null; // { from: where the sheet's foot would be, start: where the finger came down }, px
  handle.addEventListener("pointerdown", ({ pointerId, clientY }) => {
    handle.setPointerCapture(pointerId);
    held = { from: sheet.clientHeight + clientY, start: clientY };
  });
  handle.addEventListener("pointermove", ({ clientY }) => held && set(held.from - clientY));
  handle.addEventListener("pointerup", ({ clientY }) => {
    if (held && Math.abs(clientY - held.start) < TAP) set(sheet.clientHeight > 2 * LEAST ? LEAST : USUAL * innerHeight);
  });
  handle.addEventListener("lostpointercapture", () => {
    held = null;
  });
  handle.addEventListener("keydown", (event) => {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!way) return;
    event.stopPropagation(); // elsewhere they push the head
    event.preventDefault();
    set(sheet.clientHeight + way * STEP);
  });
}
