//! The resources of a pass, recorded from what its commands bind, copy and draw into.

use super::shader::Access;
use super::{Buffer, Image};
use ash::vk::Handle;
use std::collections::HashMap;

/// A buffer or an image that a pass uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Used {
    /// The name that it was created with.
    pub name: String,
    pub bytes: u64,
    /// Size and format of an image; a buffer's elements as a shader declares them, otherwise what the buffer is for.
    pub content: String,
    /// For a resource of a shader, the access that the shader declares.
    pub access: Access,
}

/// A pass with its resources, in the order of their first use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassResources {
    pub label: String,
    pub resources: Vec<Used>,
}

/// The list of a pass that is being recorded. Each resource is listed once.
#[derive(Default)]
pub(super) struct Listing {
    resources: Vec<Used>,
    /// Index in `resources` by handle.
    known: HashMap<u64, usize>,
    /// The depth image of the following draws: they test depth, and may write it.
    depth: Option<u64>,
}

impl Listing {
    /// `elements` is the shader's declaration, empty if no shader accesses the buffer here.
    pub fn buffer(&mut self, buffer: &Buffer, access: Access, elements: &str) {
        let used = self.entry(buffer.raw(), access, || Used {
            name: buffer.name().to_owned(),
            bytes: buffer.bytes(),
            content: buffer.usage().about().to_owned(),
            access,
        });
        if !elements.is_empty() {
            elements.clone_into(&mut used.content);
        }
    }

    pub fn image(&mut self, image: &Image, access: Access) {
        self.entry(image.handle.as_raw(), access, || {
            let info = image.info();
            let [width, height] = info.size;
            let layers = if info.layers > 1 { format!(" x {}", info.layers) } else { String::new() };
            let levels =
                if info.mip_levels > 1 { format!(", {} levels", info.mip_levels) } else { String::new() };
            Used {
                name: image.name().to_owned(),
                bytes: image.bytes(),
                content: format!("{width} x {height}{layers}{levels}, {:?}", info.format),
                access,
            }
        });
    }

    /// The depth image of the following draws. Without `clear`, they read what earlier passes wrote.
    pub fn depth(&mut self, image: &Image, clear: bool) {
        self.image(image, if clear { Access::Write } else { Access::Read });
        self.depth = Some(image.handle.as_raw());
    }

    /// A draw writes depth.
    pub fn writes_depth(&mut self) {
        if let Some(at) = self.depth.and_then(|depth| self.known.get(&depth)) {
            let used = &mut self.resources[*at];
            used.access = used.access.and(Access::Write);
        }
    }

    fn entry(&mut self, handle: u64, access: Access, new: impl FnOnce() -> Used) -> &mut Used {
        let at = *self.known.entry(handle).or_insert(self.resources.len());
        if at == self.resources.len() {
            self.resources.push(new());
        }
        let used = &mut self.resources[at];
        used.access = used.access.and(access);
        used
    }

    pub fn into_pass(self, label: &str) -> PassResources {
        PassResources { label: label.to_owned(), resources: self.resources }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::shader::self_test::{dispatch_comp, triangle_frag, triangle_vert};
    use crate::vk::{
        BufferUse, Clear, ColorTarget, Depth, DepthTarget, Format, GpuOptions, GraphicsInfo, ImageInfo,
        Resource, Watched,
    };

    #[test]
    fn a_pass_lists_what_it_binds_copies_and_draws_into_once() {
        let gpu = Watched::open(&GpuOptions::default());
        let dispatch = gpu.compute_pipeline("dispatch", &dispatch_comp::SHADER, &[]).unwrap();
        let draw = |depth| {
            let info = GraphicsInfo {
                colors: &[Format::R32Uint],
                depth: Some(depth),
                ..GraphicsInfo::triangles(&triangle_vert::SHADER, &triangle_frag::SHADER)
            };
            gpu.graphics_pipeline(&info).unwrap()
        };
        let draws = [Depth::Write, Depth::Equal].map(draw);
        let words = gpu.buffer("words", 1024, BufferUse::Storage).unwrap();
        let host = gpu.buffer("host", 1024, BufferUse::Readback).unwrap();
        let picture = gpu.image("picture", ImageInfo::target([16, 16], Format::R32Uint)).unwrap();
        let depth = gpu.image("depth", ImageInfo::target([16, 16], Format::Depth32Float)).unwrap();
        let record = || {
            let mut frame = gpu.frame().unwrap();
            let dispatched = frame.pass("words", |cmd| {
                cmd.fill(&words, 1024, 0);
                cmd.sync();
                cmd.dispatch(&dispatch, &[(dispatch_comp::WORDS, Resource::Buffer(&words))], &[], [4, 1, 1])
            });
            dispatched.unwrap();
            let copied = frame.pass("copy", |cmd| cmd.copy_buffer(&words, 0, &host, 0, 1024));
            copied.unwrap();
            for (label, first, draw) in [("first", true, &draws[0]), ("second", false, &draws[1])] {
                let clear = if first { Clear::Uint([0; 4]) } else { Clear::Keep };
                let target = ColorTarget { image: &picture, clear };
                let depth = Some(DepthTarget { image: &depth, clear: first });
                let drawn = frame.pass(label, |cmd| {
                    cmd.render([16, 16], &[target], depth, |render| render.draw(draw, &[], &[], 3))
                });
                drawn.unwrap();
            }
            let found = frame.resources().to_vec();
            frame.submit().unwrap().wait().unwrap();
            found
        };
        assert_eq!(record(), [], "nothing is listed by default");
        gpu.list_resources(true);
        let used = |name: &str, content: &str, access| Used {
            name: name.to_owned(),
            bytes: 1024,
            content: content.to_owned(),
            access,
        };
        let image = |name, format: &str, access| used(name, &format!("16 x 16, {format}"), access);
        let pass = |label: &str, resources| PassResources { label: label.to_owned(), resources };
        let (read, write, both) = (Access::Read, Access::Write, Access::ReadWrite);
        let expected = [
            pass("words", vec![used("words", "u32", both)]),
            pass("copy", vec![used("words", "storage", read), used("host", "read-back", write)]),
            pass("first", vec![image("picture", "R32Uint", write), image("depth", "Depth32Float", write)]),
            pass("second", vec![image("picture", "R32Uint", both), image("depth", "Depth32Float", read)]),
        ];
        assert_eq!(record(), expected);
    }
}
