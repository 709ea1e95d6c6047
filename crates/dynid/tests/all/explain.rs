//! Explanations of words that results use.

use dynid::check::Severity;
use dynid::explain::{all, find, nearest};
use dynid::friction_model::FrictionStatus;
use dynid::record::{CarriedReason, Outcome, ParameterVerdict, ShapeVerdict, Status};

#[test]
fn ids_are_unique_and_texts_are_whole() {
    let all = all();
    for (k, e) in all.iter().enumerate() {
        let plain = |id: &str| id.to_lowercase().replace(['_', '-'], " ");
        assert!(!all[..k].iter().any(|other| plain(other.id) == plain(e.id)), "{} twice", e.id);
        for text in [e.meaning, e.remedy] {
            assert!(text.ends_with('.') && text.len() > 20, "{}: {text}", e.id);
        }
    }
}

#[test]
fn words_of_result_files_are_explained() {
    let words = Status::ALL.iter().map(|w| w.word()).chain(Outcome::ALL.iter().map(|w| w.word()));
    let words = words.chain(ParameterVerdict::ALL.iter().map(|w| w.word()));
    let words = words.chain(CarriedReason::ALL.iter().map(|w| w.word()));
    let words = words.chain(ShapeVerdict::ALL.iter().map(|w| w.word()));
    let words = words.chain(FrictionStatus::ALL.iter().map(|w| w.word()));
    for word in words.chain(Severity::ALL.iter().map(|w| w.word())) {
        assert!(find(word).is_some(), "{word}");
    }
}

#[test]
fn words_are_found_as_people_type_them() {
    for typed in ["column_order", "Column order", "`column-order`", "[warn]"] {
        assert!(find(typed).is_some(), "{typed}");
    }
    assert_eq!(find("colum_order"), None);
    assert_eq!(nearest("colum_order"), "column_order");
    assert_eq!(nearest("whiteness"), "whiteness of the residuals");
}
