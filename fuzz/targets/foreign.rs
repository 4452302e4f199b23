//! Checks that every reader of a foreign file format must pass.

use std::panic;
use std::path::Path;
use std::sync::Once;

use nearmiss::io::{Format, read_bytes, read_mesh_bytes};

/// Reads `bytes`, whatever they are: a model that agrees with itself, or an error that says what is wrong.
pub(crate) fn read(bytes: &[u8], format: Format) {
    // A decoder's panic that the reader catches is no finding; one that it does not still ends the program.
    static QUIET: Once = Once::new();
    QUIET.call_once(|| panic::set_hook(Box::new(|_| ())));
    let name = Path::new("input");
    match read_bytes(bytes, Some(format), name) {
        Ok(model) => {
            let given =
                model.cloud.len() + model.cloud.dropped().duplicate + model.cloud.dropped().not_finite;
            assert!(model.cloud.source().iter().all(|&i| (i as usize) < given));
            if let Some(mesh) = model.mesh {
                assert_eq!(mesh.vertices().len(), given);
            }
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.starts_with("input") && message.len() < 400, "{message}");
            assert!(!message.chars().any(char::is_control), "{message:?}");
        }
    }
    let _mesh_or_error = read_mesh_bytes(bytes, Some(format), name);
}
