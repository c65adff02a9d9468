//! Owns the apparent stiffness of a scan as tables of its page.

use crate::record::stiffness::StiffnessRecord;
use crate::report::cells::{Cell, Table, number, text};
use crate::report::html::ShownStiffness;
use crate::result::statistics::fabric_elasticity::{FabricFitLine, Tensor, fit};

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

/// What the law of Zysset and Curnier has of these tensors; of the conditions that most of them share. None where it has no fit.
pub fn fabric_fit(records: &[StiffnessRecord]) -> Option<Vec<FabricFitLine>> {
    let of = |conditions: &str| -> Vec<Tensor> {
        let same = records
            .iter()
            .filter(|r| r.boundary_conditions == conditions);
        same.filter_map(|record| {
            let own = record.orthotropic.as_ref()?;
            Some(Tensor {
                bv_tv: record.bv_tv,
                mil_mm: record.mil_mm?,
                young_mpa: own.young_mpa,
                shear_mpa: own.shear_mpa,
                poisson: own.poisson,
            })
        })
        .collect()
    };
    let conditions = records.iter().map(|r| r.boundary_conditions.as_str());
    let all: Vec<(&str, Vec<Tensor>)> = conditions.map(|c| (c, of(c))).collect();
    let (conditions, tensors) = all.iter().max_by_key(|(_, tensors)| tensors.len())?;
    fit(tensors, conditions)
}

/// The fit in a sentence.
pub fn fit_in_words(lines: &[FabricFitLine]) -> String {
    let one = |l: &FabricFitLine| {
        let unit = if l.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", l.unit)
        };
        format!(
            "{} {:.4}{unit} (95 % {:.4} to {:.4})",
            l.parameter, l.value, l.low, l.high
        )
    };
    let words: Vec<String> = lines.iter().map(one).collect();
    let Some(first) = lines.first() else {
        return String::new();
    };
    format!(
        "Zysset-Curnier law of {} tensors under {}: {}; R² {:.3} of the logarithms, scatter {:.0} % (fabric_fit.csv)",
        first.scans,
        first.conditions,
        words.join(", "),
        first.r2,
        first.scatter_percent
    )
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
    if let Some(place) = &record.plausible {
        body.push(vec![text("among published tensors"), text(&place.in_words)]);
    }
    let share = format!("{:.1} %", 100.0 * o.residual);
    body.push(vec![
        text("part of the tensor that is not orthotropic"),
        text(&share),
    ]);
    Table::new(&["orthotropic constant", "value"], body)
}
