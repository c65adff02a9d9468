//! One test program. Each module is one subject.

#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "tests are no interface, and an unwrap that fails is a test that fails"
)]

mod accuracy;
mod answers;
mod apparent;
mod by_label;
mod cli;
mod cohort;
mod dicom_series;
mod earlier_version;
mod examples;
mod exports;
mod extension;
mod families;
mod fields;
mod formats;
mod fuzz;
mod geometry_fe;
mod hard;
mod header_keys;
mod header_property;
mod info;
mod inputs;
mod lattice_checks;
mod laws;
mod layers;
mod loads;
mod methods;
mod molecular;
mod order;
mod orientation;
mod own_grid;
mod pages;
mod patch;
mod phantom;
mod pipelines;
mod plasticity;
mod portable;
mod privacy;
mod reads;
mod remodelling;
mod report;
mod scan_headers;
mod scenes;
mod segment;
mod slips;
mod specimens;
mod stability;
mod stiffness;
mod stopping;
mod stored;
mod sub_volumes;
mod tissue;
mod voxel_fe;
mod windows_text;
mod written;
