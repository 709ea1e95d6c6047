#!/usr/bin/env python3
"""Finds circles of modules inside crates.

Modules with the same parent may use one another in one direction only; a parent and its children may point both ways.
What counts as use: every path that begins with `crate`, `super`, `self` or a child module, in `use` or in the code, followed
through re-exports to the module that defines the name. A use deep inside a module is a use by that module. Tests do not count.

    python3 .ci/circles.py [CRATE..]      one line per circle, exit code 1 if there is any
"""
import re
import sys
from collections import defaultdict
from pathlib import Path

# Circles that are known and wait: (crate, parent module) to the modules and the reason. A listed circle must exist, and exactly so.
ALLOWED = {}

USE = re.compile(r"\buse\s+([^;]+);")
INLINE = re.compile(r"\b(?:crate|super|self)(?:::\w+)+")
TESTS = re.compile(r"#\[cfg\(test\)\]\s*(?:#\[[^\]]*\]\s*)*mod\s+(\w+)\s*([;{])")


def module_of(file, src):
    """`src/a/b.rs` and `src/a/b/mod.rs` are ("a", "b"); the root of the crate is ()."""
    parts = file.relative_to(src).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts


def paths_of(tree):
    """`a::{b, c::{d, e as f}}` is (a, b), (a, c, d), (a, c, e), each with the name that it binds: b, d, f."""
    items, depth = [""], 0
    for char in tree:
        depth += {"{": 1, "}": -1}.get(char, 0)
        items = [*items, ""] if char == "," and depth == 0 else [*items[:-1], items[-1] + char]
    for item in filter(None, map(str.strip, items)):
        group = re.fullmatch(r"((?:\w+::)*)\{(.*)\}", item, re.S)
        if group:
            head = tuple(filter(None, group[1].split("::")))
            for path, name in paths_of(group[2]):
                yield (head, head[-1] if name == "self" else name) if path == ("self",) else (head + path, name)
        else:
            path, _, name = re.sub(r"\s+", " ", item).partition(" as ")
            yield tuple(path.split("::")), name or path.split("::")[-1]


def production(text):
    """The text without comments and tests (which clippy keeps last), and the names of test modules that are files of their own."""
    text, tests = re.sub(r"//[^\n]*", "", text), set()
    for found in TESTS.finditer(text):
        if found[2] == "{":
            return text[: found.start()], tests
        tests.add(found[1])
    return text, tests


class Crate:
    def __init__(self, name):
        src = Path("crates", name, "src")
        self.files = {module_of(file, src): file for file in sorted(src.rglob("*.rs"))}
        texts = {module: production(file.read_text()) for module, file in self.files.items()}
        tests = {module + (name,) for module, (_, names) in texts.items() for name in names}
        self.files = {module: file for module, file in self.files.items() if not any(module[: len(t)] == t for t in tests)}
        found, self.names = [], defaultdict(dict)  # names: module → name that a `use` binds there → path from the root
        for module in self.files:
            text = texts[module][0]
            bound = [pair for tree in USE.findall(text) for pair in paths_of(tree)]
            for path, name in bound + [(tuple(path.split("::")), None) for path in INLINE.findall(USE.sub("", text))]:
                absolute = self.absolute(module, path)
                if absolute is not None:
                    found.append((module, absolute, "::".join(path)))
                    if name:
                        self.names[module].setdefault(name, absolute)
        self.edges = [(module, self.definer(path), text) for module, path, text in found]

    def absolute(self, module, path):
        if path[0] not in ("crate", "self", "super"):
            return module + path if module + path[:1] in self.files else None
        while path and path[0] in ("crate", "self", "super"):
            module, path = {"crate": (), "self": module, "super": module[:-1]}[path[0]], path[1:]
        return module + path

    def definer(self, path, seen=()):
        """The module in which the last part of `path` is written, through the names that `use` binds on the way."""
        depth = max(n for n in range(len(path) + 1) if path[:n] in self.files)
        module, name = path[:depth], path[depth : depth + 1]
        # A function may have the name of its module: what the parent re-exports is then the function.
        onward = self.names[module].get(name[0]) if name else self.names[path[:-1]].get(path[-1]) if path else None
        return module if onward is None or onward == path or onward in seen else self.definer(onward, (*seen, path))

    def circles(self):
        """(parent, modules, steps of a shortest circle as (user, used, file, path)), one for each knot of siblings."""
        for parent in sorted({module[:n] for module in self.files for n in range(len(module))}):
            level, graph = len(parent), defaultdict(dict)
            for user, used, text in self.edges:
                if len(user) > level < len(used) and user[:level] == used[:level] == parent and user[level] != used[level]:
                    graph[user[level]].setdefault(used[level], (user[level], used[level], self.files[user], text))
            reach = {start: walks(graph, start) for start in sorted(graph)}
            knots = {frozenset(end for end in reach[start] if start in reach.get(end, ())) for start in reach if start in reach[start]}
            yield from ((parent, knot, min((reach[start][start] for start in sorted(knot)), key=len)) for knot in sorted(knots, key=sorted))


def walks(graph, start):
    """The modules that `start` reaches, each by the steps of a shortest walk; `start` itself only if it lies on a circle."""
    queue, walk_to = [(start, [])], {}
    for module, walk in queue:
        for used, step in sorted(graph.get(module, {}).items()):
            if used not in walk_to:
                walk_to[used] = [*walk, step]
                queue.append((used, walk_to[used]))
    return walk_to


def main(crates):
    faults, waiting = [], {place: known for place, known in ALLOWED.items() if place[0] in crates}
    for name in crates:
        for parent, knot, steps in Crate(name).circles():
            if waiting.get((name, "::".join(parent)), (None,))[0] == knot:
                del waiting[name, "::".join(parent)]
                continue
            uses = "; ".join(f"{user} uses {used} (`{text}` in {file})" for user, used, file, text in steps)
            rest = f"; {len(knot)} modules use one another: {', '.join(sorted(knot))}" if len(knot) > len(steps) else ""
            faults.append(f"circle in {'::'.join([name, *parent])}: {uses}{rest}. Move what both need below them, or what needs both above")
    for (name, parent), (knot, _) in waiting.items():
        faults.append(f"ALLOWED in .ci/circles.py names a circle that is gone or has changed: {name} {parent} {', '.join(sorted(knot))}")
    sys.stderr.writelines(f"arrows: {fault}\n" for fault in faults)
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:] or sorted(crate.name for crate in Path("crates").iterdir())))
