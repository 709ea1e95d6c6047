//! Elements in the long help, from the registry.

use dynid::model::element::ElementRegistry;

/// Long help of an argument that takes names of elements: what it is for, then every element with its effort.
pub(crate) fn with_elements(purpose: &str) -> String {
    let registry = ElementRegistry::default();
    let width = registry.names().map(str::len).max().unwrap_or(0);
    let rows = registry.kinds().map(|kind| format!("\n  {:width$}  {}", kind.name, kind.equation));
    format!("{purpose}\n\nElements and the efforts that they add:{}", rows.collect::<String>())
}
