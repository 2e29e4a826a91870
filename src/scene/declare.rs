//! Declares the settings of a technique: `settings!` for a table of a scene, `choices!` for an enum. Each generates
//! the struct, its defaults, parsing with checks, and the list of keys from which the documents are generated.

use super::document::SceneFault;
use super::part::SceneTable;
use super::value::{SettingValue, ValueKind};
use super::{Scene, SceneError};
use serde_json::Value as Json;
use std::path::Path;

/// One key of a table.
#[derive(Clone, Debug)]
pub struct KeyDeclaration {
    pub name: &'static str,
    pub about: String,
    pub kind: ValueKind,
    /// In TOML. `None`: see `required`.
    pub default: Option<toml::Value>,
    /// True if a key without default must be stated. Otherwise it is optional, and its documentation says what its
    /// absence means.
    pub required: bool,
    pub min_and_max: Option<[Json; 2]>,
    /// Empty if there is none.
    pub unit: &'static str,
    /// Resolves a relative path against a folder; returns other values unchanged.
    pub(super) anchored: fn(&toml::Value, &Path) -> toml::Value,
}

/// A struct that is a table of a scene. Implemented by [`settings!`](crate::scene::settings).
pub trait Settings: Sized {
    /// Description of the table.
    const ABOUT: &'static str;
    /// Value of the table's key `kind`, if the kind determines which keys exist.
    const KIND: Option<&'static str>;

    fn keys() -> Vec<KeyDeclaration>;

    /// Reads and checks a table: types, ranges, unknown keys, and the declaration's own check.
    ///
    /// # Errors
    /// [`SceneFault`] with the key.
    fn read(part: &SceneTable<'_>) -> Result<Self, SceneFault>;
}

/// The names of a table's keys, `kind` included.
pub fn names<T: Settings>() -> Vec<&'static str> {
    T::keys().iter().map(|key| key.name).chain(T::KIND.map(|_| "kind")).collect()
}

/// A table of scenes, for documents and the check of a whole scene.
pub struct TableDeclaration {
    /// `*` matches any name that the scene chooses.
    pub path: &'static [&'static str],
    pub kind: Option<&'static str>,
    pub about: &'static str,
    pub keys: fn() -> Vec<KeyDeclaration>,
    pub(super) read: fn(&Scene, &[&str]) -> Result<(), SceneError>,
}

impl TableDeclaration {
    pub const fn of<T: Settings>(path: &'static [&'static str]) -> TableDeclaration {
        let read = |scene: &Scene, path: &[&str]| scene.read::<T>(path).map(drop);
        TableDeclaration { path, kind: T::KIND, about: T::ABOUT, keys: T::keys, read }
    }
}

/// All tables and keys that one technique adds to scenes.
pub struct Language {
    pub tables: &'static [TableDeclaration],
    /// A check that involves several tables.
    pub check: fn(&Scene) -> Result<(), SceneError>,
}

impl KeyDeclaration {
    pub fn of<T: SettingValue>(
        name: &'static str,
        about: &'static str,
        default: Option<T>,
        range: Option<std::ops::RangeInclusive<T::Number>>,
        unit: &'static str,
    ) -> KeyDeclaration {
        let json = |number: T::Number| serde_json::to_value(number).expect("a number");
        KeyDeclaration {
            name,
            about: one_line(about),
            kind: T::kind(),
            required: default.is_none(),
            default: default.and_then(|default| default.to_toml()),
            min_and_max: range.map(|range| [json(*range.start()), json(*range.end())]),
            unit,
            anchored: anchored::<T>,
        }
    }
}

/// The value as TOML, with a relative path resolved against `folder`. Values that are not paths stay as they
/// are.
fn anchored<T: SettingValue>(value: &toml::Value, folder: &Path) -> toml::Value {
    let read = |folder| T::read(value, folder).ok().and_then(|value| value.to_toml());
    match read(folder) {
        Some(there) if read(Path::new("")).as_ref() != Some(&there) => there,
        _ => value.clone(),
    }
}

/// Joins the lines of a doc comment.
pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Declares a table of scenes, each key once: `settings! { /// doc  pub struct Cache with DEFAULT { /// doc
/// gpu_tiles: u32 = 192, in 1..=65536, unit "tiles"; } }`.
///
/// A key without a default is required. Optional after the struct's name, in this order:
/// - `derive(Copy, ...)`.
/// - `kind "plane"`: the table's `kind` determines its keys.
/// - `with DEFAULT`: the table is optional. Every key then has a default, and the struct has a constant `DEFAULT`.
///
/// Optional after the keys:
/// - `beside { ... }`: fields that this table does not set.
/// - `check F`: a `fn(&Self, &SceneTable) -> Result<(), SceneFault>` for conditions on several keys.
#[macro_export]
#[doc(hidden)]
macro_rules! __settings {
    (
        $(#[doc = $about:literal])+
        pub struct $name:ident $(derive($($derive:ident),+))? $(kind $kind:literal)? $(with $with_default:ident)? {
            $($(#[doc = $doc:literal])+ $field:ident: $type:ty $(= $default:expr)? $(, in $range:expr)? $(, unit $unit:literal)?;)*
        }
        $(beside { $($(#[doc = $beside_doc:literal])+ $beside:ident: $beside_type:ty = $beside_default:expr;)* })?
        $(check $check:path;)?
    ) => {
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq, serde::Serialize $($(, $derive)+)?)]
        pub struct $name {
            $($(#[doc = $doc])+ pub $field: $type,)*
            $($($(#[doc = $beside_doc])+ pub $beside: $beside_type,)*)?
        }

        $crate::scene::settings! {
            @default [$($with_default)?] $name
            { $($field: ($($default)?),)* $($($beside: ($beside_default),)*)? }
        }

        impl $crate::scene::Settings for $name {
            const ABOUT: &'static str = concat!($($about, "\n"),+);
            const KIND: Option<&'static str> = [$(Some($kind),)? None][0];

            fn keys() -> Vec<$crate::scene::KeyDeclaration> {
                vec![$($crate::scene::KeyDeclaration::of::<$type>(
                    stringify!($field),
                    concat!($($doc, "\n"),+),
                    $crate::scene::settings!(@option $($default)?),
                    $crate::scene::settings!(@option $($range)?),
                    concat!($($unit)?),
                )),*]
            }

            fn read(part: &$crate::scene::SceneTable<'_>) -> std::result::Result<Self, $crate::scene::SceneFault> {
                part.check_names(&$crate::scene::names::<Self>())?;
                let settings = Self {
                    $($field: part.field(
                        stringify!($field),
                        $crate::scene::settings!(@option $($default)?),
                        $crate::scene::settings!(@option $($range)?),
                    )?,)*
                    $($($beside: $beside_default,)*)?
                };
                $($check(&settings, part)?;)?
                Ok(settings)
            }
        }
    };
    (@option) => { None };
    (@option $value:expr) => { Some($value) };
    (@default [] $name:ident $fields:tt) => {};
    (@default [DEFAULT] $name:ident { $($field:ident: ($value:expr),)* }) => {
        impl $name {
            /// The settings of a scene without this table.
            pub const DEFAULT: $name = $name { $($field: $value),* };
        }

        impl Default for $name {
            fn default() -> Self {
                Self::DEFAULT
            }
        }
    };
}

/// Declares an enum whose values have a name in scenes and a one-line description. `refused { "name" = "reason", }`
/// after it lists known names that are not values; the error for them gives the reason.
#[macro_export]
#[doc(hidden)]
macro_rules! __choices {
    ($(#[$meta:meta])* pub enum $name:ident {
        $($(#[doc = $about:literal])+ $value:ident = $word:literal,)+
    } $(refused { $($other:literal = $reason:literal,)+ })?) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
        pub enum $name {
            $($(#[doc = $about])+ #[serde(rename = $word)] $value,)+
        }

        impl $name {
            pub const ALL: &'static [$name] = &[$($name::$value),+];

            /// Name in scenes.
            pub const fn name(self) -> &'static str {
                match self { $($name::$value => $word,)+ }
            }

            /// Description.
            pub fn about(self) -> &'static str {
                match self { $($name::$value => concat!($($about),+).trim_ascii(),)+ }
            }
        }

        impl $crate::scene::Choice for $name {
            const ALL: &'static [Self] = Self::ALL;
            const REFUSED: &'static [(&'static str, &'static str)] = &[$($(($other, $reason)),+)?];
            fn name(self) -> &'static str { self.name() }
            fn about(self) -> &'static str { self.about() }
        }
    };
}

pub use __choices as choices;
pub use __settings as settings;
