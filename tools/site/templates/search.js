// Finds what index.js lists: names and sections that hold all words, with what stands around them.
// Titles count more than texts.
"use strict";
(() => {
  const input = document.getElementById("search");
  const list = document.getElementById("found");
  const root = document.currentScript.getAttribute("src").replace(/search\.js$/, "");
  const MOST = 30;
  const BEFORE = 40;
  const AFTER = 100;

  function score(entry, words) {
    const title = entry.title.toLowerCase();
    const text = entry.text.toLowerCase();
    let sum = 0;
    for (const word of words) {
      if (title === word || title.endsWith("." + word)) sum += 8;
      else if (title.includes(word)) sum += 4;
      else if (text.includes(word)) sum += 1;
      else return 0;
    }
    return sum;
  }

  function shown(entry, words) {
    const item = document.createElement("li");
    const link = document.createElement("a");
    link.href = root + entry.address;
    link.textContent = entry.title;
    const where = document.createElement("small");
    where.textContent = entry.where;
    item.append(link, " ", where, excerpt(entry.text, words));
    return item;
  }

  // What stands around the first of the words, from a word's start to a word's end, with all marked.
  function excerpt(text, words) {
    const paragraph = document.createElement("p");
    const places = words.map((word) => text.toLowerCase().indexOf(word)).filter((at) => at >= 0);
    const first = places.length === 0 ? 0 : Math.min(...places);
    const start = first <= BEFORE ? 0 : text.indexOf(" ", first - BEFORE) + 1;
    const end = first + AFTER >= text.length ? text.length : text.lastIndexOf(" ", first + AFTER);
    const shown = text.slice(start, Math.max(end, first + 1));
    const pattern = words.map((word) => word.replace(/[^\w\s]/g, "\\$&")).join("|");
    // Every second part is one of the words.
    shown.split(new RegExp(`(${pattern})`, "i")).forEach((part, k) => {
      const mark = document.createElement("mark");
      mark.textContent = part;
      paragraph.append(k % 2 ? mark : part);
    });
    if (start > 0) paragraph.prepend("… ");
    if (end < text.length) paragraph.append(" …");
    return paragraph;
  }

  function nothing(words) {
    const item = document.createElement("li");
    item.textContent = `Nothing has ${words.length === 1 ? "this word" : "all of these words"}.`;
    return item;
  }

  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = words.length === 0 ? [] : INDEX
      .map((entry) => [score(entry, words), entry])
      .filter(([points]) => points > 0)
      .sort(([a], [b]) => b - a)
      .slice(0, MOST);
    const items = found.map(([, entry]) => shown(entry, words));
    list.replaceChildren(...(words.length > 0 && items.length === 0 ? [nothing(words)] : items));
  });

  // On a narrow screen the menu covers the page, also the section of it that was chosen.
  document.querySelector("nav").addEventListener("click", (event) => {
    if (event.target.closest("a")) document.getElementById("togglestate").checked = false;
  });
})();
