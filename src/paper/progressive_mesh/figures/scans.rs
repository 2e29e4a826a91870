//! Scans whose licence does not allow shipping them: figures measure them if `ortelius fetch` has downloaded them, and
//! otherwise leave them out.

use crate::figure::LeftOut;
use crate::model::{FETCHED, Model, fetched};

/// The scan of 11 102 faces, also used in quick runs.
pub const SMALL: &str = "dragon_res4";
/// The scan of 871 414 faces, too large for quick runs.
pub const LARGE: &str = "dragon";

pub const ALL: [&str; 2] = [SMALL, LARGE];

/// Checks that a model is present, if it is a scan.
///
/// # Errors
/// [`LeftOut`] if the scan is not fetched.
pub fn check_fetched(name: &str) -> Result<(), LeftOut> {
    match FETCHED.iter().any(|scan| scan.name == name) && fetched(name).is_none() {
        true => Err(LeftOut(format!("{name} is not fetched: ortelius fetch {name}"))),
        false => Ok(()),
    }
}

/// A model by its name, shipped or fetched.
///
/// # Errors
/// As [`check_fetched`] and [`Model::open`].
pub fn open(name: &str) -> anyhow::Result<Model> {
    check_fetched(name)?;
    Ok(Model::open(name)?.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_scan_is_left_out_and_a_shipped_model_is_measured() {
        assert!(check_fetched("bunny").is_ok());
        assert_eq!(check_fetched(LARGE).is_ok(), fetched(LARGE).is_some());
        assert_eq!(check_fetched(SMALL).is_ok(), fetched(SMALL).is_some());
    }
}
