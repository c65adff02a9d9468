//! Inputs that look sound and are easily misread, each with the tests that hold its reading.
//!
//! | input | tests |
//! |---|---|
//! | dicom-deflated-and-trailing | dicom_series::deflated_files_and_zeros_after_the_pixels_are_read |
//! | dicom-enhanced-frame-order | dicom_series::frames_lie_where_their_functional_groups_say |
//! | dicom-folder-with-dicomdir | dicom_series::directories_and_reports_in_the_folder_are_left_out_and_said |
//! | dicom-gantry-tilt | dicom_series::slices_beside_their_normal_are_refused_with_the_angle |
//! | dicom-modality-lut | dicom_series::a_table_of_values_is_looked_up_from_its_first_on |
//! | dicom-multiframe-offset-vector | dicom_series::frames_with_offsets_lie_along_the_normal |
//! | dicom-no-preamble | dicom_series::files_without_a_preamble_or_meta_information_are_read |
//! | dicom-order-without-positions | dicom_series::slices_without_positions_are_sorted_by_what_they_have_or_refused |
//! | dicom-padding-range | dicom_series::padding_is_neither_bone_nor_a_part_of_otsus_histogram |
//! | dicom-rescale-type | dicom_series::the_unit_is_the_one_that_the_series_names |
//! | dicom-rgb-seg-32bit-words | dicom_series::what_is_not_read_is_named |
//! | dicom-rounded-positions | dicom_series::uneven_slices_are_read_as_far_as_their_digits_explain |
//! | dicom-single-file-names | dicom_series::one_file_is_read_whatever_its_name |
//! | dicom-slices-of-other-pixel-size | dicom_series::a_series_of_other_pixels_sizes_or_series_is_refused |
//! | dicom-un-sequence | dicom_series::sequences_whose_representation_is_unknown_are_passed_over |
//! | cylinder-bvtv-above-1 | mask::voi::a_cylinder_keeps_its_share_of_voxels |
//! | folder-mixed-types | inputs::slices::slices_that_do_not_fit_are_refused |
//! | folder-poisoned-by-own-output | inputs::slices::results_do_not_lie_among_slices |
//! | header-over-64-kib | scan_headers::headers_of_any_length_are_read |
//! | imagej-depth-one | inputs::descriptions::a_depth_that_imagej_leaves_out_is_one_and_its_sign_does_not_count |
//! | imagej-unit-spelling | inputs::descriptions::units_are_read_however_they_are_spelled |
//! | imagej-yunit-zunit | inputs::descriptions::every_key_of_imagej_does_what_the_table_says |
//! | imagej-z-as-t | inputs::descriptions::a_stack_of_times_alone_is_one_of_slices |
//! | labels-above-2-24 | inputs::plausible::labels_that_cannot_be_told_apart_are_refused |
//! | manifest-spellings | cohort::manifest::files_are_read_as_people_save_them, cohort::manifest::what_may_mean_two_numbers_is_refused |
//! | mha-2d-4d-spacing | scan_headers::metaimage_of_two_and_four_dimensions_keeps_its_voxel_size |
//! | mha-ascii | scan_headers::metaimage_of_numbers_in_text_is_read_as_numbers |
//! | mha-list-headersize | scan_headers::metaimage_lists_and_patterns_skip_each_files_header |
//! | mha-list2d-and-pattern | scan_headers::metaimage_lists_and_patterns_skip_each_files_header |
//! | nifti-gzip-crc | scan_headers::a_flipped_bit_in_a_compressed_nifti_changes_no_voxel_unseen |
//! | nifti-hdr-img-capitals | scan_headers::a_pair_is_found_by_either_name_in_small_letters_or_capitals |
//! | nifti-pair-dotted-name | scan_headers::a_pair_is_found_by_either_name_in_small_letters_or_capitals |
//! | nifti-vox-offset-0 | scan_headers::nifti_that_programs_read_differently_is_refused |
//! | npy-one-axes-half | inputs::arrays::axes_of_one_and_halves_are_read |
//! | nrrd-capitals-and-1-axes | scan_headers::nrrd_words_are_read_in_any_case_and_axes_of_one_are_passed_over |
//! | nrrd-endian-capitals | scan_headers::nrrd_says_its_byte_order_in_any_case |
//! | nrrd-list-and-pattern | scan_headers::nrrd_lists_and_patterns_name_files_of_slices |
//! | nrrd-magic-of-gzip | scan_headers::raw_voxels_that_begin_as_gzip_does_are_raw |
//! | nrrd-rgb-as-volume | scan_headers::nrrd_with_channels_or_without_a_byte_order_is_refused |
//! | nrrd-skips-ignored | scan_headers::nrrd_skips_lines_and_bytes_before_the_voxels |
//! | nrrd-units-micrometre | scan_headers::nrrd_in_micrometres_is_not_a_thousand_times_too_large |
//! | ome-attribute-spelling | inputs::descriptions::ome_attributes_are_read_however_they_are_written |
//! | ome-channels-times-images | inputs::descriptions::every_attribute_of_ome_does_what_the_table_says, inputs::descriptions::ome_elements_that_are_no_one_scan_are_refused |
//! | orientation-lost-without-spacing | scan_headers::orientation_stays_where_only_the_voxel_size_is_missing, dicom_series::orientation_stays_where_only_the_pixel_size_is_missing |
//! | otsu-padding-and-hot-voxel | inputs::plausible::otsu_leaves_out_padding_and_hot_voxels |
//! | png-16-bit-alpha | inputs::slices::pictures_keep_all_their_bits |
//! | report-figure-collision | report::scans_of_like_names_have_figures_of_their_own |
//! | skyscan-section-step | inputs::slices::a_log_is_taken_before_tags |
//! | skyscan-two-logs-and-tag | image::slices::skyscan::the_log_with_the_slices_name_is_taken, inputs::slices::a_log_is_taken_before_tags |
//! | solve-anisotropic-voxels | inputs::plausible::sizes_no_scan_has_are_warned_of_or_refused_with_the_likely_slip |
//! | threshold-f32-bounds | inputs::plausible::bounds_take_voxels_of_their_own_value |
//! | tiff-compression-words | inputs::tags::every_tag_does_what_the_table_says, inputs::tags::colours_are_read_where_they_are_grey_and_else_refused_as_sound |
//! | tiff-odd-bits-and-fillorder | inputs::tags::samples_of_every_width_are_read_in_every_packing |
//! | tiff-printer-dpi | inputs::tags::resolutions_of_printers_are_no_voxel_sizes |
//! | tiff-reduced-page-and-mixed-types | inputs::tags::every_tag_does_what_the_table_says, inputs::tags::pages_of_two_kinds_are_refused |
//! | tiff-white-is-zero-float | inputs::tags::white_for_0_leaves_floats_as_they_are |
//! | tiff-white-is-zero-mask | inputs::tags::every_tag_does_what_the_table_says |
//! | voi-mask-mirrored | inputs::masks::a_mask_without_orientation_follows_the_scans_own_order, inputs::masks::a_mask_of_another_size_or_place_is_refused |

use super::documented;
use std::path::Path;

/// The source of a module of the tests or of the program.
fn source(module: &str) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = module.replace("::", "/");
    let candidates = ["tests", "src"].into_iter().flat_map(|folder| {
        let folder = root.join(folder);
        [
            folder.join(format!("{file}.rs")),
            folder.join(&file).join("mod.rs"),
        ]
    });
    let found: Vec<String> = candidates
        .filter_map(|path| std::fs::read_to_string(path).ok())
        .collect();
    assert!(!found.is_empty(), "no module {module}");
    found.concat()
}

/// A renamed or removed test leaves no input unheld.
#[test]
fn every_kind_of_input_has_its_tests() {
    for row in documented(include_str!("kinds.rs")) {
        for test in row[1].split(", ") {
            let (module, name) = test.rsplit_once("::").unwrap();
            let source = source(module);
            let lines: Vec<&str> = source.lines().map(str::trim).collect();
            let head = format!("fn {name}() {{");
            let is_test = lines
                .windows(2)
                .any(|pair| pair[0] == "#[test]" && pair[1] == head);
            assert!(is_test, "{}: no test {test}", row[0]);
        }
    }
}
