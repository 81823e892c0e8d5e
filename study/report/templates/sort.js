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
