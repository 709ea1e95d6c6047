"use strict";
// Sorting by heading and searching, for the tables of class "sortable".
(function () {
  function key(row, column) {
    const cell = row.cells[column];
    return cell.hasAttribute("data-key") ? cell.getAttribute("data-key") : cell.textContent;
  }
  function compare(numeric, column, direction) {
    return function (a, b) {
      const ka = key(a, column), kb = key(b, column);
      if (ka === "" || kb === "") return (ka === "") - (kb === "") || a.rank - b.rank; // undefined last either way
      const order = numeric ? ka - kb : ka.localeCompare(kb, "en", { numeric: true });
      return direction * order || a.rank - b.rank;
    };
  }
  for (const table of document.querySelectorAll("table.sortable")) {
    const body = table.tBodies[0], rows = Array.from(body.rows);
    rows.forEach(function (row, i) { row.rank = i; });
    for (const heading of table.tHead.rows[0].cells) {
      if (heading.hasAttribute("data-fixed")) continue;
      // Not a <button>: browsers leave those out of headings repeated on later printed pages.
      const handle = document.createElement("span");
      handle.tabIndex = 0;
      handle.setAttribute("role", "button");
      handle.append(...heading.childNodes);
      heading.append(handle);
      const sort = function () {
        const direction = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
        for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
        heading.setAttribute("aria-sort", direction === 1 ? "ascending" : "descending");
        const numeric = heading.classList.contains("n");
        body.append(...rows.slice().sort(compare(numeric, heading.cellIndex, direction)));
      };
      handle.addEventListener("click", sort);
      handle.addEventListener("keydown", function (event) {
        if (event.key !== "Enter" && event.key !== " ") return;
        event.preventDefault();
        sort();
      });
    }
  }
  for (const input of document.querySelectorAll("input[data-table]")) {
    const rows = Array.from(document.getElementById(input.dataset.table).tBodies[0].rows);
    const found = document.querySelector('[data-found="' + input.dataset.table + '"]');
    const text = rows.map(function (row) { return row.textContent.toLowerCase(); });
    input.addEventListener("input", function () {
      const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      let count = 0;
      rows.forEach(function (row, i) {
        row.hidden = !words.every(function (word) { return text[i].includes(word); });
        count += !row.hidden;
      });
      found.textContent = words.length ? count + " of " + rows.length : "";
    });
  }
})();
