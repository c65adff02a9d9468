//! `columns`: what the columns of the result files mean.

use super::print_json;
use bonepd_ct::command::Outcome;
use bonepd_ct::error::Result;
use bonepd_ct::record::columns::{Column, FILES};
use clap::Args;
use std::io::Write;

/// Print what every column of the result files means, with its unit
///
/// Names end in their unit: _mm, _mm3, _mpa, _n, _s, _mib. Missing values are NA.
#[derive(Args)]
pub struct ColumnsArgs {
    /// Print the columns of this file only, as results.csv or answers.csv
    file: Option<String>,
}

pub fn run(args: &ColumnsArgs, json: bool) -> Result<Outcome> {
    let named = |file: &str| args.file.as_deref().is_none_or(|wanted| wanted == file);
    let files: Vec<_> = FILES.iter().filter(|f| named(f.name)).collect();
    if files.is_empty() {
        let names: Vec<&str> = FILES.iter().map(|f| f.name).collect();
        return Err(bonepd_ct::error::Error::setting(
            "columns",
            format!(
                "no file `{}` is described",
                args.file.as_deref().unwrap_or_default()
            ),
            format!("name one of {}", names.join(", ")),
        ));
    }
    if json {
        print_json(&files);
        return Ok(Outcome::Done);
    }
    let mut out = std::io::stdout();
    for file in files {
        let _ = writeln!(out, "{}: {}\n", file.name, file.about);
        for Column { name, unit, about } in file.columns {
            let _ = writeln!(out, "  {name:<26} {unit:<8} {about}");
        }
        let _ = writeln!(out);
    }
    Ok(Outcome::Done)
}
