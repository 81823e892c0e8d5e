"use strict";
// Click or press a column's name: rows in the order of its numbers, or of its words; again: the other way round.
for (const head of document.querySelectorAll("#cases th")) {
  const button = document.createElement("button");
  button.append(...head.childNodes);
  head.append(button);
  button.addEventListener("click", () => {
    const falls = head.getAttribute("aria-sort") === "ascending";
    const body = document.querySelector("#cases tbody");
    const text = (row) => row.cells[head.cellIndex].textContent;
    const compare = (a, b) => {
      const [x, y] = [parseFloat(text(a)), parseFloat(text(b))];
      if (isNaN(x) && isNaN(y)) return text(a).localeCompare(text(b));
      if (isNaN(x) || isNaN(y)) return isNaN(x) ? 1 : -1; // what has no number stays below
      return falls ? y - x : x - y;
    };
    for (const other of document.querySelectorAll("#cases th")) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", falls ? "descending" : "ascending");
    body.append(...[...body.rows].sort(compare));
  });
}
// Words typed above the table: rows that have them all, in any column.
const filter = document.createElement("input");
Object.assign(filter, { type: "search", placeholder: "Filter rows", ariaLabel: "Filter the rows of the table by words" });
document.querySelector("#cases .wide").before(filter);
filter.addEventListener("input", () => {
  const words = filter.value.toLowerCase().split(" ");
  for (const row of document.querySelectorAll("#cases tbody tr"))
    row.hidden = !words.every((word) => row.textContent.toLowerCase().includes(word));
});
