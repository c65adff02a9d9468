//! The fully integrated element against CalculiX (`apt-get install calculix-ccx`), C3D8 with `*PLASTIC`: the same mesh, the same
//! steps. The program's own element averages the dilatation; what that changes is said beside.

use super::bodies::{Body, frame, von_mises};
use std::fmt::Write;
use std::process::Command;

/// Corners of a C3D8 brick in its own order.
const ORDER: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// Force of the moved end along z at the end of the load, N.
fn calculix(body: &Body, strain: f64, yield_mpa: f64, hardening_mpa: f64) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("deck.inp"),
        deck(body, strain, yield_mpa, hardening_mpa),
    )
    .unwrap();
    let run = Command::new("ccx")
        .arg("deck")
        .current_dir(folder.path())
        .output();
    let run = run.expect("ccx is installed");
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stdout)
    );
    let text = std::fs::read_to_string(folder.path().join("deck.dat")).unwrap();
    let totals = text.split("total force").last().unwrap();
    let line = totals
        .lines()
        .find(|l| l.split_whitespace().count() == 3 && !l.contains('('))
        .unwrap();
    line.split_whitespace().last().unwrap().parse().unwrap()
}

fn deck(body: &Body, strain: f64, yield_mpa: f64, hardening_mpa: f64) -> String {
    let (mesh, top) = (&body.mesh, body.mesh.grid.n[2]);
    let exists = |node: &usize| mesh.around[*node] != 0;
    let nodes: Vec<usize> = (0..mesh.len()).filter(exists).collect();
    let numbers: std::collections::HashMap<[u32; 3], usize> = nodes
        .iter()
        .map(|&node| (mesh.indices(node), node))
        .collect();
    let mut out = String::from("*NODE,NSET=ALL\n");
    for node in &nodes {
        let [x, y, z] = mesh.position(*node);
        writeln!(out, "{},{x:.12},{y:.12},{z:.12}", node + 1).unwrap();
    }
    out += "*ELEMENT,TYPE=C3D8,ELSET=BONE\n";
    for node in nodes.iter().filter(|node| mesh.has_element(**node)) {
        let at = mesh.indices(*node);
        let corner = |c: usize| numbers[&std::array::from_fn(|a| at[a] + (c as u32 >> a & 1))] + 1;
        let corners: Vec<String> = ORDER.iter().map(|c| corner(*c).to_string()).collect();
        writeln!(out, "{},{}", node + 1, corners.join(",")).unwrap();
    }
    out += "*NSET,NSET=TOP\n";
    let ends = |node: &&usize| mesh.indices(**node)[2] as usize == top;
    nodes
        .iter()
        .filter(ends)
        .for_each(|node| writeln!(out, "{},", node + 1).unwrap());
    let (young, poisson) = (body.young, body.poisson);
    writeln!(
        out,
        "*MATERIAL,NAME=BONE\n*ELASTIC\n{young},{poisson}\n*PLASTIC\n{yield_mpa},0."
    )
    .unwrap();
    writeln!(out, "{},1.", yield_mpa + hardening_mpa).unwrap();
    out += "*SOLID SECTION,ELSET=BONE,MATERIAL=BONE\n*STEP,INC=1000\n*STATIC\n0.1,1.,1e-4,0.1\n";
    out += "*CONTROLS,PARAMETERS=FIELD\n1e-7,1e-5\n*BOUNDARY\n";
    for node in &nodes {
        for c in (0..3).filter(|c| body.held.is_held(*node, *c)) {
            let z = mesh.position(*node)[2];
            let value = if c == 2 { strain * z } else { 0.0 };
            writeln!(out, "{},{},{},{value:.12}", node + 1, c + 1, c + 1).unwrap();
        }
    }
    out + "*NODE PRINT,NSET=TOP,TOTALS=ONLY\nRF\n*END STEP\n"
}

#[test]
#[ignore = "needs ccx (calculix-ccx)"]
fn the_fully_integrated_element_agrees_with_calculix() {
    for (n, strain, hardening) in [(8, -0.02, 500.0), (14, -0.015, 500.0), (14, 0.02, 2000.0)] {
        let body = Body::block(frame(n), strain, true);
        let law = von_mises(68.0, hardening);
        let force = |is_mean: bool| {
            let (_, history) = body.load_with(law, &Body::stepping(10), is_mean);
            let moved = strain * body.mesh.grid.size_mm()[2];
            history.steps.last().unwrap().conjugate_nmm / moved
        };
        let theirs = calculix(&body, strain, 68.0, hardening);
        let (full, mean) = (force(false), force(true));
        println!(
            "{n}³ {strain}: CalculiX {theirs:.6} N, full {full:.6}, mean dilatation {mean:.6}"
        );
        assert!((full / theirs - 1.0).abs() < 1e-3, "{n}: {full} {theirs}");
    }
}
