//! One value of each knob, and which values are combined.

use crate::paper::virtual_texture::choices::{
    Compaction, Dedup, FilterEdge, FilterMap, Filtering, Listing, RequestDraw, TileAddress,
};
use crate::paper::virtual_texture::config::{
    Config, Filter, MAX_SAMPLES, TextureSource, VirtualTextureSettings, VirtualTextureSource,
};
use crate::scene::{Choice, unread_filter_keys};
use crate::texture::source::TileFormat;

use std::fmt::Display;

/// A point of the sweep.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SweepPoint {
    /// The differences from the scene, in words.
    pub name: String,
    /// The differences from the scene, as `KEY=VALUE`.
    pub changes: Vec<String>,
}

/// The variants of stages 1 to 3.
pub(super) type Stages = (RequestDraw, Dedup, Compaction, TileAddress);

/// The values of all knobs.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Values {
    pub level_bias: u32,
    pub filter: Filtering,
    pub samples: u32,
    pub max_anisotropy: u32,
    pub minor_texels: f64,
    pub edge: FilterEdge,
    pub weight_map: FilterMap,
    pub border: u32,
    pub list: Listing,
    pub feedback_log2: u32,
    pub stages: Stages,
    pub format: TileFormat,
    /// Slots of the tile pool.
    pub gpu_tiles: u32,
}

impl Values {
    pub fn of(settings: &VirtualTextureSettings, texture: &VirtualTextureSource) -> Values {
        let Config { level_bias, list, feedback_log2, request_draw, filter, .. } = settings.config;
        let Config { dedup, compact, address, .. } = settings.config;
        let Filter { kind, max_anisotropy, minor_texels, edge, weight_map, samples, .. } = filter;
        Values {
            level_bias,
            filter: kind,
            samples,
            max_anisotropy,
            minor_texels,
            edge,
            weight_map,
            border: texture.border,
            list,
            feedback_log2,
            stages: (request_draw, dedup, compact, address),
            format: texture.format,
            gpu_tiles: settings.streaming.gpu_tiles,
        }
    }

    /// The values with a sufficient border, or `None` if they are not to be measured. Samples along a footprint need a
    /// border of 2 texels; in small tiles they need one texel for each sample. A generated texture can have any border;
    /// a file's border is fixed.
    pub fn drawable(self, own: &Values, texture: &VirtualTextureSource) -> Option<Values> {
        if self == *own {
            return Some(self);
        }
        // A map is tried with the scene's own ellipse. In a scene with another filter, it is tried with the ellipses
        // whose axes have a ratio of up to 16.
        let replaces = match own.filter {
            Filtering::Ellipse => Values { weight_map: own.weight_map, ..self } == *own,
            _ => self.filter == Filtering::Ellipse && self.max_anisotropy == 16 && self.edge == own.edge,
        };
        let mapped = self.weight_map == own.weight_map || replaces;
        // Two kinds of values are not combined with other changes: subsampled lists, which delay the complete picture
        // but do not change it, and borders other than 0 and the scene's own.
        let (list, feedback_log2) = (own.list, own.feedback_log2);
        let listed = (self.list, self.feedback_log2) == (list, feedback_log2)
            || Values { list, feedback_log2, ..self } == *own;
        let bordered =
            [0, own.border].contains(&self.border) || Values { border: own.border, ..self } == *own;
        // Other filters than the stochastic ones ignore the number of samples.
        let sampled = self.filter.is_random() || self.samples == own.samples;
        // A list made on the host has no stages 2 and 3. Another `request_draw` changes only the time, by an amount
        // that other settings hardly change, so it is not combined with other changes.
        let of_other_draw = self.stages.0 != own.stages.0;
        let stages = match of_other_draw {
            true => Values { stages: own.stages, ..self } == *own,
            false => self.list == Listing::Device || self.stages == own.stages,
        };
        let filter = Filter { kind: self.filter, max_anisotropy: self.max_anisotropy, ..Filter::DEFAULT };
        let border = border_for(&filter, self.border, texture).ok()?;
        // Another format is tried with all filters but the stochastic one, at the scene's own bias, list and border,
        // and only if the border is a whole number of BC1 blocks. A smaller tile pool is not combined with other
        // changes.
        let format = self.format == own.format
            || (self.filter != Filtering::Stochastic
                && (self.level_bias, self.list, self.border) == (own.level_bias, own.list, own.border)
                && border.is_multiple_of(4));
        let fewer = self.gpu_tiles == own.gpu_tiles || Values { gpu_tiles: own.gpu_tiles, ..self } == *own;
        let alone = listed && bordered && fewer;
        (self.has_sensible_filter(own) && mapped && sampled && stages && format && alone)
            .then_some(Values { border, ..self })
    }

    /// False for filters that are not to be measured with the other values.
    fn has_sensible_filter(&self, own: &Values) -> bool {
        match self.filter {
            Filtering::Trilinear => self.border > 0 || self.max_anisotropy == 1,
            // Trilinear samples along a footprint are better than bilinear ones.
            Filtering::Bilinear => self.max_anisotropy == 1,
            // Few taps along a long footprint show only noise. Taps need no border, so other borders are not tried with
            // them.
            Filtering::Stochastic => {
                (self.max_anisotropy == 1 || self.samples == 16) && self.border == own.border
            }
            // A filter of paper 3 that is not the scene's own is not combined with changes of other settings. Some of
            // these filters ignore max_anisotropy.
            filter => {
                let numbers = |of: &Values| (of.max_anisotropy, of.minor_texels, of.edge, of.samples);
                let distinct = match filter {
                    Filtering::Feline => [4, 16].contains(&self.max_anisotropy),
                    Filtering::Mavridis => self.max_anisotropy == 4,
                    Filtering::Pbrt | Filtering::StochasticEllipse => {
                        self.max_anisotropy == own.max_anisotropy.min(MAX_SAMPLES)
                    }
                    _ => true,
                };
                let Values { filter, max_anisotropy, minor_texels, edge, weight_map, samples, .. } = *own;
                let of_own =
                    Values { filter, max_anisotropy, minor_texels, edge, weight_map, samples, ..*self };
                let alone = of_own == *own;
                (filter, numbers(own)) == (self.filter, numbers(self)) || alone && distinct
            }
        }
    }

    /// The setting with these values. `surface` is the key of the surface with the texture.
    pub fn setting(&self, own: &Values, surface: &str) -> SweepPoint {
        let (mut words, mut changes) = (Vec::new(), Vec::new());
        let mut differs = |is: bool, word: String, keys: &[String]| {
            if is {
                words.push(word);
                changes.extend_from_slice(keys);
            }
        };
        let taps = if self.filter.is_random() { format!(" {}", self.samples) } else { String::new() };
        let filter = self.filter.name();
        let (minor, [na, border]) = (self.minor_texels, [self.max_anisotropy, self.border]);
        let [bias, n1] = [self.level_bias, self.gpu_tiles];
        let mut keys =
            Vec::from_iter((self.filter != own.filter).then(|| format!("{surface}.filter.kind={filter}")));
        keys.extend(
            (self.samples != own.samples).then(|| format!("{surface}.filter.samples={}", self.samples)),
        );
        differs(!keys.is_empty(), format!("{filter}{taps}"), &keys);
        let of_filter = |key: &str, value: &dyn Display| [format!("{surface}.filter.{key}={value}")];
        differs(minor != own.minor_texels, format!("minor {minor}"), &of_filter("minor_texels", &minor));
        let edge = self.edge.name();
        differs(self.edge != own.edge, format!("edge {edge}"), &of_filter("edge", &edge));
        let map = self.weight_map.name();
        let word = if self.weight_map == FilterMap::None { "no" } else { map };
        differs(self.weight_map != own.weight_map, format!("{word} map"), &of_filter("weight_map", &map));
        // A setting with another filter kind keeps the scene's number, or gets the default if the scene's own kind does
        // not read that key.
        let reads = unread_filter_keys(filter).all(|(key, _)| key != "max_anisotropy");
        let other_na = na != own.max_anisotropy && reads;
        differs(other_na, format!("NA {na}"), &of_filter("max_anisotropy", &na));
        differs(
            border != own.border,
            format!("border {border}"),
            &[format!("{surface}.texture.border={border}")],
        );
        differs(bias != own.level_bias, format!("bias {bias}"), &[format!("variant.level_bias={bias}")]);
        let n = self.feedback_log2;
        let list = [format!("variant.list={}", self.list.name()), format!("variant.feedback_log2={n}")];
        let another = (self.list, n) != (own.list, own.feedback_log2);
        differs(another, format!("{} 1/{}", self.list.name(), 1 << n), &list);
        let (stages, keys) = of_stages(self.stages);
        differs(self.stages != own.stages, stages, &keys);
        let format = self.format.name();
        differs(
            self.format != own.format,
            format.to_string(),
            &[format!("{surface}.texture.format={format}")],
        );
        differs(n1 != own.gpu_tiles, format!("N1 {n1}"), &[format!("cache.gpu_tiles={n1}")]);
        let name = if words.is_empty() { "the scene's own".to_string() } else { words.join(", ") };
        SweepPoint { name, changes }
    }
}

/// The name of the stages, and their keys.
fn of_stages((request_draw, dedup, compact, address): Stages) -> (String, [String; 4]) {
    let name = match request_draw {
        RequestDraw::Separate => dedup.name().to_string(),
        RequestDraw::Texturing => format!("one draw, {}", dedup.name()),
    };
    let keys = [
        format!("variant.request_draw={}", request_draw.name()),
        format!("variant.dedup={}", dedup.name()),
        format!("variant.compact={}", compact.name()),
        format!("variant.address={}", address.name()),
    ];
    (name, keys)
}

/// The first border that suffices for the filter and that the texture can have; `border` is tried first. The error
/// says why there is none.
pub(super) fn border_for(
    filter: &Filter,
    border: u32,
    texture: &VirtualTextureSource,
) -> Result<u32, String> {
    let fault = |border| {
        let pyramid = VirtualTextureSource { border, ..texture.clone() }.pyramid();
        let beyond = filter.tile_fault(border, texture.tile_size).map(|(_, why)| why);
        beyond.or_else(|| pyramid.err().map(|error| error.to_string()))
    };
    let others = match texture.source {
        TextureSource::File => Vec::new(),
        _ => vec![filter.min_border(), filter.max_anisotropy],
    };
    others.into_iter().fold(fault(border).map_or(Ok(border), Err), |found, other| {
        found.or_else(|_| fault(other).map_or(Ok(other), Err))
    })
}
