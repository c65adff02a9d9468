//! The paper: its table is that of the validation report, its citations are in its bibliography.

use super::root;
use std::fs;

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Cells of the tables' rows, heads and rules left out.
fn rows(page: &str) -> Vec<Vec<&str>> {
    let lines = page.lines().filter(|line| line.starts_with("| "));
    lines
        .map(|line| {
            line.trim_matches('|')
                .split('|')
                .map(str::trim)
                .collect::<Vec<_>>()
        })
        .filter(|cells: &Vec<&str>| cells[0] != "what" && !cells[0].starts_with("---"))
        .collect()
}

#[test]
fn the_papers_table_is_that_of_the_report() {
    let (paper, report) = (read("paper.md"), read("reports/validation.md"));
    let known = rows(&report);
    let shown = rows(&paper);
    assert!(shown.len() >= 8, "{shown:?}");
    for row in shown {
        assert!(
            known.iter().any(|k| k.len() >= 3 && k[..3] == row[..]),
            "not in the report: {row:?}"
        );
    }
}

#[test]
fn the_papers_citations_are_known_and_used() {
    let (paper, bib) = (read("paper.md"), read("paper.bib"));
    let cited: Vec<&str> = paper
        .split("[@")
        .skip(1)
        .filter_map(|rest| rest.split([']', ';']).next())
        .collect();
    let known: Vec<&str> = bib
        .split("\n@")
        .filter_map(|entry| entry.split_once('{')?.1.split(',').next())
        .collect();
    assert!(cited.len() > 10 && known.len() > 10);
    for key in &cited {
        assert!(known.contains(key), "{key} is not in paper.bib");
    }
    for key in &known {
        assert!(cited.contains(key), "{key} is not cited");
    }
}

/// The version and the authors are those of the crate and of the paper.
#[test]
fn the_citation_is_of_this_version() {
    let citation = read("CITATION.cff");
    let version = format!("version: {}", env!("CARGO_PKG_VERSION"));
    assert!(citation.lines().any(|line| line == version), "{version}");
    let author = "The bonepd-ct maintainers";
    assert!(citation.contains(&format!("name: \"{author}\"")));
    assert!(read("paper.md").contains(&format!("name: {author}")));
}
