//! One table of a scene, while it is read.

use super::Scene;
use super::document::SceneFault;
use super::value::SettingValue;
use crate::math::nearest::nearest;
use std::ops::RangeInclusive;
use toml::Table;

/// A table of a scene; empty if the scene does not have it.
pub struct SceneTable<'a> {
    pub scene: &'a Scene,
    path: &'a [&'a str],
    table: Option<&'a Table>,
}

impl<'a> SceneTable<'a> {
    /// # Errors
    /// The value is not a table.
    pub(super) fn of(scene: &'a Scene, path: &'a [&'a str]) -> Result<SceneTable<'a>, SceneFault> {
        let table = match scene.document.value(path) {
            None => None,
            Some(value) => {
                let wrong = || SceneFault::new(path, format!("{value} is not a table"));
                Some(value.as_table().ok_or_else(wrong)?)
            }
        };
        Ok(SceneTable { scene, path, table })
    }

    pub fn fault(&self, name: &str, what: impl Into<String>) -> SceneFault {
        SceneFault::new(&self.key_of(name), what)
    }

    /// A fault of the whole table.
    pub fn whole(&self, what: impl Into<String>) -> SceneFault {
        SceneFault::new(self.path, what)
    }

    fn key_of<'b>(&self, name: &'b str) -> Vec<&'b str>
    where
        'a: 'b,
    {
        self.path.iter().copied().chain([name]).collect()
    }

    /// True if the scene states the key.
    pub fn states(&self, name: &str) -> bool {
        self.table.is_some_and(|table| table.contains_key(name))
    }

    /// Refuses keys that are not in `known`, and names the nearest known one.
    ///
    /// # Errors
    /// [`SceneFault`] with the first unknown key.
    pub fn check_names(&self, known: &[&str]) -> Result<(), SceneFault> {
        let stated = self.table.into_iter().flat_map(|table| table.keys());
        match stated.map(String::as_str).find(|name| !known.contains(name)) {
            None => Ok(()),
            Some(name) => {
                let nearest = nearest(name, known.iter().copied()).unwrap_or_default();
                Err(SceneFault::unknown(&self.key_of(name), &self.key_of(nearest).join(".")))
            }
        }
    }

    /// One key's value.
    ///
    /// # Errors
    /// A required key is missing, the type is wrong, or a number is out of range.
    pub fn field<T: SettingValue>(
        &self,
        name: &str,
        default: Option<T>,
        range: Option<RangeInclusive<T::Number>>,
    ) -> Result<T, SceneFault> {
        let key = self.key_of(name);
        let Some(value) = self.table.and_then(|table| table.get(name)) else {
            return default.ok_or_else(|| self.fault(name, "is missing"));
        };
        let read = T::read(value, self.scene.document.folder(&key)).map_err(|what| self.fault(name, what))?;
        if let Some(range) = range {
            // A range never contains NaN.
            if let Some(number) = read.numbers().into_iter().find(|number| !range.contains(number)) {
                let what = format!("{number} is outside {} ..= {}", range.start(), range.end());
                return Err(self.fault(name, what));
            }
        }
        Ok(read)
    }

    /// The value of a key that this kind requires.
    ///
    /// # Errors
    /// [`SceneFault`] if it is missing.
    pub fn required<T: Clone>(&self, name: &str, value: &Option<T>, kind: &str) -> Result<T, SceneFault> {
        value.clone().ok_or_else(|| self.fault(name, format!("{kind} needs {name}")))
    }

    /// Checks that the scene states none of `names`, which this kind does not have.
    ///
    /// # Errors
    /// [`SceneFault`] for the first one that the scene states.
    pub fn reject(&self, names: &[&str], kind: &str) -> Result<(), SceneFault> {
        match names.iter().find(|name| self.states(name)) {
            Some(name) => Err(self.fault(name, format!("{kind} has no {name}"))),
            None => Ok(()),
        }
    }
}
