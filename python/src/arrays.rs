//! Owns voxels on their way between NumPy and the library.

use bonepd_ct::command::solve::Fields;
use bonepd_ct::format::orient;
use bonepd_ct::pipeline::apparent::fields::{FieldVolume, MeshArray, MeshFields, SiteFields};
use bonepd_ct::volume::Volume;
use numpy::ndarray::Array2;
use numpy::{Element, IntoPyArray, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Number of voxels along x, y, z of an array of shape `(nz, ny, nx)`, and a copy of its values, x fastest.
///
/// # Errors
/// An array that is not C-contiguous.
pub fn taken<T: Element + Copy>(array: &PyReadonlyArray3<T>) -> PyResult<([usize; 3], Vec<T>)> {
    let &[nz, ny, nx] = array.shape() else {
        unreachable!("arrays of three axes have three lengths");
    };
    Ok(([nx, ny, nz], array.as_slice()?.to_vec()))
}

/// A volume as an array of shape `(nz, ny, nx)`. Nothing is copied.
pub fn given<'py, T: Element>(py: Python<'py>, volume: Volume<T>) -> Bound<'py, PyAny> {
    volume.values.into_pyarray(py).into_any()
}

/// The fields of one solve by name: of voxels a list of arrays of shape `(nz, ny, nx)`, one a component (of nodes one longer along each
/// axis), in the order of the array that was solved; of sites, nodes and elements arrays of shape `(n,)` or `(n, components)`, and their
/// places.
///
/// # Errors
/// Python's, where memory is short.
pub fn fields<'py>(py: Python<'py>, fields: Fields) -> PyResult<Bound<'py, PyDict>> {
    let named = PyDict::new(py);
    match fields {
        Fields::None => {}
        Fields::OfVoxels(fields, axes) => {
            let back = axes.inverse();
            for FieldVolume {
                name, components, ..
            } in fields
            {
                let turned = |v: Volume<f32>| given(py, orient::turned(v, &back));
                let arrays: Vec<_> = components.into_iter().map(turned).collect();
                named.set_item(name, arrays)?;
            }
        }
        Fields::OfSites(_, sites) => of_sites(&named, sites)?,
        Fields::OfMesh(mesh) => of_mesh(&named, mesh)?,
    }
    Ok(named)
}

fn of_sites(named: &Bound<PyDict>, sites: SiteFields) -> PyResult<()> {
    let py = named.py();
    named.set_item("at_mm", rows(py, &sites.at_mm))?;
    if let Some(u) = sites.displacement_mm {
        named.set_item("displacement_mm", rows(py, &u))?;
    }
    if let Some(sed) = sites.sed_mpa {
        named.set_item("sed_mpa", sed.into_pyarray(py))?;
    }
    if let Some(fraction) = sites.fraction {
        named.set_item("fraction", fraction.into_pyarray(py))?;
    }
    if let Some(force) = sites.force_n {
        named.set_item("force_n", rows(py, &force))?;
    }
    Ok(())
}

fn of_mesh(named: &Bound<PyDict>, mesh: MeshFields) -> PyResult<()> {
    let py = named.py();
    named.set_item("nodes_mm", rows(py, &mesh.nodes_mm))?;
    named.set_item("elements", rows(py, &mesh.elements))?;
    for array in mesh.of_nodes.into_iter().chain(mesh.of_elements) {
        let MeshArray {
            name,
            components,
            values,
        } = array;
        match components {
            1 => named.set_item(name, values.into_pyarray(py))?,
            _ => named.set_item(name, shaped(py, components, values))?,
        }
    }
    Ok(())
}

/// Values of shape `(n, N)`.
fn rows<'py, T: Element + Copy, const N: usize>(
    py: Python<'py>,
    values: &[[T; N]],
) -> Bound<'py, PyAny> {
    shaped(py, N, values.as_flattened().to_vec())
}

fn shaped<T: Element>(py: Python<'_>, columns: usize, values: Vec<T>) -> Bound<'_, PyAny> {
    let shape = (values.len() / columns, columns);
    let array = Array2::from_shape_vec(shape, values).expect("whole rows");
    array.into_pyarray(py).into_any()
}
