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
table { border-collapse: collapse; margin: .4rem 0 0; } th { text-align: left; font-weight: normal; opacity: .7; padding-right: .6rem; overflow-wrap: anywhere; }
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
const verbs = { in: "went in at", out: "went out at", enter: "entered", leave: "left",
                continued: "is still in" };
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
    if (image.hidden) return;
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
  const zones = element("table", article);
  const who = element("p", article);
  who.className = "who";
  cards.set(name, { article, image, values, zones, who });
  return cards.get(name);
}
function log(text) {
  const list = document.querySelector("#log"), entry = document.createElement("li");
  entry.textContent = new Date().toLocaleTimeString() + " " + text;
  list.prepend(entry);
  while (list.childElementCount > 100) list.lastChild.remove();
}
function show(camera) {
  const { article, image, values, zones, who } = card(camera.camera);
  const ids = camera.people.map(person => person.id), old = before.get(camera.camera);
  image.hidden = !camera.pictures;
  values["people"].textContent = ids.length;
  values["so far"].textContent = camera.people_so_far;
  values["frame"].textContent = camera.frame;
  if (camera.lag !== undefined) {
    values["lag"].textContent = camera.lag.toFixed(2) + " s";
    values["dropped"].textContent = camera.dropped;
    values["lost"].textContent = camera.losses;
  }
  const counted = (camera.zones || []).map(zone => [zone.zone, zone.in !== undefined
    ? zone.in + " in, " + zone.out + " out"
    : zone.inside + " inside, " + zone.stays + " stays, " + zone.mean_dwell.toFixed(1) + " s each"]);
  zones.replaceChildren(...counted.map(([zone, text]) => {
    const row = document.createElement("tr");
    element("th", row, zone);
    element("td", row, text);
    return row;
  }));
  who.textContent = ids.length ? "In view: " + ids.join(", ") : "Nobody in view";
  article.classList.toggle("ended", !camera.running);
  if (old) {
    for (const id of ids) if (!old.ids.includes(id)) log(camera.camera + ": " + id + " came");
    for (const id of old.ids) if (!ids.includes(id)) log(camera.camera + ": " + id + " went");
    if (camera.losses > old.losses) log(camera.camera + ": was lost");
    const fresh = (camera.event_count || 0) - (old.events || 0);
    if (fresh > 0) {
      for (const event of camera.events.slice(-fresh)) {
        log(camera.camera + ": " + event.id + " " + verbs[event.event] + " " + event.zone +
            (event.dwell !== undefined ? " after " + event.dwell.toFixed(1) + " s" : ""));
      }
    }
  }
  before.set(camera.camera, { ids, losses: camera.losses, events: camera.event_count });
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
