// A browser loads no modules from a disk, so that a page that is opened as a file cannot run the rig: it shows a film, and how to start it.
"use strict";

function instead(frame) {
  const root = decodeURIComponent(new URL(document.documentElement.dataset.content_root ?? "./", location.href).pathname);
  const page = location.pathname.slice(new URL(document.documentElement.dataset.content_root ?? "./", location.href).pathname.length);
  const shown = document.createElement("figure");
  shown.className = "rig-film";
  if (frame.dataset.film) {
    const film = document.createElement("img");
    film.src = frame.dataset.film;
    film.alt = "A film of the rig: a hand pulls the head, first under the paper's controller, then under one with a force sensor";
    shown.append(film);
  }
  const words = document.createElement("figcaption");
  const command = document.createElement("code");
  command.textContent = `python -m http.server -d "${root}"`;
  const link = document.createElement("a");
  link.href = link.textContent = `http://127.0.0.1:8000/${page}`;
  words.append("Here a rig runs that you can pull with the mouse, but only from a server. Type ", command, " and open ", link, ".");
  shown.append(words);
  frame.replaceWith(shown);
}

addEventListener("DOMContentLoaded", () => {
  if (location.protocol === "file:") document.querySelectorAll("iframe.rig").forEach(instead);
});
