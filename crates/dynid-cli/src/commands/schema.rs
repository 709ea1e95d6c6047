//! `dynid schema`.

use dynid::schema::all;
use dynid_terminal::message::{Failure, data};

use crate::args::SchemaArgs;

pub(crate) fn run(args: &SchemaArgs) -> Result<u8, Failure> {
    let known = all();
    let Some(name) = &args.name else {
        let width = known.iter().map(|s| s.name.len()).max().unwrap_or(0);
        let line = |s: &dynid::schema::ResultSchema| format!("{:width$}  {}\n", s.name, s.of);
        data(&known.iter().map(line).collect::<String>())?;
        return Ok(0);
    };
    let Some(found) = known.iter().find(|s| s.name == name) else {
        let names: Vec<&str> = known.iter().map(|s| s.name).collect();
        return Err(Failure::Usage(
            format!("expected one of {}, found `{name}`", names.join(", ")),
            "`dynid schema` lists what each is of",
        ));
    };
    data(&found.text)?;
    Ok(0)
}
