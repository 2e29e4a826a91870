//! The panels as triangles, shape by shape, so that only the pixels of changed shapes are drawn again.

use super::rectangle::Rectangle;
use egui::epaint::{ClippedShape, Mesh, Primitive, Tessellator};
use egui::{Context, CornerRadius, Pos2, Rect, Shape, TextureId};
use ortelius::vk::ClippedSlice;

/// The triangles of one shape.
#[derive(PartialEq)]
pub struct Piece {
    /// The pixels that the piece may change: those within its clip rectangle, its bounds and the window.
    covers: Rectangle,
    clip: Rectangle,
    mesh: Mesh,
}

/// A layout of the panels.
#[derive(Default)]
pub struct Pieces {
    /// In drawing order.
    list: Vec<Piece>,
    /// Disjoint rectangles, each filled by one piece with an opaque colour.
    pub opaque: Vec<Rectangle>,
}

/// Vertices, indices and draws of some pieces.
#[derive(Default)]
pub struct Redraw {
    pub vertices: Vec<Vertex>,
    pub indices: Vec<u32>,
    /// Consecutive draws with the same texture share an entry.
    pub draws: Vec<(TextureId, Vec<ClippedSlice>)>,
}

/// The vertex layout of `panels.vert`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Vertex {
    pub position: [f32; 2],
    pub place: [f32; 2],
    pub colour: [u8; 4],
}

/// Pixels of the smallest rectangle that is copied instead of blended. On lavapipe, a draw costs as much as blending
/// some thousand pixels.
const MIN_OPAQUE: u64 = 1 << 14;

impl Pieces {
    /// The triangles of egui's shapes for a window of `size` pixels.
    pub fn of(context: &Context, shapes: Vec<ClippedShape>, size: [u32; 2], pixels_per_point: f32) -> Pieces {
        let options = context.tessellation_options(|options| *options);
        let atlas = context.fonts(|fonts| fonts.font_image_size());
        // `Context::tessellate` would join shapes with the same clip rectangle. This tessellator lacks egui's prepared
        // discs, so it draws circles as polygons.
        let mut tessellator = Tessellator::new(pixels_per_point, options, atlas, Vec::new());
        let window = Rectangle { at: [0; 2], end: size };
        let mut leaves = Vec::new();
        shapes.into_iter().for_each(|ClippedShape { clip_rect, shape }| split(clip_rect, shape, &mut leaves));
        let mut pieces = Pieces::default();
        for leaf in leaves {
            let clip = pixels(leaf.clip_rect, pixels_per_point, f32::round, f32::round);
            let Some(clip) = clip.within(&window) else { continue };
            let opaque = opaque(&leaf.shape, pixels_per_point).and_then(|opaque| opaque.within(&clip));
            let is_new = |opaque: &Rectangle| !pieces.opaque.iter().any(|other| other.overlaps(opaque));
            pieces.opaque.extend(opaque.filter(|opaque| opaque.area() >= MIN_OPAQUE && is_new(opaque)));
            let mut primitives = Vec::new();
            tessellator.tessellate_clipped_shape(leaf, &mut primitives);
            for primitive in primitives {
                let Primitive::Mesh(mesh) = primitive.primitive else { continue };
                let bounds = pixels(mesh.calc_bounds(), pixels_per_point, f32::floor, f32::ceil);
                if let Some(covers) = bounds.within(&clip).filter(|_| !mesh.indices.is_empty()) {
                    pieces.list.push(Piece { covers, clip, mesh });
                }
            }
        }
        pieces
    }

    /// The pixels that each piece may change.
    pub fn covers(&self) -> impl Iterator<Item = Rectangle> {
        self.list.iter().map(|piece| piece.covers)
    }

    /// Rectangles that hold all pixels in which this layout may differ from `last`. Elsewhere, both layouts draw the
    /// same pieces in the same order.
    pub fn changed_since(&self, last: &Pieces) -> Vec<Rectangle> {
        let (mut changed, mut rest) = (Vec::new(), &last.list[..]);
        for piece in &self.list {
            match rest.iter().position(|other| other == piece) {
                Some(skipped) => {
                    changed.extend(rest[..skipped].iter().map(|other| other.covers));
                    rest = &rest[skipped + 1..];
                }
                None => changed.push(piece.covers),
            }
        }
        changed.extend(rest.iter().map(|other| other.covers));
        changed
    }

    /// The draws of all pieces within disjoint `areas`.
    pub fn redraw(&self, areas: &[Rectangle]) -> Redraw {
        let mut redraw = Redraw::default();
        let mut bases: Vec<Option<u32>> = vec![None; self.list.len()];
        for area in areas {
            for (piece, base) in self.list.iter().zip(&mut bases) {
                if let Some(clip) = piece.clip.within(area).filter(|_| piece.covers.overlaps(area)) {
                    let base = *base.get_or_insert_with(|| redraw.add_vertices(&piece.mesh));
                    redraw.add_draw(&piece.mesh, base, &clip);
                }
            }
        }
        redraw
    }
}

impl Redraw {
    fn add_vertices(&mut self, mesh: &Mesh) -> u32 {
        let base = self.vertices.len() as u32;
        self.vertices.extend(mesh.vertices.iter().map(|vertex| Vertex {
            position: vertex.pos.into(),
            place: vertex.uv.into(),
            colour: vertex.color.to_array(),
        }));
        base
    }

    fn add_draw(&mut self, mesh: &Mesh, base: u32, clip: &Rectangle) {
        let slice = ClippedSlice {
            at: clip.at,
            size: clip.size(),
            first_index: self.indices.len() as u32,
            count: mesh.indices.len() as u32,
        };
        self.indices.extend(mesh.indices.iter().map(|index| base + index));
        match self.draws.last_mut() {
            Some((texture, slices)) if *texture == mesh.texture_id => match slices.last_mut() {
                Some(last) if (last.at, last.size) == (slice.at, slice.size) => last.count += slice.count,
                _ => slices.push(slice),
            },
            _ => self.draws.push((mesh.texture_id, vec![slice])),
        }
    }
}

/// Adds the shape. A list of shapes is split into its members.
fn split(clip_rect: Rect, shape: Shape, into: &mut Vec<ClippedShape>) {
    match shape {
        Shape::Vec(shapes) => shapes.into_iter().for_each(|shape| split(clip_rect, shape, into)),
        shape => into.push(ClippedShape { clip_rect, shape }),
    }
}

/// The rectangle in pixels, within the first quadrant.
fn pixels(
    points: Rect,
    pixels_per_point: f32,
    at: impl Fn(f32) -> f32,
    end: impl Fn(f32) -> f32,
) -> Rectangle {
    let corner = |corner: Pos2, whole: &dyn Fn(f32) -> f32| {
        [corner.x, corner.y].map(|points| whole(points * pixels_per_point).max(0.0) as u32)
    };
    Rectangle { at: corner(points.min, &at), end: corner(points.max, &end) }
}

/// The pixels that a shape fills with an opaque colour. egui smooths an edge over half a pixel on both sides, so the
/// centre of a pixel that lies within the edges has the full colour.
fn opaque(shape: &Shape, pixels_per_point: f32) -> Option<Rectangle> {
    let Shape::Rect(shape) = shape else { return None };
    let is_plain = shape.corner_radius == CornerRadius::ZERO
        && (shape.blur_width, shape.angle) == (0.0, 0.0)
        && shape.brush.is_none();
    (is_plain && shape.fill.is_opaque()).then(|| pixels(shape.rect, pixels_per_point, f32::ceil, f32::floor))
}
