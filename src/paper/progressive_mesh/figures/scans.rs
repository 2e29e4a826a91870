//! Scans that may not be shipped: figures measure them if `ortelius fetch` has downloaded them, and otherwise
//! leave them out.

use crate::figure::{Cell, Effort, LeftOut};
use crate::model::{FETCHED, Model, fetched};

/// The scan of 11 102 faces, also used in quick runs.
pub const SMALL: &str = "dragon_res4";
/// The scan of 871 414 faces, too large for quick runs.
pub const LARGE: &str = "dragon";

/// Checks that this run measures the cell's scene, if it is a scan.
///
/// # Errors
/// [`LeftOut`] if the scan is not fetched, or too large for a quick run.
pub fn check(cell: &Cell, effort: Effort) -> Result<(), LeftOut> {
    let name = &*cell.scene;
    match FETCHED.iter().any(|scan| scan.name == name) {
        true if name == LARGE && effort == Effort::Quick => {
            Err(LeftOut(format!("{name} is measured only with --full")))
        }
        true => check_fetched(name),
        false => Ok(()),
    }
}

/// # Errors
/// [`LeftOut`] if the scan is not fetched.
pub fn check_fetched(name: &str) -> Result<(), LeftOut> {
    fetched(name).map(drop).ok_or_else(|| LeftOut(format!("{name} is not fetched: ortelius fetch {name}")))
}

/// A model by its name, shipped or fetched.
///
/// # Errors
/// As [`Model::open`].
pub fn open(name: &str) -> anyhow::Result<Model> {
    Ok(Model::open(name)?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_scan_is_left_out_and_a_shipped_model_is_measured() {
        let checked = |scene: &str, effort| check(&Cell { scene: scene.into(), x: None }, effort);
        assert!(checked("bunny", Effort::Quick).is_ok());
        // A quick run leaves it out even if it is present.
        assert_eq!(checked(LARGE, Effort::Quick).unwrap_err().0, "dragon is measured only with --full");
        assert_eq!(checked(LARGE, Effort::Full).is_ok(), fetched(LARGE).is_some());
        assert_eq!(checked(SMALL, Effort::Quick).is_ok(), fetched(SMALL).is_some());
    }
}
