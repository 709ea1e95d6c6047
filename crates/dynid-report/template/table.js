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
  // Rows of several bodies: a heading, rows with a verdict, and explanations that follow the row they belong to.
  function apply(table) {
    const state = table.state;
    let count = 0;
    for (const group of state.groups) {
      let any = false;
      for (const row of group.rows) {
        const visible = state.words.every(function (word) { return row.text.includes(word); }) &&
          (!state.verdict || row.element.dataset.verdict === state.verdict);
        row.element.hidden = !visible;
        if (row.more) row.more.hidden = !visible || !state.explained;
        any = any || visible;
        count += visible;
      }
      if (group.heading) group.heading.hidden = !any;
    }
    const found = document.querySelector('[data-found="' + table.id + '"]');
    if (found) found.textContent = state.words.length || state.verdict ? count + " of " + state.all : "";
  }
  for (const table of document.querySelectorAll("table.sortable, table.trust")) {
    const groups = Array.from(table.tBodies, function (body) {
      const group = { heading: null, rows: [] };
      for (const element of body.rows) {
        if (element.classList.contains("owner")) group.heading = element;
        else if (element.classList.contains("more")) group.rows[group.rows.length - 1].more = element;
        else group.rows.push({ element: element, more: null });
      }
      for (const row of group.rows) {
        const parts = [group.heading, row.element, row.more].filter(Boolean);
        row.text = parts.map(function (part) { return part.textContent; }).join(" ").toLowerCase();
      }
      return group;
    });
    const all = groups.reduce(function (sum, group) { return sum + group.rows.length; }, 0);
    table.state = { groups: groups, all: all, words: [], verdict: "", explained: true };
  }
  for (const input of document.querySelectorAll("input[data-table]")) {
    const table = document.getElementById(input.dataset.table);
    input.addEventListener("input", function () {
      table.state.words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      apply(table);
    });
  }
  for (const filter of document.querySelectorAll(".filter[data-table]")) {
    const table = document.getElementById(filter.dataset.table);
    filter.addEventListener("click", function (event) {
      const button = event.target.closest("button");
      if (!button) return;
      if ("explanations" in button.dataset) {
        table.state.explained = !table.state.explained;
        button.setAttribute("aria-pressed", String(table.state.explained));
      } else {
        table.state.verdict = button.dataset.show;
        for (const other of filter.querySelectorAll("[data-show]")) other.setAttribute("aria-pressed", String(other === button));
      }
      apply(table);
    });
  }
  // Paper cannot unfold.
  const unfolded = [];
  window.addEventListener("beforeprint", function () {
    for (const fold of document.querySelectorAll("details.fold:not([open])")) { fold.open = true; unfolded.push(fold); }
  });
  window.addEventListener("afterprint", function () { for (const fold of unfolded.splice(0)) fold.open = false; });
})();
