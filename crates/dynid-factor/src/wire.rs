//! Groups of factors as bytes, and back.
//!
//! Numbers are little-endian; `u32` for counts and indices, `f64` for values. Groups stand one after the other:
//!
//! | field | |
//! |---|---|
//! | output, scale | what the rows are of |
//! | `p`, `p` columns | ascending columns of the whole problem that the factor's columns stand for |
//! | blocks | number of time blocks |
//! | per block: rows (`u64`), height, `ρ` | |
//! | | row `k` of `[R z]` from its diagonal on: `p + 1 - k` values |
//!
//! The same groups give the same bytes, and bytes that are read give the groups that were written, bit for bit.

use crate::factor::Factor;
use crate::groups::ReducedGroup;

/// Bytes that are no groups of factors.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WireError {
    /// The bytes end too early.
    #[error("{needed} more bytes expected for {what}, found {left}")]
    Ends {
        /// What was being read.
        what: &'static str,
        /// Bytes needed.
        needed: u64,
        /// Bytes left.
        left: u64,
    },
    /// A number that cannot be.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// What was being read.
        what: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
}

/// Appends groups to bytes.
///
/// # Panics
/// If a count does not fit 32 bits.
pub fn write_groups(groups: &[ReducedGroup], out: &mut Vec<u8>) {
    put(out, groups.len());
    for group in groups {
        put(out, group.output);
        put(out, group.scale);
        put(out, group.columns.len());
        group.columns.iter().for_each(|c| put(out, *c));
        put(out, group.blocks.len());
        for block in &group.blocks {
            out.extend((block.rows() as u64).to_le_bytes());
            put(out, block.height());
            out.extend(block.rho().to_le_bytes());
            for k in 0..block.height() {
                for j in k..=block.columns() {
                    out.extend(block.triangle()[(k, j)].to_le_bytes());
                }
            }
        }
    }
}

fn put(out: &mut Vec<u8>, count: usize) {
    let count = u32::try_from(count).unwrap_or_else(|_| panic!("{count} does not fit 32 bits"));
    out.extend(count.to_le_bytes());
}

/// Reads groups that [`write_groups`] wrote, of one log of index `log`; `total`: columns of the whole problem.
///
/// Nothing is reserved that the bytes do not hold.
///
/// # Errors
/// [`WireError`]: bytes are missing or left over, a value is not finite, columns do not ascend below `total`.
pub fn read_groups(bytes: &[u8], log: usize, total: usize) -> Result<Vec<ReducedGroup>, WireError> {
    let mut rest = Reader(bytes);
    let count = rest.count("number of groups")?;
    let mut out = Vec::new();
    for _ in 0..count {
        out.push(rest.group(log, total)?);
    }
    match rest.0 {
        [] => Ok(out),
        left => Err(wrong("end of the groups", "no more bytes", left.len())),
    }
}

fn wrong(what: &'static str, expected: &'static str, found: impl ToString) -> WireError {
    WireError::Value { what, expected, found: found.to_string() }
}

struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], WireError> {
        let ends = WireError::Ends { what, needed: N as u64, left: self.0.len() as u64 };
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or(ends)?;
        self.0 = rest;
        Ok(*head)
    }

    fn count(&mut self, what: &'static str) -> Result<usize, WireError> {
        self.take(what).map(|bytes| u32::from_le_bytes(bytes) as usize)
    }

    fn number(&mut self, what: &'static str) -> Result<f64, WireError> {
        let x = f64::from_le_bytes(self.take(what)?);
        if x.is_finite() { Ok(x) } else { Err(wrong(what, "a finite number", x)) }
    }

    fn group(&mut self, log: usize, total: usize) -> Result<ReducedGroup, WireError> {
        let output = self.count("output")?;
        let scale = self.count("kernel scale")?;
        let width = self.count("number of columns")?;
        let mut columns: Vec<usize> = Vec::new();
        for _ in 0..width {
            let column = self.count("column")?;
            if column >= total || columns.last().is_some_and(|last| column <= *last) {
                return Err(wrong("column", "columns of the problem, ascending", column));
            }
            columns.push(column);
        }
        let count = self.count("number of time blocks")?;
        let mut blocks = Vec::new();
        for _ in 0..count {
            blocks.push(self.block(width)?);
        }
        Ok(ReducedGroup { log, output, scale, columns, blocks })
    }

    fn block(&mut self, columns: usize) -> Result<Factor, WireError> {
        let rows = u64::from_le_bytes(self.take("rows of a block")?);
        let rows = usize::try_from(rows).map_err(|_| wrong("rows of a block", "a count", rows))?;
        let height = self.count("height of a triangle")?;
        if height > columns.min(rows) {
            return Err(wrong("height of a triangle", "at most its columns and its rows", height));
        }
        let rho = self.number("ρ")?;
        if rho < 0.0 {
            return Err(wrong("ρ", "a number that is not negative", rho));
        }
        let values = height * (columns + 1) - height * height.saturating_sub(1) / 2;
        let needed = 8 * values as u64;
        if (self.0.len() as u64) < needed {
            return Err(WireError::Ends { what: "a triangle", needed, left: self.0.len() as u64 });
        }
        let mut triangle = vec![0.0; height * (columns + 1)];
        for k in 0..height {
            for j in k..=columns {
                triangle[j * height + k] = self.number("entry of a triangle")?;
            }
        }
        Ok(Factor::of_parts(columns, triangle, height, rho, rows))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FactorBuilder;

    fn groups() -> Vec<ReducedGroup> {
        let block = |rows: usize, columns: usize| {
            let mut builder = FactorBuilder::new(columns);
            for i in 0..rows {
                let row: Vec<f64> = (0..columns).map(|c| ((i * 7 + c * c * 3) as f64).sin()).collect();
                builder.push_row(&row, (i as f64 * 0.3).cos()).expect("finite");
            }
            builder.finish()
        };
        let of = |output: usize, columns: Vec<usize>| ReducedGroup {
            log: 2,
            output,
            scale: output % 2,
            blocks: vec![block(9, columns.len()), block(0, columns.len()), block(2, columns.len())],
            columns,
        };
        vec![of(0, vec![0, 1, 4]), of(1, vec![3]), of(2, Vec::new())]
    }

    #[test]
    fn bytes_give_back_what_was_written() {
        let mut bytes = Vec::new();
        write_groups(&groups(), &mut bytes);
        assert_eq!(read_groups(&bytes, 2, 5).expect("reads"), groups());
    }

    #[test]
    fn what_is_cut_or_added_is_refused() {
        let mut bytes = Vec::new();
        write_groups(&groups(), &mut bytes);
        for length in 0..bytes.len() {
            assert!(matches!(read_groups(&bytes[..length], 0, 5), Err(WireError::Ends { .. })), "{length}");
        }
        bytes.push(0);
        assert!(matches!(read_groups(&bytes, 0, 5), Err(WireError::Value { .. })));
    }

    #[test]
    fn every_changed_byte_is_refused_or_read_as_factors() {
        let mut bytes = Vec::new();
        write_groups(&groups(), &mut bytes);
        for place in 0..bytes.len() {
            for flip in [1, 0x7f, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[place] ^= flip;
                if let Ok(read) = read_groups(&damaged, 0, 5) {
                    let finite = |f: &Factor| f.rho().is_finite() && f.z().iter().all(|z| z.is_finite());
                    assert!(read.iter().flat_map(|g| &g.blocks).all(finite));
                }
            }
        }
    }

    #[test]
    fn columns_beyond_the_problem_are_refused() {
        let mut bytes = Vec::new();
        write_groups(&groups(), &mut bytes);
        let expected = "columns of the problem, ascending";
        let found = "4".to_owned();
        assert_eq!(read_groups(&bytes, 0, 4), Err(WireError::Value { what: "column", expected, found }));
    }
}
