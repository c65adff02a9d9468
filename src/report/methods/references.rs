//! Owns the references of a methods section.

/// Words of the text that cite, and the reference.
const ALL: [(&[&str], &str); 8] = [
    (
        &["Chen and Liu 2016"],
        "Chen, H., and Liu, Y. (2016). A non-local 3D lattice particle framework for elastic solids. Int. J. Solids Struct. 81, 411–420.",
    ),
    (
        &["Hildebrand and Rüegsegger 1997"],
        "Hildebrand, T., and Rüegsegger, P. (1997). A new method for the model-independent assessment of thickness in three-dimensional images. J. Microsc. 185, 67–75.",
    ),
    (
        &["Meurant and Tichý 2019"],
        "Meurant, G., and Tichý, P. (2019). Approximating the extreme Ritz values and upper bounds for the A-norm of the error in CG. Numer. Algorithms 82, 937–968.",
    ),
    (
        &["Otsu 1979"],
        "Otsu, N. (1979). A threshold selection method from gray-level histograms. IEEE Trans. Syst. Man Cybern. 9, 62–66.",
    ),
    (
        &["Pahr and Zysset 2008"],
        "Pahr, D. H., and Zysset, P. K. (2008). Influence of boundary conditions on computed apparent elastic properties of cancellous bone. Biomech. Model. Mechanobiol. 7, 463–476.",
    ),
    (
        &["Pistoia et al. (2002)"],
        "Pistoia, W., van Rietbergen, B., Lochmüller, E.-M., Lill, C. A., Eckstein, F., and Rüegsegger, P. (2002). Estimation of distal radius failure load with micro-finite element analysis models based on three-dimensional peripheral quantitative computed tomography images. Bone 30, 842–848.",
    ),
    (
        &["Zojaji et al. 2024"],
        "Zojaji, M., Ferasat, K., Van Klei, M., Sun, H., Beloglowka, K., Kunath, B., Rainbow, R., Ploeg, H.-L., and Béland, L. K. (2024). Elastic response of trabecular bone under compression calculated using the firm and floppy boundary lattice element method. J. Biomech. doi 10.1016/j.jbiomech.2024.112209.",
    ),
    (&["bonepd-ct"], ""),
];

/// The references that `text` cites, the program among them.
pub fn cited(text: &str, version: &str) -> Vec<String> {
    let is_cited = |marks: &[&str]| marks.iter().any(|mark| text.contains(mark));
    let of = |(marks, reference): &(&[&str], &str)| {
        is_cited(marks).then(|| match reference.is_empty() {
            true => format!(
                "The bonepd-ct maintainers: bonepd-ct {version}. Software; CITATION.cff in its source says how to cite it."
            ),
            false => (*reference).to_owned(),
        })
    };
    ALL.iter().filter_map(of).collect()
}
