// Finds what index.js lists: names and sections that hold all words. Titles count more than texts.
"use strict";
(() => {
  const input = document.getElementById("search");
  const list = document.getElementById("found");
  const root = document.currentScript.getAttribute("src").replace(/search\.js$/, "");
  const MOST = 30;

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

  function shown(entry) {
    const item = document.createElement("li");
    const link = document.createElement("a");
    link.href = root + entry.address;
    link.textContent = entry.title;
    const where = document.createElement("small");
    where.textContent = entry.where;
    item.append(link, " ", where);
    return item;
  }

  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    const found = words.length === 0 ? [] : INDEX
      .map((entry) => [score(entry, words), entry])
      .filter(([points]) => points > 0)
      .sort(([a], [b]) => b - a)
      .slice(0, MOST);
    list.replaceChildren(...found.map(([, entry]) => shown(entry)));
  });
})();
