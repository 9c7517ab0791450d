// Puts the page together: what comes from the rig, what is drawn when, and what the keys do.

import { About } from "./about.js";
import { Challenge } from "./challenge.js";
import { DEEPER, PLOTS, RMS, UNITS, rowOf } from "./curves.js";
import { inWords } from "./described.js";
import { Files } from "./files.js";
import { Gamepad } from "./gamepad.js";
import { Gauges } from "./gauges.js";
import { Guide } from "./guide.js";
import { Hand } from "./hand.js";
import { History } from "./history.js";
import { Keys, keyOfTheRig } from "./keys.js";
import { Learning } from "./learning/panel.js";
import { Link, settingsIn } from "./link.js";
import { Magnifier } from "./magnifier.js";
import { Means } from "./means.js";
import { Monitor } from "./monitor.js";
import { Notices } from "./notices.js";
import { Physics } from "./physics/panel.js";
import { Plots } from "./plots.js";
import { Readouts } from "./readouts.js";
import { Rigs } from "./rigs.js";
import { Settings } from "./settings.js";
import { Sound } from "./sound.js";
import { Source } from "./source.js";
import { explain } from "./terms.js";
import { Transport } from "./transport.js";
import { Views } from "./views.js";
import { sifted } from "./worker/settings.js";

const byId = (id) => document.getElementById(id);

/**
 * What the page knows, for tests and for the curious:
 * `frame` is the newest frame of the rig, `settings` and `state` its last words on those, `hello` its greeting,
 * `connected` whether it is there, `monitor` what the page measures of itself, `send` a message to it, `pixel([x, y], k)` the
 * place of a point (m) on the screen in CSS px from the corner of the window, in picture 0 or 1, `scenes` the two pictures,
 * `plots` the curves, `learning` the controller that learns here.
 */
const send = (message) => source.send(message);
const rig = { frame: null, settings: null, state: null, hello: null, connected: false, monitor: new Monitor(), send, pixel, scenes: [], plots: null, learning: null };
window.birthsim = rig;

const magnifier = new Magnifier(byId("magnifier"), byId("magnification"));
const means = new Means();
const gauges = new Gauges(byId("gauges"));
const names = Object.keys(UNITS);
const recent = new History(names, 512, 0.025);
const whole = new History(names, 2048, 0.025);
const physics = new Physics(byId("physics"), byId("open-physics"));
const plots = new Plots([[PLOTS, byId("plots")], [DEEPER, byId("deeper")]], recent);
rig.plots = plots;
const readouts = new Readouts(byId("readouts"), byId("status"), byId("spoken"));
const notices = new Notices(byId("notices"));
const change = (changes) => send({ type: "set", settings: changes });
const settings = new Settings(byId("settings"), change);
const guide = new Guide(change);
const views = new Views(change, (paused) => send({ type: "pause", paused }));
const learning = new Learning({ send, change, tell: (words) => notices.show(words) });
rig.learning = learning;
const challenge = new Challenge();
const sound = new Sound(byId("sound"));
const link = new Link();
const about = new About();
const transport = new Transport(
  send,
  (name) => source.address(name),
  (words) => notices.show(words),
);
const enabled = () => rig.connected && rig.hello.mode === "live";
const hand = new Hand({
  send,
  sent: (id, time) => {
    rigs.cued();
    rig.monitor.sent(id, time);
  },
});
const rigs = new Rigs(hand, { frame: () => rig.frame, enabled });
rig.scenes = rigs.scenes;
new Keys(hand, enabled);
const gamepad = new Gamepad(hand, enabled);

const source = new Source({
  failed: ({ message }) => {
    rig.connected = false;
    hand.release();
    banner("offline", `The rig cannot be shown: ${message}`);
    readouts.say("offline", "no rig");
  },
  hello: (message) => {
    rig.hello = message;
    rig.connected = true;
    rig.frame = null;
    recent.clear();
    means.clear();
    plots.show(recent);
    views.setUp(message);
    rigs.setUp(message);
    plots.setUp(message);
    physics.setUp(message);
    explain(message.words.figures);
    about.setUp(message.words);
    byId("back").hidden = !source.player || Boolean(message.replay);
    gauges.setUp(message);
    transport.setUp(message);
    banner("offline", "");
    if (message.mode === "live") setUpSettings(message);
    showSettings(message.settings);
    showState(message.state);
  },
  settings: (message) => showSettings(message.settings),
  state: (message) => showState(message),
  path: ({ points }) => {
    rigs.setPath(points);
    magnifier.setPath(points);
  },
  /** Of a recording: all of it. */
  history: ({ frames }) => {
    whole.clear();
    rigs.clear();
    for (const frame of frames) {
      rigs.note(frame);
      whole.push(frame.time, rowOf(frame, rigs.rms));
    }
    plots.show(whole, rig.hello.state.duration);
  },
  frame: (frame) => {
    rig.frame = frame;
    rig.monitor.received += 1;
    rigs.push(frame);
    means.push(frame);
    challenge.push(frame);
    sound.push(rigs.rigOf(frame));
    if (rig.hello.mode === "live") recent.push(frame.time, rowOf(frame, rigs.rms));
    for (const part of [magnifier, physics]) part.push(frame);
    hand.stay();
  },
  error: ({ message }) => notices.show(message),
});

function setUpSettings(message) {
  settings.setUp(message);
  guide.setUp(message);
  if (!link.defaults) {
    const wished = settingsIn(location.search, message.defaults);
    const { allowed, refusals } = sifted(wished, message);
    refusals.forEach((words) => notices.show(words));
    if (Object.keys(allowed).length) change(allowed);
  }
  link.setUp(message.defaults);
}

function showSettings(values) {
  if (!values) return;
  const others = ["controller", "compare"].some((name) => values[name] !== rig.settings?.[name]);
  rig.settings = values;
  if (others && rig.hello.mode === "live") forget();
  rigs.show(values);
  learning.show(rig.hello.mode === "live" ? values : {});
  if (rig.hello.mode !== "live") {
    transport.showSettings(values);
    return;
  }
  settings.show(values);
  guide.show(values);
  views.show(values);
  link.show(values);
}

/** What another controller did is no longer shown. */
function forget() {
  recent.clear();
  means.clear();
  rigs.clear();
  challenge.clear();
}

function showState(values) {
  if (!values) return;
  rig.state = values;
  learning.pause(values.paused);
  transport.show(values);
}

function banner(id, words) {
  const element = byId(id);
  if (element.textContent !== words) element.textContent = words;
  element.hidden = !words;
}

function pixel(point, k = 0) {
  const { pen, sheet } = rigs.scenes[k];
  const [x, y] = pen.pixel(point);
  const box = sheet.canvas.getBoundingClientRect();
  return [box.left + x, box.top + y];
}

/** What pictures and films are of. */
function title() {
  const { mode, words, state } = { ...rig.hello, state: rig.state };
  return [`BirthSIM ${words.version}`, mode === "live" ? "" : state.file, inWords(rig.settings, rigs.titles)].filter(Boolean).join(" · ");
}

let drawn = null;

/** The newest frame is drawn as it came; nothing is made up between frames. */
function draw(now) {
  requestAnimationFrame(draw);
  const { frame, state } = rig;
  if (!frame || !state || !rigs.scenes[0].pen) return;
  if (frame !== drawn || !rig.connected) {
    drawn = frame;
    magnifier.draw(frame, rigs.scenes[0].pen.scale, means.shown);
    rigs.draw(frame, magnifier, means.shown);
    rig.monitor.drew(frame);
    for (const [id, one] of [["lost", frame], ["second-lost", frame.second]]) banner(id, one?.lost ? `${one.lost.replace(/[.]?$/, ".")} Press R to reset.` : "");
  }
  gamepad.step();
  transport.step(frame);
  transport.keepUp(frame, now);
  const [one, k] = [rigs.rigOf(frame), rigs.chosen];
  gauges.step(one.pressures, now);
  physics.step(one, k, now);
  plots.step(frame.time, k, now);
  const running = rigs.rms.map(({ value }, i) => (rig.hello.mode === "live" ? value : whole.at(RMS[i], frame.time)));
  rigs.step(means.shown, running);
  const written = means.shown[frame.second ? k : 0];
  if (rig.connected && written) readouts.step(written, running[k], frame, state, now);
}

new Files({ plots, open: (file) => source.open(file), tell: (words) => notices.show(words), title });
byId("back").addEventListener("click", () => source.close());
window.addEventListener("keydown", (event) => {
  const wish = rig.connected && keyOfTheRig(event);
  if (!wish) return;
  event.preventDefault();
  if (wish === "pause") transport.togglePause();
  else transport.reset();
});

requestAnimationFrame(draw);
