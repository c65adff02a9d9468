//! Owns the apparent stiffness of a scan as tables of its page.

use crate::record::stiffness::StiffnessRecord;
use crate::report::cells::{Cell, Table, number, text};
use crate::report::html::ShownStiffness;

/// Matrix and orthotropic constants of `stiffness.json`.
pub fn shown(record: &StiffnessRecord) -> ShownStiffness {
    let mut head = vec!["MPa"];
    head.extend(record.voigt_order.iter().map(String::as_str));
    let rows = record.stiffness_mpa.iter().zip(&record.voigt_order);
    let body = rows.map(|(row, name)| {
        let cells = row.iter().map(|c| number(Some(*c)));
        [text(name)].into_iter().chain(cells).collect()
    });
    ShownStiffness {
        conditions: record.boundary_conditions.clone(),
        matrix: Table::new(&head, body.collect()),
        constants: constants(record),
    }
}

/// Empty where the matrix is not positive definite.
fn constants(record: &StiffnessRecord) -> Table {
    let Some(o) = &record.orthotropic else {
        return Table::default();
    };
    let triple = |names: [&str; 3], values: [f64; 3]| -> Vec<Vec<Cell>> {
        let lines = names.into_iter().zip(values);
        lines
            .map(|(name, value)| vec![text(name), number(Some(value))])
            .collect()
    };
    let mut body = triple(["E1 (MPa)", "E2 (MPa)", "E3 (MPa)"], o.young_mpa);
    body.extend(triple(["G23 (MPa)", "G13 (MPa)", "G12 (MPa)"], o.shear_mpa));
    body.extend(triple(["ν23", "ν13", "ν12"], o.poisson));
    for (name, [x, y, z]) in ["axis 1 (x, y, z)", "axis 2", "axis 3"]
        .into_iter()
        .zip(o.axes)
    {
        body.push(vec![text(name), text(&format!("{x:.3}, {y:.3}, {z:.3}"))]);
    }
    let share = format!("{:.1} %", 100.0 * o.residual);
    body.push(vec![
        text("part of the tensor that is not orthotropic"),
        text(&share),
    ]);
    Table::new(&["orthotropic constant", "value"], body)
}
