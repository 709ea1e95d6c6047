//! What the templates of a page about logs see.

use minijinja::context;
use minijinja::value::{Serde, Value};

use super::study::sections;
use crate::data::LogPage;

pub(super) fn context(data: &LogPage) -> Value {
    context! {
        kind => data.kind.as_str(),
        title => data.title.as_str(),
        robot => data.robot.as_str(),
        verdict => Serde(&data.verdict),
        introduction => Serde(&data.introduction),
        findings => Serde(&data.findings),
        sections => Serde(sections(&data.sections)),
        provenance => Serde(&data.provenance),
    }
}
