//! Finds figures by name.

use super::Figure;
use crate::math::nearest::nearest;
use thiserror::Error;

/// A family's name and its figures, in the order of the report.
pub type Family = (&'static str, &'static [&'static Figure]);

/// A name that is neither a figure nor a family.
#[derive(Debug, Error)]
#[error("unknown figure or family {name:?}; the nearest is {nearest}; `ortelius list` shows all")]
pub struct UnknownFigure {
    pub name: String,
    pub nearest: String,
}

/// The figures that `names` select (ids or families), each once, in the order of `families`. An empty list
/// selects all figures.
///
/// # Errors
/// [`UnknownFigure`] for the first unknown name.
pub fn choose(families: &[Family], names: &[String]) -> Result<Vec<&'static Figure>, UnknownFigure> {
    let known = || {
        let ids = families.iter().flat_map(|(_, figures)| figures.iter().map(|figure| figure.id));
        families.iter().map(|(family, _)| *family).chain(ids)
    };
    for name in names {
        if !known().any(|known| known == name) {
            let nearest = nearest(name, known()).unwrap_or("none: there are no figures").to_string();
            return Err(UnknownFigure { name: name.clone(), nearest });
        }
    }
    let meant = |name: &str| names.is_empty() || names.iter().any(|given| given == name);
    let of_family = |(family, figures): &Family| {
        let whole = meant(family);
        figures.iter().copied().filter(move |figure| whole || meant(figure.id)).collect::<Vec<_>>()
    };
    Ok(families.iter().flat_map(of_family).collect())
}
