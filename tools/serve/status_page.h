// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace sdmt::tools {

/// The page that StatusServer shows: everything is in it, nothing is loaded from elsewhere.
inline constexpr const char* kStatusPage = R"html(<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>sdmt track</title>
<style>
:root { color-scheme: light dark; --line: #8884; }
body { font: 16px/1.4 system-ui, sans-serif; margin: 0 auto; padding: .75rem; max-width: 110rem; }
h1 { font-size: 1.2rem; margin: 0 0 .75rem; }
main { display: grid; gap: .75rem; grid-template-columns: repeat(auto-fill, minmax(min(26rem, 100%), 1fr)); }
article { border: 1px solid var(--line); border-radius: .5rem; padding: .6rem; min-width: 0; }
h2 { font-size: 1rem; margin: 0 0 .4rem; overflow-wrap: anywhere; }
img { width: 100%; aspect-ratio: 16 / 9; object-fit: contain; background: #0003; border-radius: .3rem; }
dl { display: grid; grid-template-columns: auto 1fr auto 1fr; gap: .1rem .6rem; margin: .4rem 0 0; }
dt { opacity: .7; } dd { margin: 0; font-variant-numeric: tabular-nums; text-align: right; }
.who { margin: .4rem 0 0; min-height: 1.4em; overflow-wrap: anywhere; }
.ended h2::after { content: " (ended)"; color: #c33; }
#lost { color: #c33; }
ul { padding-left: 1.2rem; max-height: 12rem; overflow: auto; }
</style>
</head>
<body>
<h1>sdmt track <span id="lost" role="status"></span></h1>
<main></main>
<h2>Events</h2>
<ul id="log"></ul>
<script>
const token = new URLSearchParams(location.search).get("token");
const address = path => path + (token ? "?token=" + encodeURIComponent(token) : "");
const cards = new Map(), before = new Map();
function element(name, parent, text) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  parent.append(made);
  return made;
}
function card(name) {
  if (cards.has(name)) return cards.get(name);
  const article = element("article", document.querySelector("main"));
  element("h2", article, name);
  const image = element("img", article);
  image.alt = "Live picture of " + name;
  // One picture after the other: a browser opens few connections to one server.
  const next = () => {
    const path = address("picture/" + encodeURIComponent(name));
    image.src = path + (path.includes("?") ? "&" : "?") + "n=" + Date.now();
  };
  image.onload = () => setTimeout(next, 100);
  image.onerror = () => setTimeout(next, 1000);
  next();
  const numbers = element("dl", article), values = {};
  for (const label of ["people", "so far", "frame", "lag", "dropped", "lost"]) {
    element("dt", numbers, label);
    values[label] = element("dd", numbers, "–");
  }
  const who = element("p", article);
  who.className = "who";
  cards.set(name, { article, values, who });
  return cards.get(name);
}
function log(text) {
  const list = document.querySelector("#log"), entry = document.createElement("li");
  entry.textContent = new Date().toLocaleTimeString() + " " + text;
  list.prepend(entry);
  while (list.childElementCount > 100) list.lastChild.remove();
}
function show(camera) {
  const { article, values, who } = card(camera.camera);
  const ids = camera.people.map(person => person.id), old = before.get(camera.camera);
  values["people"].textContent = ids.length;
  values["so far"].textContent = camera.people_so_far;
  values["frame"].textContent = camera.frame;
  if (camera.lag !== undefined) {
    values["lag"].textContent = camera.lag.toFixed(2) + " s";
    values["dropped"].textContent = camera.dropped;
    values["lost"].textContent = camera.losses;
  }
  who.textContent = ids.length ? "In view: " + ids.join(", ") : "Nobody in view";
  article.classList.toggle("ended", !camera.running);
  if (old) {
    for (const id of ids) if (!old.ids.includes(id)) log(camera.camera + ": " + id + " came");
    for (const id of old.ids) if (!ids.includes(id)) log(camera.camera + ": " + id + " went");
    if (camera.losses > old.losses) log(camera.camera + ": was lost");
  }
  before.set(camera.camera, { ids, losses: camera.losses });
}
const source = new EventSource(address("events"));
source.onmessage = message => {
  document.querySelector("#lost").textContent = "";
  JSON.parse(message.data).cameras.forEach(show);
};
source.onerror = () => { document.querySelector("#lost").textContent = "no connection"; };
</script>
</body>
</html>
)html";

}  // namespace sdmt::tools
