//! What the made-up identification says about its parameters.

use dynid_report::{
    CarriedReason, Consistency, ConsistencyForm, ConsistencyStatus, Counts, HeldOut, HeldOutJoint, Limit,
    LogWhiteness, OwnerKind, ParameterVerdict, Precision, Pruning, PruningStep, StandardParameter,
    ValidationPrice, Whiteness,
};

/// Of 13 standard parameters per joint nine of the first link are not identifiable, and three of every other link are carried;
/// of nine base parameters per joint the offset is carried.
pub(super) fn counts(joints: usize) -> Counts {
    let n = joints as u64;
    Counts {
        base: 9 * n,
        base_excited: 9 * n,
        base_seen: 8 * n,
        standard: 13 * n,
        standard_seen: 13 * n - 9 - 3 * (n - 1),
        standard_carried: 3 * (n - 1),
        standard_not_identifiable: 9,
        standard_given: 0,
        shape: 2,
        shape_seen: 1,
    }
}

pub(super) fn standard_parameters(joints: usize) -> Vec<StandardParameter> {
    let rows = [
        ("m", "kg", 4.1),
        ("mx", "kg m", 0.61),
        ("my", "kg m", -0.02),
        ("mz", "kg m", 0.11),
        ("Ixx", "kg m^2", 0.021),
        ("Ixy", "kg m^2", 0.0004),
        ("Ixz", "kg m^2", -0.002),
        ("Iyy", "kg m^2", 0.094),
        ("Iyz", "kg m^2", 0.0001),
        ("Izz", "kg m^2", 0.097),
        ("Ia", "kg m^2", 0.31),
        ("fc", "N m", 6.41),
        ("fv", "N m s", 9.2),
    ];
    let parameter = |n: usize, k: usize, (name, unit, value): (&str, &str, f64)| {
        let value = value / n as f64;
        let (verdict, reason, share) = match (n, k) {
            (1, 0..=8) => (ParameterVerdict::NotIdentifiable, None, 0.0),
            (_, 0 | 3) => (ParameterVerdict::CarriedByPrior, Some(CarriedReason::OnlyInCombination), 0.37),
            (_, 7) => (ParameterVerdict::CarriedByPrior, Some(CarriedReason::NotExcited), 0.12),
            _ => (ParameterVerdict::SeenInData, None, 0.96),
        };
        let seen = verdict == ParameterVerdict::SeenInData;
        let half = 0.04 * value.abs();
        // The friction of the second joint stands for a value that a limit moved away from what the data prefer.
        let held = (n, name) == (2, "fv");
        let unconstrained = if held { value - 2.0 * half } else { value };
        StandardParameter {
            owner: if k < 10 { format!("link_{n}") } else { format!("joint_{n}") },
            owner_kind: if k < 10 { OwnerKind::Link } else { OwnerKind::Joint },
            name: name.into(),
            unit: unit.into(),
            value: Some(value),
            unconstrained: Some(unconstrained),
            interval: seen.then_some([unconstrained - half, unconstrained + half]),
            prior: (k < 10).then_some(1.1 * value),
            verdict: Some(verdict),
            reason,
            share: Some(share),
            possible_share: Some(if reason == Some(CarriedReason::OnlyInCombination) { 0.41 } else { 1.0 }),
            wide: (n, name) == (3, "Ixy"),
            at_boundary: held,
            combination: if reason == Some(CarriedReason::OnlyInCombination) {
                format!(
                    "the data see mx{n} + 0.45·m{} = 3.87 ± 0.02 kg m; the split follows the prior",
                    n + 1
                )
            } else {
                String::new()
            },
            tie: String::new(),
            advice: if reason == Some(CarriedReason::NotExcited) {
                format!("fast motion of joint joint_{n} would raise Iyy{n} from 12 % to 94 %")
            } else {
                String::new()
            },
        }
    };
    // Links before joints, as a parameter table has them.
    let all = |owners: std::ops::Range<usize>| {
        (1..=joints).flat_map(move |n| owners.clone().map(move |k| parameter(n, k, rows[k])))
    };
    all(0..10).chain(all(10..13)).collect()
}

pub(super) fn motions() -> Vec<String> {
    vec![
        "fast motion of joints joint_4 and joint_5 together would raise Iyy5 from 12 % to 94 % and mx5 from 40 % to 97 %"
            .into(),
        "motion between poses of joint joint_6 would raise mz6 from 37 % to 91 %".into(),
    ]
}

pub(super) fn consistency() -> Consistency {
    let limit =
        |owner: &str, owner_kind, text: &str| Limit { owner: owner.into(), owner_kind, text: text.into() };
    Consistency {
        form: Some(ConsistencyForm::PseudoInertia),
        status: Some(ConsistencyStatus::Optimal),
        price: Some(41.8),
        price_over_chance: Some(0.42),
        prior_weight: Some(1.05),
        gap: Some(2.5e-5),
        least_eigenvalue: Some(1.0e-6),
        limits: vec![
            limit("link_5", OwnerKind::Link, "no thickness along its x axis"),
            limit("link_5", OwnerKind::Link, "no thickness along (0.19, 0.94, 0.30)"),
            limit("joint_2", OwnerKind::Joint, "fv at its lower limit"),
        ],
        validation: vec![
            ValidationPrice {
                log: "fourier-b".into(),
                free_percent: Some(5.02),
                consistent_percent: Some(5.10),
            },
            ValidationPrice {
                log: "pick-and-place".into(),
                free_percent: Some(5.31),
                consistent_percent: Some(5.19),
            },
        ],
    }
}

pub(super) fn held_out(joints: usize) -> HeldOut {
    let joint = |j: usize| {
        let free = [1.9, 2.4, 1.2, 0.5, 0.4, 0.2][j % 6];
        HeldOutJoint {
            free: Some(free),
            standard_error: Some(0.08 * free),
            consistent: Some(free * (1.02 - 0.01 * j as f64)),
        }
    };
    HeldOut {
        folds: 5,
        joints: (0..joints).map(joint).collect(),
        free_percent: Some(4.81),
        consistent_percent: Some(4.85),
    }
}

pub(super) fn precision(joints: usize) -> Precision {
    let whiteness = |j: usize| {
        let distance = [0.11, 0.14, 0.21, 0.47, 0.15, 0.09][j % 6];
        Some(Whiteness {
            distance,
            threshold: 0.17,
            rejected: distance > 0.17,
            dominant_hz: 0.13 + 0.4 * j as f64,
        })
    };
    Precision {
        basis: dynid_record::Basis::TimeBlocks,
        variance_inflation: Some(6.2),
        variance_inflation_per_joint: (0..joints).map(|j| (j % 2 == 1).then_some(5.0 + j as f64)).collect(),
        blocks: Some(26),
        block_s: Some(1.5),
        wanted_block_s: Some(1.2),
        robust: true,
        whiteness: vec![LogWhiteness {
            log: "fourier-a".into(),
            joints: (0..joints).map(whiteness).collect(),
        }],
    }
}

pub(super) fn pruning(joints: usize) -> Pruning {
    let whole = 9 * joints as u64;
    let essential = whole * 2 / 3;
    let step = |parameters: u64| {
        let spare = parameters as f64 - essential as f64;
        let missing = (-spare).max(0.0) / joints as f64;
        let held_out = 1.3 + 0.02 * spare.max(0.0) + 0.8 * missing * missing;
        PruningStep {
            parameters,
            next: format!("link_{}.Ixy", parameters % joints as u64 + 1),
            statistic: Some(0.3 * (1.0 + missing * missing)),
            bic: Some(280.0 + 5.1 * spare.max(0.0) + 120.0 * missing * missing),
            held_out: Some(held_out),
            held_out_standard_error: Some(0.08 * held_out),
        }
    };
    Pruning {
        path: (1..=whole).rev().map(step).collect(),
        essential: Some(essential),
        essential_parameters: (1..=joints)
            .flat_map(|n| ["Izz", "mx", "fc", "fv"].map(|p| format!("{p}{n}")))
            .collect(),
        least_bic: Some(essential + 1),
        all_significant: Some(essential + 2),
        threshold: Some(3.9),
    }
}
