//! Scans that may not be shipped: figures measure them if `ortelius fetch` has downloaded them, and otherwise
//! report them as missing.

use crate::figure::{Cell, Effort, Row};
use crate::model::{FETCHED, Model, fetched};

/// The scan of 11 102 faces, also used in quick runs.
pub const SMALL: &str = "dragon_res4";
/// The scan of 871 414 faces, too large for quick runs.
pub const LARGE: &str = "dragon";

/// Rows that replace a scan's rows and say why `quantity` of each variant is missing. `None` if it can be
/// measured.
pub fn absent(cell: &Cell, effort: Effort, variants: &[String], quantity: &str) -> Option<Vec<Row>> {
    let name = &*cell.scene;
    FETCHED.iter().find(|scan| scan.name == name)?;
    let why = match fetched(name) {
        None => format!("{name} is not fetched: ortelius fetch {name}"),
        Some(_) if name == LARGE && effort == Effort::Quick => {
            format!("{name} is measured only with --full")
        }
        Some(_) => return None,
    };
    let row = |variant: &String| Row::missing(&**variant, quantity, why.clone());
    Some(variants.iter().map(row).collect())
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
    use crate::figure::Value;

    #[test]
    fn a_missing_scan_is_reported_and_a_shipped_model_is_measured() {
        let absent_rows = |scene: &str, effort| {
            let cell = Cell { scene: scene.into(), x: None };
            absent(&cell, effort, &["tail-23".into(), "random".into()], "faces")
        };
        assert_eq!(absent_rows("bunny", Effort::Quick), None);
        // A quick run skips the scan even if it is present.
        let rows = absent_rows(LARGE, Effort::Quick).unwrap();
        assert_eq!(rows.len(), 2);
        assert!(matches!(&rows[0].value, Value::Missing(why) if why.starts_with("dragon is")));
        assert_eq!(absent_rows(LARGE, Effort::Full).is_none(), fetched(LARGE).is_some());
        assert_eq!(absent_rows(SMALL, Effort::Quick).is_none(), fetched(SMALL).is_some());
    }
}
