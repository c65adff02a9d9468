//! Lays options that were given over the settings of a recipe, of a run, or the defaults.

use bonepd_ct::error::{Error, Result};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use toml::{Table, Value};

/// Each option of `given` becomes the value of the key with its name. Options that were left out, flags that are not set and empty
/// lists change nothing. Values pass through TOML's types, not its text: all numbers stay exactly as they are, infinite ones too.
///
/// # Errors
/// An integer that TOML cannot hold (2⁶³ or more).
pub fn lay_over<P: Serialize + DeserializeOwned>(
    params: &mut P,
    given: &impl Serialize,
) -> Result<()> {
    let unfit = |e: &dyn Display| Error::setting("settings", e.to_string(), "give smaller numbers");
    let mut settings = Table::try_from(&*params).map_err(|e| unfit(&e))?;
    let given = Table::try_from(given).map_err(|e| unfit(&e))?.into_iter();
    settings.extend(given.filter(|(_, value)| match value {
        Value::Boolean(flag) => *flag,
        Value::Array(list) => !list.is_empty(),
        _ => true,
    }));
    *params = settings.try_into().map_err(|e| unfit(&e))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::segment::SegmentSettings;
    use crate::cli::settings::LatticeSettings;
    use crate::cli::solve::SolveSettings;
    use bonepd_ct::format::calibration::GreyUnit;
    use bonepd_ct::grid::Axis;
    use bonepd_ct::physics::material::{Law, Material};
    use bonepd_ct::physics::plasticity::{Plasticity, VonMises, YieldLaw};
    use bonepd_ct::pipeline::apparent::fields::Field;
    use bonepd_ct::pipeline::apparent::{
        CoarsenBy, Conditions, Ends, Load, LoadSteps, Method, Sed, SolveParams,
    };
    use bonepd_ct::pipeline::lattice::{BoundaryWord, LatticeParams, Structure};
    use bonepd_ct::pipeline::segment::{Align, AlignBox, SegmentParams, Voi};
    use clap::{Args, Parser};

    #[derive(Parser)]
    struct Line<S: Args> {
        #[command(flatten)]
        settings: S,
    }

    fn given<S: Args>(words: &str) -> S {
        let words = words.split_whitespace();
        let line = Line::try_parse_from(std::iter::once("test").chain(words));
        line.unwrap_or_else(|e| panic!("{e}")).settings
    }

    /// Keys of the options, given or not, that the settings do not have.
    fn strangers<S: Args + Serialize, P: DeserializeOwned>() -> Vec<String> {
        let keys = serde_json::to_value(given::<S>("")).unwrap();
        let is_strange = |key: &&String| {
            let settings = serde_json::json!({ key.as_str(): null });
            let refused = serde_json::from_value::<P>(settings).err();
            refused.is_some_and(|e| e.to_string().contains("unknown field"))
        };
        let keys = keys.as_object().unwrap().keys();
        keys.filter(is_strange).cloned().collect()
    }

    #[test]
    fn every_option_is_a_key_of_the_settings() {
        let none: [&str; 0] = [];
        assert_eq!(strangers::<SegmentSettings, SegmentParams>(), none);
        assert_eq!(strangers::<LatticeSettings, LatticeParams>(), none);
        assert_eq!(strangers::<SolveSettings, SolveParams>(), none);
        // Options of another step are strangers.
        let lattice = strangers::<LatticeSettings, SolveParams>();
        assert_eq!(
            lattice,
            ["structure", "lp_mm", "boundary", "registration_mm"]
        );
    }

    fn segmented(start: &SegmentParams, words: &str) -> SegmentParams {
        let mut params = start.clone();
        let options: SegmentSettings = given(words);
        options.apply(&mut params).unwrap();
        params
    }

    #[test]
    fn options_of_segment_become_its_settings() {
        let made = segmented(
            &SegmentParams::default(),
            "--spacing 0.1,0.2,0.3 --raw 4,5,6,uint16be,7 --units mgha --lower -1.5 --upper 3.25 --gaussian 0.7 \
             --voi cylinder:5,1,2 --crop 0:10,5:6,2:200 --turn x --resample 0.3 --align 0,-1,2 --align-box whole \
             --plane-cut 0.5 --keep-all --no-grey --blur-voxels 0.4 --morphometry",
        );
        let wanted = SegmentParams {
            spacing_mm: Some([0.1, 0.2, 0.3]),
            raw: Some("4,5,6,uint16be,7".parse().unwrap()),
            units: Some(GreyUnit::Mgha),
            lower: Some(-1.5),
            upper: Some(3.25),
            otsu: false,
            labels: vec![],
            gaussian_voxels: 0.7,
            voi: Voi::Cylinder {
                diameter_mm: Some(5.0),
                center_mm: Some([1.0, 2.0]),
            },
            crop: Some([[0, 10], [5, 6], [2, 200]]),
            turn: Axis::X,
            resample_mm: Some([0.3; 3]),
            align: Some(Align::Direction([0.0, -1.0, 2.0])),
            align_box: AlignBox::Whole,
            plane_cut_mm: Some(0.5),
            keep_all: true,
            keep_grey: false,
            no_grey: true,
            blur_voxels: Some(0.4),
            morphometry: true,
        };
        assert_eq!(made, wanted);
        assert_eq!(segmented(&wanted, ""), wanted);
        assert!(segmented(&SegmentParams::default(), "--keep-grey").keep_grey);
    }

    #[test]
    fn what_finds_bone_replaces_what_found_it_before() {
        let found = |p: &SegmentParams| (p.otsu, p.lower, p.labels.clone(), p.gaussian_voxels);
        let window = segmented(&SegmentParams::default(), "--lower 2 --gaussian 1");
        assert_eq!(found(&window), (false, Some(2.0), vec![], 1.0));
        let otsu = segmented(&window, "--otsu");
        assert_eq!(found(&otsu), (true, None, vec![], 1.0));
        let labels = segmented(&otsu, "--labels 100,127");
        assert_eq!(found(&labels), (false, None, vec![100, 127], 0.0));
        assert_eq!(found(&segmented(&labels, "--labels 3")).2, [3]);
        assert_eq!(
            found(&segmented(&labels, "--lower 2 --gaussian 1")),
            found(&window)
        );
    }

    #[test]
    fn numbers_of_settings_stay_exactly_as_they_are() {
        let start = SegmentParams {
            lower: Some(f64::NEG_INFINITY),
            upper: Some(0.1 + 0.2),
            blur_voxels: Some(f64::MIN_POSITIVE),
            ..SegmentParams::default()
        };
        assert_eq!(segmented(&start, ""), start);
        assert_eq!(
            segmented(&start, "--upper 0.1234567890123456789").upper,
            Some(0.123_456_789_012_345_68)
        );
    }

    #[test]
    fn options_of_lattices_become_their_settings() {
        let mut made = LatticeParams::default();
        let options: LatticeSettings = given(
            "--structure bcc,fcc --lp 0.1,0.07 --boundary weighted,floppy --registration -0.01,0,0.02",
        );
        options.apply(&mut made).unwrap();
        let wanted = LatticeParams {
            structure: vec![Structure::Bcc, Structure::Fcc],
            lp_mm: vec![0.1, 0.07],
            boundary: vec![BoundaryWord::Weighted, BoundaryWord::Floppy],
            registration_mm: [-0.01, 0.0, 0.02],
        };
        assert_eq!(made, wanted);
        given::<LatticeSettings>("").apply(&mut made).unwrap();
        assert_eq!(made, wanted);
    }

    fn solved(start: &SolveParams, words: &str) -> SolveParams {
        let mut params = start.clone();
        let options: SolveSettings = given(words);
        options.apply(&mut params, false).unwrap();
        params
    }

    #[test]
    fn options_of_solve_become_its_settings() {
        let start = SolveParams::default();
        let coarse = "--method voxel-fe --young-mpa 6829 --material power:6850,1.49 --density 2,-3 --least-mpa 4 --poisson 0.31 \
             --strain -0.42% --grip-mm 0.6 --angle-deg 2 --ends bonded --conditions mixed --axis x --tolerance 0.01% \
             --coarsen 2 --coarsen-by fraction --mechanisms --fields sed,stress --sed mean --statistics --failure \
             --critical-volume 3% --failure-labels 100,127";
        let wanted = SolveParams {
            method: Method::VoxelFe,
            young_mpa: 6829.0,
            poisson: 0.31,
            material: Some(Material {
                law: Law::Power {
                    coefficient: 6850.0,
                    exponent: 1.49,
                },
                density: [2.0, -3.0],
                least_mpa: Some(4.0),
            }),
            strain: -0.42 * 0.01,
            grip_mm: 0.6,
            angle_deg: 2.0,
            ends: Ends::Bonded,
            conditions: Conditions::Mixed,
            axis: Axis::X,
            tolerance: 0.01 * 0.01,
            coarsen: 2,
            coarsen_by: CoarsenBy::Fraction,
            mechanisms: true,
            fields: vec![Field::Sed, Field::Stress],
            pistoia: Some(bonepd_ct::measure::pistoia::Pistoia {
                critical_volume: 0.03,
                critical_strain: 0.007,
            }),
            failure_labels: vec![100, 127],
            sed: Sed::Mean,
            statistics: true,
            ..start.clone()
        };
        let made = solved(&start, coarse);
        assert_eq!(made, wanted);
        assert_eq!(solved(&made, ""), made);

        let smooth = solved(
            &start,
            "--method geometry-fe --element-mm 0.02 --load torsion",
        );
        let wanted = SolveParams {
            method: Method::GeometryFe,
            element_mm: Some(0.02),
            load: Load::Torsion,
            ..start.clone()
        };
        assert_eq!(smooth, wanted);

        let plastic = "--method voxel-fe --plasticity von-mises:68,5 --steps 7 --refine-mask 3";
        let wanted = SolveParams {
            method: Method::VoxelFe,
            plasticity: Some(Plasticity::All(YieldLaw::VonMises(VonMises {
                yield_mpa: 68.0,
                hardening_mpa: 5.0,
            }))),
            steps: LoadSteps::Even(7),
            refine: 3,
            refine_mask: true,
            ..start.clone()
        };
        let plastic = solved(&start, plastic);
        assert_eq!(plastic, wanted);
        let refined = solved(&plastic, "--refine 2");
        assert_eq!((refined.refine, refined.refine_mask), (2, false));
    }
}
