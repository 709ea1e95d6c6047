//! Joint states as the tools of ROS print them.

use dynid_files::excerpt::excerpt_bytes;

use super::fault::Fault;
use crate::log::header::LogHeader;

/// Nanoseconds of a second.
const SECOND: u32 = 1_000_000_000;
/// Arrays of a joint state, in the order of the message.
const ARRAYS: [&str; 3] = ["position", "velocity", "effort"];

/// One line of `ros2 topic echo --csv`: `sec,nanosec,frame_id,name..,position..,velocity..,effort..`. An empty array is one
/// empty field.
struct EchoRow<'a> {
    seconds: i64,
    nanoseconds: u32,
    names: Vec<&'a [u8]>,
    /// Position, velocity, effort; empty where the message has none.
    arrays: [Vec<f64>; 3],
}

impl<'a> EchoRow<'a> {
    fn of(line: &'a [u8]) -> Option<Self> {
        let fields: Vec<&[u8]> = line.split(|b| *b == b',').map(<[u8]>::trim_ascii).collect();
        let text = |k: usize| fields.get(k).and_then(|f| std::str::from_utf8(f).ok());
        let seconds = text(0)?.parse().ok()?;
        let nanoseconds = text(1)?.parse().ok().filter(|n| *n < SECOND)?;
        let number = |k: usize| text(k).and_then(|t| t.parse::<f64>().ok());
        if number(2).is_some() {
            return None;
        }
        let ends = |k: &usize| number(*k).is_some() || fields[*k].is_empty();
        let end = (3..fields.len()).find(ends)?;
        let names: Vec<&[u8]> = fields[3..end].to_vec();
        if names.is_empty() {
            return None;
        }
        let mut at = end;
        let mut arrays = [Vec::new(), Vec::new(), Vec::new()];
        for array in &mut arrays {
            if fields.get(at)?.is_empty() {
                at += 1;
                continue;
            }
            *array = (at..at + names.len()).map(number).collect::<Option<_>>()?;
            at += names.len();
        }
        (at == fields.len() && !arrays[0].is_empty()).then_some(EchoRow {
            seconds,
            nanoseconds,
            names,
            arrays,
        })
    }
}

/// What a recorder of messages prints between them when it loses some.
fn is_remark(line: &[u8]) -> bool {
    let line = line.trim_ascii();
    line.starts_with(b"A message was lost") || line.starts_with(b"total count") || line == b"---"
}

/// Lines of `ros2 topic echo --csv`, whose messages may come from several publishers.
#[derive(Clone, Debug)]
pub(super) struct Echo {
    /// Names of the joints of each kind of message.
    kinds: Vec<Vec<String>>,
    /// All joints.
    joints: Vec<String>,
    /// Which arrays there are.
    arrays: Vec<usize>,
    /// Seconds of the first message.
    origin: i64,
    /// Lines about lost messages.
    pub(super) remarks: usize,
}

impl Echo {
    /// The layout of a text that begins with these lines; `None`: it is no such text.
    pub(super) fn of_lines<'a>(lines: impl Iterator<Item = &'a [u8]>) -> Option<Self> {
        let mut lines = lines.filter(|line| !is_remark(line)).peekable();
        let first = EchoRow::of(lines.peek()?)?;
        let mut echo = Echo {
            kinds: Vec::new(),
            joints: Vec::new(),
            arrays: Vec::new(),
            origin: first.seconds,
            remarks: 0,
        };
        for row in lines.filter_map(EchoRow::of) {
            let names: Vec<String> =
                row.names.iter().map(|n| String::from_utf8_lossy(n).into_owned()).collect();
            let own = (0..3).filter(|k| !row.arrays[*k].is_empty());
            let new: Vec<usize> = own.filter(|k| !echo.arrays.contains(k)).collect();
            echo.arrays.extend(new);
            if !echo.kinds.contains(&names) {
                let unknown: Vec<String> =
                    names.iter().filter(|n| !echo.joints.contains(n)).cloned().collect();
                echo.joints.extend(unknown);
                echo.kinds.push(names);
            }
        }
        echo.arrays.sort_unstable();
        Some(echo)
    }

    /// Joints in the order of the messages.
    pub(super) fn joints(&self) -> &[String] {
        &self.joints
    }

    /// How many kinds of messages there are.
    pub(super) fn publishers(&self) -> usize {
        self.kinds.len()
    }

    /// `sec`, `nanosec`, then `position.<joint>` and so on.
    pub(super) fn names(&self) -> Vec<String> {
        let mut names = vec!["sec".to_owned(), "nanosec".to_owned()];
        for array in &self.arrays {
            names.extend(self.joints.iter().map(|joint| format!("{}.{joint}", ARRAYS[*array])));
        }
        names
    }

    /// What is taken off the column of seconds.
    pub(super) fn origin(&self) -> i64 {
        self.origin
    }

    /// Takes the numbers of a line, NaN where it has none; false: a remark between messages.
    pub(super) fn parse(&mut self, line: &[u8], values: &mut [f64]) -> Result<bool, Fault> {
        let Some(row) = EchoRow::of(line) else {
            if is_remark(line) {
                self.remarks += usize::from(line.trim_ascii().starts_with(b"A message"));
                return Ok(false);
            }
            return Err(Fault::NoMessage(excerpt_bytes(line)));
        };
        let same = |kind: &&Vec<String>| {
            kind.len() == row.names.len() && kind.iter().zip(&row.names).all(|(a, b)| a.as_bytes() == *b)
        };
        let Some(kind) = self.kinds.iter().find(same) else {
            return Err(Fault::OtherJoints(excerpt_bytes(&row.names.join(&b", "[..]))));
        };
        values.fill(f64::NAN);
        values[0] = row.seconds.checked_sub(self.origin).map_or(f64::INFINITY, |s| s as f64);
        values[1] = f64::from(row.nanoseconds);
        for (block, array) in self.arrays.iter().enumerate() {
            for (joint, x) in kind.iter().zip(&row.arrays[*array]) {
                let place = self.joints.iter().position(|j| j == joint).unwrap_or_default();
                values[2 + block * self.joints.len() + place] = *x;
            }
        }
        Ok(true)
    }
}

/// Names the columns of `rostopic echo -p` after the joints that the message names: `field.position0` becomes
/// `position.<joint>`. Gives the columns of the names, which must stay the same in every row.
pub(super) fn name_after_joints(header: &mut LogHeader, first_row: &[Vec<u8>]) -> Vec<usize> {
    let mut named = Vec::new();
    for number in 0.. {
        let Some(column) = header.names.iter().position(|n| *n == format!("field.name{number}")) else {
            break;
        };
        let Some(joint) = first_row.get(column).map(|f| String::from_utf8_lossy(f).into_owned()) else {
            break;
        };
        named.push(column);
        for array in ARRAYS {
            let place = header.names.iter().position(|n| *n == format!("field.{array}{number}"));
            if let Some(place) = place {
                let own = std::mem::replace(&mut header.names[place], format!("{array}.{joint}"));
                header.in_file[place] = own;
            }
        }
    }
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_a_message_are_told_apart_by_their_lengths() {
        let row = EchoRow::of(b"1700000000,250,base,j1,j2,0.1,0.2,,3.0,nan").unwrap();
        assert_eq!((row.seconds, row.nanoseconds), (1_700_000_000, 250));
        assert_eq!(row.names, [b"j1", b"j2"]);
        assert_eq!(row.arrays[0], [0.1, 0.2]);
        assert!(row.arrays[1].is_empty() && row.arrays[2][0] == 3.0 && row.arrays[2][1].is_nan());
        for other in [
            "t,q1,q2",
            "0.001,1,2,3",
            "1,2,3,4,5",
            "1700000000,250,base,j1,j2,0.1,0.2,0.3",
            "1700000000,2500000000,base,j1,0.1,,",
        ] {
            assert!(EchoRow::of(other.as_bytes()).is_none(), "{other}");
        }
    }

    #[test]
    fn publishers_are_told_apart_by_the_names_of_their_joints() {
        let lines: [&[u8]; 3] = [b"5,0,,a,b,1,2,,", b"5,1,,g,7,,", b"6,0,,b,a,2,1,,"];
        let mut echo = Echo::of_lines(lines.into_iter()).unwrap();
        assert_eq!(echo.names(), ["sec", "nanosec", "position.a", "position.b", "position.g"]);
        let mut values = vec![0.0; 5];
        assert!(echo.parse(lines[2], &mut values).is_ok_and(|row| row));
        assert_eq!(values[..4], [1.0, 0.0, 1.0, 2.0]);
        assert!(values[4].is_nan());
        assert!(echo.parse(b"A message was lost!!!", &mut values).is_ok_and(|row| !row));
        assert!(matches!(echo.parse(b"6,0,,a,c,2,1,,", &mut values), Err(Fault::OtherJoints(_))));
        assert!(matches!(echo.parse(b"6,0", &mut values), Err(Fault::NoMessage(_))));
    }
}
