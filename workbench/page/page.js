/* The browser's part of every view. Ages use the browser's steady clock. Times use the browser's zone. */
const OLD_MS = 2500, ASK_MS = 1000, LOOK_MS = 250;
const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone || "UTC";
const DAY = { year: "numeric", month: "2-digit", day: "2-digit" };
const CLOCK = { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" };
const pieces = {};
let newAt = performance.now(); /* Everything on the screen is at least as new as this time. */
let title = "", wrong = 0;

function put(id, html) {
  const place = document.getElementById(id);
  if (place) place.innerHTML = html;
}
function show(changed) {
  for (const [id, html] of Object.entries(changed)) put(id, html);
}
/* Each edit replaces the pieces from `from` to `to`. The last edit comes first. */
function patch(id, edits) {
  const known = (pieces[id] ||= []);
  for (const [from, to, added] of edits) known.splice(from, to - from, ...added);
  put(id, known.join(""));
}
/* The page has now sent everything that the page had heard when the browser asked. */
function fresh(asked, count) {
  newAt = Math.max(newAt, asked);
  wrong = count;
  look();
}
function ask() {
  if (window.did_handshake && window.socket.connected) emitEvent("ask", performance.now(), ZONE);
}
function look() {
  const silent = performance.now() - newAt, old = silent > OLD_MS;
  const told = document.getElementById("lost"), seconds = Math.floor(silent / 1000);
  document.body.classList.toggle("stale", old);
  told.textContent = old ? `✖ OLD: for ${seconds} s nothing has come from the page's server. Look at the server and at the network.` : "";
  title ||= document.title;
  document.title = (old ? "OLD " : "") + (wrong ? `(${wrong}) ` : "") + title;
}
function filter() {
  const wanted = (document.getElementById("find")?.value || "").toLowerCase();
  for (const one of document.querySelectorAll("[data-find]")) {
    const told = `${one.dataset.find} ${one.querySelector("time")?.title ?? ""}`; /* people also search for the shown day */
    one.hidden = !told.includes(wanted);
  }
}
/* A timeline opens at `data-open`, a fraction of its width. Without `data-open`, it opens at its newest end. */
function open_at(scrolls) {
  const share = parseFloat(scrolls.dataset.open || "1");
  scrolls.scrollLeft = share * scrolls.scrollWidth - (share < 1 ? scrolls.clientWidth / 2 : 0);
  scrolls.dataset.opened = "";
}
function tell_time(place) {
  const at = new Date(1000 * parseFloat(place.dataset.at)), today = new Date().toDateString();
  const parts = at.toDateString() === today ? CLOCK : { ...DAY, ...CLOCK };
  place.textContent = at.toLocaleString("sv-SE", parts);
  place.title = at.toLocaleString("sv-SE", { ...DAY, ...CLOCK });
  place.dateTime = at.toISOString();
}
function fill() {
  document.querySelectorAll("time[data-at]:empty").forEach(tell_time);
  document.querySelectorAll(".zone:empty").forEach(place => { place.textContent = `Times: ${ZONE}`; });
  document.querySelectorAll(".timeline:not([data-opened]):has(svg)").forEach(open_at);
  for (const one of document.querySelectorAll("details.wiring:not([data-unfolded])")) {
    one.open = innerWidth >= 768; /* on a phone, open details would be long */
    one.dataset.unfolded = "";
  }
  filter();
}
document.addEventListener("DOMContentLoaded", () => {
  new MutationObserver(fill).observe(document.body, { childList: true, subtree: true });
  document.addEventListener("input", filter);
  window.addEventListener("resize", () => document.querySelectorAll("[data-opened]").forEach(open_at));
  document.addEventListener("visibilitychange", () => document.getElementById("lost") && look());
  setInterval(() => document.getElementById("lost") && look(), LOOK_MS);
  setInterval(() => document.getElementById("lost") && ask(), ASK_MS);
  fill();
});
