//! The keys of one surface: refuses keys without an effect, and reads the filter, the relief and the plain texture.

use super::RenderError;
use super::plain::{ALBEDO, PlainFilter};
use crate::paper::texture_mapping::config::{ReliefKeys, side_of};
use crate::paper::texture_mapping::relief::shipped::{BRICK_WALL, CLIFF};
use crate::paper::texture_mapping::relief::surface::{MAX_WORK, work};
use crate::paper::texture_mapping::relief::{Relief, ReliefKind};
use crate::paper::virtual_texture::config::{Filter, filter};
use crate::picture::srgb;
use crate::reference::pattern::Pattern;
use crate::scene::{Geometry, Plain, PlainSource, Scene, Surface};
use crate::texture::plain::PlainTexture;

/// True if a surface shows the virtual texture of `owner`.
pub(super) fn carries_virtual(surface: &Surface, owner: Option<&Surface>) -> bool {
    owner.is_some_and(|owner| surface.texture.as_ref() == Some(&owner.name))
}

/// True if the sun lights the surface. A surface with a virtual texture is lit only if the scene says so.
pub(super) fn is_lit(surface: &Surface, owner: Option<&Surface>) -> bool {
    surface.lit.unwrap_or(!carries_virtual(surface, owner))
}

/// Refuses settings of a surface that no technique would use.
pub(super) fn check(scene: &Scene, surface: &Surface, owner: Option<&Surface>) -> Result<(), RenderError> {
    let key = |key| ["surface", &surface.name, key];
    let fault = |at, what: &str| Err(scene.fault(&key(at), what).into());
    let is_mesh = surface.grid().is_none();
    if is_mesh && surface.texture.is_none() && surface.lit == Some(false) {
        return fault("lit", "a progressive mesh without a texture is always lit; omit lit");
    }
    if scene.has(&key("relief")) && carries_virtual(surface, owner) {
        return fault("relief", "a relief needs a plain texture; this surface has a virtual texture");
    }
    relief(scene, surface)?;
    if !scene.has(&key("filter")) {
        return Ok(());
    }
    let is_owner = owner.is_some_and(|owner| owner.name == surface.name);
    if carries_virtual(surface, owner) && !is_owner {
        return fault(
            "filter",
            "a shared texture has one filter; state it at the surface that owns the texture",
        );
    }
    let filter = filter(scene, surface)?;
    let by_sampler = [Filter::DEFAULT, Filter::ONE_SAMPLE].contains(&filter);
    if !is_owner && !by_sampler && !filter.kind.is_of_paper_3() {
        let what = "a plain texture has the sampler's trilinear filter and the kinds \"ellipse\", \"feline\", \
                    \"mavridis\", \"pbrt\" and \"stochastic-ellipse\"; use one of these, or a virtual texture";
        return fault("filter", what);
    }
    Ok(())
}

/// The filter of a surface's plain texture; other settings were refused before.
pub(super) fn plain_filter(scene: &Scene, surface: &Surface) -> Result<PlainFilter, RenderError> {
    if scene.has(&["surface", &surface.name, "relief"]) {
        let keys: ReliefKeys = scene.read(&["surface", &surface.name, "relief"])?;
        return Ok(PlainFilter::Relief(keys.filter()));
    }
    let filter = filter(scene, surface)?;
    Ok(if filter.kind.is_of_paper_3() { PlainFilter::Texels(filter) } else { PlainFilter::Trilinear })
}

/// A surface's relief, and the side of its plane.
pub(super) fn relief(
    scene: &Scene,
    surface: &Surface,
) -> Result<Option<(ReliefKeys, Relief, f64)>, RenderError> {
    let table = ["surface", &surface.name, "relief"];
    let Geometry::Plane(plane) = surface.geometry else { return Ok(None) };
    if !scene.has(&table) {
        return Ok(None);
    }
    let keys: ReliefKeys = scene.read(&table)?;
    let at = |key| ["surface", &surface.name, "relief", key];
    let picture = keys.path.as_ref().map(|path| {
        let picture = PlainTexture::open(path);
        picture.map_err(|error| RenderError::Plain { place: scene.place(&at("path")), error })
    });
    let heights = |picture: PlainTexture| {
        (picture.size, picture.levels[0].chunks_exact(4).map(|texel| texel[0]).collect())
    };
    let relief = keys.relief(plane.width_m, picture.transpose()?.map(heights));
    let relief = relief.map_err(|what| scene.fault(&at("path"), &what))?;
    if work(&relief, keys.method) > MAX_WORK {
        let what = "building the method's map takes minutes for a relief of this size or depth; use a picture of at \
                    most 512 x 512 texels, reduce the depth, or method = \"projected-width\"";
        return Err(scene.fault(&at("depth_m"), what).into());
    }
    Ok(Some((keys, relief, plane.width_m)))
}

/// The plain texture in the table of the surface `of`; grey if `of` is `None`.
pub(super) fn plain_texture(scene: &Scene, of: Option<&str>) -> Result<PlainTexture, RenderError> {
    let Some(of) = of else { return Ok(PlainTexture::grey(ALBEDO)) };
    let plain: Plain = scene.read(&["surface", of, "texture"])?;
    let texture = match (plain.source, &plain.path) {
        (PlainSource::File, path) => PlainTexture::open(path.as_ref().expect("checked")),
        (PlainSource::Earth, _) => PlainTexture::earth(),
        (PlainSource::Checker, _) => Ok(pattern(Pattern::Checker(32), [2048, 1024])),
        (PlainSource::ZonePlate, _) => Ok(pattern(Pattern::ZonePlate, [1024; 2])),
        (PlainSource::BrickWall, _) => Ok(colours(BRICK_WALL.picture())),
        (PlainSource::Cliff, _) => Ok(colours(CLIFF.picture())),
        (PlainSource::Bricks, _) => Ok(colours(generated(ReliefKind::Bricks))),
        (PlainSource::Rock, _) => Ok(colours(generated(ReliefKind::Rock))),
    };
    let place = || scene.place(&["surface", of, "texture", "path"]);
    texture.map_err(|error| RenderError::Plain { place: place(), error })
}

/// A test pattern, repeated along the longer side.
fn pattern(pattern: Pattern, [width, height]: [u32; 2]) -> PlainTexture {
    let bytes = pattern.texels(height);
    let grey = |linear: u8| {
        let byte = srgb::from_linear_f64(f64::from(linear) / 255.0);
        [byte, byte, byte, 255]
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| y * height + x % height));
    PlainTexture::new([width, height], places.flat_map(|at| grey(bytes[at as usize])).collect())
}

/// Texels along a side of a generated relief, and its colours.
fn generated(kind: ReliefKind) -> (usize, Vec<[u8; 3]>) {
    (side_of(kind), kind.picture(side_of(kind)))
}

fn colours((side, colours): (usize, Vec<[u8; 3]>)) -> PlainTexture {
    PlainTexture::new([side as u32; 2], colours.into_iter().flat_map(|[r, g, b]| [r, g, b, 255]).collect())
}
