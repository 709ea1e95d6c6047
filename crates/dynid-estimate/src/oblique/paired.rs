//! Factors of paired rows `[Z | W | y]`.

use dynid_factor::groups::ReducedGroup;

/// Columns of paired rows for the base columns of a group: those of the instruments, then those of the measured rows.
pub fn paired_columns(columns: &[usize], total: usize) -> Vec<usize> {
    columns.iter().copied().chain(columns.iter().map(|c| total + c)).collect()
}

/// The measured part `[W | y]` of paired groups: what least squares works on.
///
/// Panics if a group has an odd number of columns.
pub fn measured(paired: &[ReducedGroup]) -> Vec<ReducedGroup> {
    paired
        .iter()
        .map(|group| {
            let own = base_columns(group);
            let of_w: Vec<usize> = (own.len()..2 * own.len()).collect();
            let blocks = group.blocks.iter().map(|b| b.select(&of_w)).collect();
            ReducedGroup { columns: own.to_vec(), blocks, ..*group }
        })
        .collect()
}

/// The simulated part `[Z | y]` of paired groups: regressors of the motion that the model makes, efforts as measured.
///
/// Panics if a group has an odd number of columns.
pub fn simulated(paired: &[ReducedGroup]) -> Vec<ReducedGroup> {
    paired
        .iter()
        .map(|group| {
            let own = base_columns(group);
            let of_z: Vec<usize> = (0..own.len()).collect();
            let blocks = group.blocks.iter().map(|b| b.select(&of_z)).collect();
            ReducedGroup { columns: own.to_vec(), blocks, ..*group }
        })
        .collect()
}

/// Base columns of a paired group.
fn base_columns(group: &ReducedGroup) -> &[usize] {
    assert!(group.columns.len().is_multiple_of(2), "paired rows have an instrument per column");
    &group.columns[..group.columns.len() / 2]
}

/// Paired groups with the time blocks of `first` before the middle of each log and those of `second` from there on.
///
/// With instruments of `first` made from parameters of the second halves and the other way round, no block's instruments know
/// anything of its own samples.
///
/// Panics unless both hold the same groups and blocks.
pub fn crossed(first: &[ReducedGroup], second: &[ReducedGroup]) -> Vec<ReducedGroup> {
    assert_eq!(first.len(), second.len(), "the same groups with other instruments");
    first
        .iter()
        .zip(second)
        .map(|(a, b)| {
            assert!(a.blocks.len() == b.blocks.len() && a.columns == b.columns, "the same rows");
            let middle = middle(a);
            let blocks = a.blocks[..middle].iter().chain(&b.blocks[middle..]).cloned().collect();
            ReducedGroup { columns: a.columns.clone(), blocks, ..*a }
        })
        .collect()
}

/// First block of the second half of a log.
fn middle(group: &ReducedGroup) -> usize {
    group.blocks.len() / 2
}

/// Groups with the blocks of one half of every log alone; the other blocks are left empty.
pub fn half(groups: &[ReducedGroup], second: bool) -> Vec<ReducedGroup> {
    groups
        .iter()
        .map(|group| {
            let middle = middle(group);
            let kept = |k: usize| (k >= middle) == second;
            let blocks = group.blocks.iter().enumerate().map(|(k, b)| match kept(k) {
                true => b.clone(),
                false => dynid_factor::Factor::empty(b.columns()),
            });
            ReducedGroup { columns: group.columns.clone(), blocks: blocks.collect(), ..*group }
        })
        .collect()
}
