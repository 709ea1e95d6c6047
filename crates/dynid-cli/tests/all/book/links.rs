//! Links between documents, and the summary of the book.

use std::path::Path;

use super::blocks::Page;
use super::markdown_below;

/// Links of all documents that lead to no file or to no heading of it.
pub(super) fn broken(root: &Path) -> Vec<String> {
    let mut documents =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|f| root.join(f)).to_vec();
    for folder in ["docs", "bench", "crates"] {
        documents.extend(markdown_below(&root.join(folder)));
    }
    let mut faults = Vec::new();
    for document in documents {
        for (line, link) in Page::read(&document).links {
            if let Some(fault) = fault(&document, &link) {
                faults.push(format!("{}:{line}: {link}: {fault}", document.display()));
            }
        }
    }
    faults
}

fn fault(document: &Path, link: &str) -> Option<&'static str> {
    if link.is_empty() || link.contains("://") || link.starts_with("mailto:") {
        return None;
    }
    let (file, anchor) = link.split_once('#').map_or((link, None), |(file, anchor)| (file, Some(anchor)));
    let target = if file.is_empty() { document.to_owned() } else { document.parent().unwrap().join(file) };
    if !target.exists() {
        return Some("no such file");
    }
    let anchor = anchor?;
    (!Page::read(&target).anchors.iter().any(|a| a == anchor)).then_some("no such heading")
}

/// Pages that the summary does not list, or lists twice. Entries without a file are pages to come.
pub(super) fn summary_faults(source: &Path) -> Vec<String> {
    let summary = source.join("SUMMARY.md");
    let links = Page::read(&summary).links;
    let mut faults = Vec::new();
    for file in markdown_below(source) {
        let name = file.strip_prefix(source).unwrap().display().to_string();
        let times = links.iter().filter(|(_, link)| *link == name).count();
        if name != "SUMMARY.md" && times != 1 {
            faults.push(format!("SUMMARY.md lists {name} {times} times, expected once"));
        }
    }
    faults
}
