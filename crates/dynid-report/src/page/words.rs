//! What pages say of the words of results, and how they show them.

use dynid_record::{ConsistencyForm, ConsistencyStatus, Origin, ParameterVerdict, ShapeVerdict};
use minijinja::value::Value;
use minijinja::{Environment, Error, ErrorKind, context};

use crate::number::UNDEFINED;

/// Adds filters and tests that know the words.
pub(super) fn add(environment: &mut Environment<'_>) {
    let verdicts = context! {
        seen => ParameterVerdict::SeenInData.word(),
        carried => ParameterVerdict::CarriedByPrior.word(),
        not_identifiable => ParameterVerdict::NotIdentifiable.word(),
        given => ParameterVerdict::Given.word(),
    };
    environment.add_global("verdicts", verdicts);
    environment.add_filter("look", |value: &Value| say(value, ParameterVerdict::of_word, look, ""));
    environment.add_filter("briefly", |value: &Value| say(value, ParameterVerdict::of_word, briefly, ""));
    environment.add_filter("shape_look", |value: &Value| say(value, ShapeVerdict::of_word, shape_look, ""));
    environment.add_filter("decided", |value: &Value| say(value, Origin::of_word, decided, ""));
    environment.add_filter("bodies", |value: &Value| say(value, ConsistencyForm::of_word, bodies, UNDEFINED));
    environment.add_filter("search_end", |value: &Value| {
        say(value, ConsistencyStatus::of_word, search_end, UNDEFINED)
    });
    let shape = |of: ShapeVerdict| move |value: &Value| value.as_str() == Some(of.word());
    environment.add_test("seen_shape", shape(ShapeVerdict::SeenInData));
    environment.add_test("one_sided_shape", shape(ShapeVerdict::OneSided));
    let search = |of: ConsistencyStatus| move |value: &Value| value.as_str() == Some(of.word());
    environment.add_test("unconstrained", search(ConsistencyStatus::Unconstrained));
    environment.add_test("stalled", search(ConsistencyStatus::Stalled));
}

/// What is said of a word; `none` where there is no value.
fn say<T>(
    value: &Value,
    of_word: fn(&str) -> Option<T>,
    text: fn(T) -> &'static str,
    none: &'static str,
) -> Result<&'static str, Error> {
    if value.is_none() {
        return Ok(none);
    }
    let known = value.as_str().and_then(of_word);
    known
        .map(text)
        .ok_or_else(|| Error::new(ErrorKind::InvalidOperation, format!("`{value}` is no word of results")))
}

/// The class by which the page's style and script know a verdict.
pub(super) fn look(verdict: ParameterVerdict) -> &'static str {
    match verdict {
        ParameterVerdict::SeenInData => "seen_in_data",
        ParameterVerdict::CarriedByPrior => "carried_by_prior",
        ParameterVerdict::NotIdentifiable => "not_identifiable",
        ParameterVerdict::Given => "given",
    }
}

fn briefly(verdict: ParameterVerdict) -> &'static str {
    match verdict {
        ParameterVerdict::SeenInData => "seen",
        ParameterVerdict::CarriedByPrior => "carried",
        ParameterVerdict::NotIdentifiable => ParameterVerdict::NotIdentifiable.word(),
        ParameterVerdict::Given => ParameterVerdict::Given.word(),
    }
}

fn shape_look(verdict: ShapeVerdict) -> &'static str {
    match verdict {
        ShapeVerdict::SeenInData => look(ParameterVerdict::SeenInData),
        ShapeVerdict::OneSided => look(ParameterVerdict::CarriedByPrior),
        ShapeVerdict::NotSeen => look(ParameterVerdict::NotIdentifiable),
        ShapeVerdict::Given => look(ParameterVerdict::Given),
    }
}

fn decided(origin: Origin) -> &'static str {
    match origin {
        Origin::Found => "from the data",
        Origin::Given => "given",
        Origin::Default => "default",
    }
}

fn bodies(form: ConsistencyForm) -> &'static str {
    match form {
        ConsistencyForm::PseudoInertia => "pseudo-inertia positive definite (4 × 4)",
        ConsistencyForm::SpatialInertia => "spatial inertia positive definite (6 × 6)",
    }
}

fn search_end(status: ConsistencyStatus) -> &'static str {
    match status {
        ConsistencyStatus::Unconstrained => "no constraint matters",
        ConsistencyStatus::Optimal => "optimal within the gap",
        ConsistencyStatus::Stalled => "consistent, gap above the tolerance",
    }
}
