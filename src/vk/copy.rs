//! The copies and fills of a pass. All ranges are checked before they are recorded.

use super::command::Cmd;
use super::shader::Access;
use super::{Buffer, Image, TargetPart, TexelCopy};
use ash::vk;

impl Cmd<'_> {
    pub fn copy_buffer(&mut self, from: &Buffer, from_at: u64, to: &Buffer, to_at: u64, bytes: u64) {
        self.copy_ranges(from, to, &[[from_at, to_at, bytes]]);
    }

    /// As [`Cmd::copy_buffer`], several ranges in one command: (offset in `from`, offset in `to`, bytes).
    pub fn copy_ranges(&mut self, from: &Buffer, to: &Buffer, ranges: &[[u64; 3]]) {
        if ranges.is_empty() {
            return;
        }
        let region = |&[src_offset, dst_offset, size]: &[u64; 3]| {
            let (room, name) = (from.bytes(), from.name());
            assert!(src_offset + size <= room, "{name}: {src_offset} + {size} of {room}");
            let (room, name) = (to.bytes(), to.name());
            assert!(dst_offset + size <= room, "{name}: {dst_offset} + {size} of {room}");
            vk::BufferCopy { src_offset, dst_offset, size }
        };
        let regions: Vec<_> = ranges.iter().map(region).collect();
        self.work.copied_bytes += regions.iter().map(|region| region.size).sum::<u64>();
        self.list_buffer(from, Access::Read, "");
        self.list_buffer(to, Access::Write, "");
        let [from, to] = [from, to].map(|buffer| buffer.for_frame(self.mapped));
        // SAFETY: the ranges were checked.
        unsafe { self.device.handle.cmd_copy_buffer(self.handle, from, to, &regions) };
    }

    pub fn copy_to_image(&mut self, from: &Buffer, to: &Image, copies: &[TexelCopy]) {
        if copies.is_empty() {
            return;
        }
        let regions: Vec<_> = copies.iter().map(|copy| region(to, from, copy)).collect();
        self.work.copied_bytes += texel_bytes(to, copies);
        self.list_buffer(from, Access::Read, "");
        self.list_image(to, Access::Write);
        let from = from.for_frame(self.mapped);
        // SAFETY: `region` checked the ranges; the image is in GENERAL.
        unsafe {
            self.device.handle.cmd_copy_buffer_to_image(
                self.handle,
                from,
                to.handle,
                vk::ImageLayout::GENERAL,
                &regions,
            );
        }
    }

    pub fn copy_from_image(&mut self, from: &Image, to: &Buffer, copies: &[TexelCopy]) {
        let regions: Vec<_> = copies.iter().map(|copy| region(from, to, copy)).collect();
        self.work.copied_bytes += texel_bytes(from, copies);
        self.list_image(from, Access::Read);
        self.list_buffer(to, Access::Write, "");
        let to = to.for_frame(self.mapped);
        let layout = match from.layout() {
            vk::ImageLayout::GENERAL => vk::ImageLayout::GENERAL,
            _ => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        };
        self.transition(from, from.layout(), layout);
        // SAFETY: `region` checked the ranges; the image is in this layout.
        unsafe {
            self.device.handle.cmd_copy_image_to_buffer(self.handle, from.handle, layout, to, &regions);
        }
        self.transition(from, layout, from.layout());
    }

    /// Copies parts of an image to the same place in another one of the same format.
    pub fn copy_image(&mut self, from: &Image, to: &Image, parts: &[TargetPart]) {
        if parts.is_empty() {
            return;
        }
        let format = from.info().format;
        assert_eq!(format, to.info().format, "{} to {}", from.name(), to.name());
        let regions: Vec<_> = parts.iter().map(|part| image_region(from, to, part)).collect();
        self.work.copied_bytes += parts.iter().map(|(_, size)| format.bytes(*size)).sum::<u64>();
        self.list_image(from, Access::Read);
        self.list_image(to, Access::Write);
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: `image_region` checked the ranges; both images are in GENERAL.
        unsafe {
            self.device.handle.cmd_copy_image(self.handle, from.handle, layout, to.handle, layout, &regions);
        }
    }

    /// Sets the first `bytes` of a buffer, a whole number of words, to one value.
    pub fn fill(&mut self, buffer: &Buffer, bytes: u64, value: u32) {
        assert!(
            bytes <= buffer.bytes() && bytes.is_multiple_of(4),
            "{}: {bytes} of {}",
            buffer.name(),
            buffer.bytes()
        );
        self.work.copied_bytes += bytes;
        self.list_buffer(buffer, Access::Write, "");
        let buffer = buffer.for_frame(self.mapped);
        // SAFETY: the range was checked.
        unsafe { self.device.handle.cmd_fill_buffer(self.handle, buffer, 0, bytes, value) };
    }

    /// Sets every level and layer of an integer image to one value.
    pub fn clear_uint(&mut self, image: &Image, value: u32) {
        let value = vk::ClearColorValue { uint32: [value; 4] };
        self.list_image(image, Access::Write);
        // SAFETY: the image is in GENERAL.
        unsafe {
            self.device.handle.cmd_clear_color_image(
                self.handle,
                image.handle,
                vk::ImageLayout::GENERAL,
                &value,
                &[image.whole()],
            );
        }
    }
}

fn texel_bytes(image: &Image, copies: &[TexelCopy]) -> u64 {
    copies.iter().map(|copy| image.info().format.bytes(copy.size)).sum()
}

fn image_region(from: &Image, to: &Image, (at, size): &TargetPart) -> vk::ImageCopy {
    for image in [from, to] {
        let fits = (0..2).all(|axis| at[axis] + size[axis] <= image.info().size[axis]);
        assert!(fits, "{}: {size:?} at {at:?} of {:?}", image.name(), image.info().size);
    }
    let layers =
        vk::ImageSubresourceLayers::default().aspect_mask(from.info().format.aspect()).layer_count(1);
    let offset = vk::Offset3D { x: at[0] as i32, y: at[1] as i32, z: 0 };
    vk::ImageCopy {
        src_subresource: layers,
        src_offset: offset,
        dst_subresource: layers,
        dst_offset: offset,
        extent: vk::Extent3D { width: size[0], height: size[1], depth: 1 },
    }
}

fn region(image: &Image, buffer: &Buffer, copy: &TexelCopy) -> vk::BufferImageCopy {
    let side = image.mip_size(copy.mip);
    assert!(
        copy.at[0] + copy.size[0] <= side[0] && copy.at[1] + copy.size[1] <= side[1],
        "{}: {copy:?} exceeds {side:?}",
        image.name()
    );
    let end = copy.offset + image.info().format.bytes(copy.size);
    assert!(end <= buffer.bytes(), "{}: {copy:?} ends at {end} of {}", buffer.name(), buffer.bytes());
    vk::BufferImageCopy {
        buffer_offset: copy.offset,
        buffer_row_length: 0,
        buffer_image_height: 0,
        image_subresource: vk::ImageSubresourceLayers {
            aspect_mask: image.info().format.aspect(),
            mip_level: copy.mip,
            base_array_layer: copy.layer,
            layer_count: 1,
        },
        image_offset: vk::Offset3D { x: copy.at[0] as i32, y: copy.at[1] as i32, z: 0 },
        image_extent: vk::Extent3D { width: copy.size[0], height: copy.size[1], depth: 1 },
    }
}
