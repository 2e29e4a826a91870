//! Shared by the filter figures: a pattern in video memory, its truth, and a method's picture and time.

use crate::figure::{Bench, Contender, Errors, Row, Timed};
use crate::paper::texture_mapping::agreement::{Agreement, compare};
use crate::paper::texture_mapping::baselines::FilterBaseline;
use crate::paper::texture_mapping::method::{Coordinates, EllipseFilter, Method, PixelCentre};
use crate::paper::texture_mapping::object_space::pass::{ObjectSpaceBuffers, Stages};
use crate::paper::texture_mapping::object_space::reference::Mean;
use crate::paper::texture_mapping::object_space::{MAX_PER_PIXEL, TexturedPolygons, reference};
use crate::paper::texture_mapping::pass::{Dumped, FilterPass, Targets, Uploaded, push};
use crate::paper::texture_mapping::plane::{Tilt, TiltedPlane};
use crate::paper::texture_mapping::reference as filters;
use crate::paper::texture_mapping::texels::GreyMipmap;
use crate::picture::Picture;
use crate::picture::error::compare_where;
use crate::picture::flip::flip;
use crate::reference::pattern::Pattern;
use crate::reference::supersample::{Density, PixelKernel, Tiled, Truth, supersample};
use crate::stats::mean;
use crate::vk::{Gpu, PassTime};
use rayon::prelude::*;
use std::cell::RefCell;

/// Texels along a pattern's side.
pub const SIDE: u32 = 512;

/// The EWA filter's kernel (Heckbert 1989): sigma 0.5 pixels, cut at one pixel. The truth of the comparisons uses it.
pub const GAUSSIAN: PixelKernel = PixelKernel::Gaussian { sigma: 0.5, radius: 1.0 };

/// The kernel of formula (4): `exp(-3.125 r^2)`.
pub const FORMULA_4: PixelKernel = PixelKernel::Gaussian { sigma: 0.4, radius: 1.0 };

// Quantities of several figures.
pub const NMSE: &str = "NMSE";
pub const FLIP: &str = "FLIP";
pub const TIME: &str = "time per pixel";
pub const TEXELS: &str = "texels fetched per pixel";

/// The variant under which the truth's own errors are reported.
pub const FLOOR: &str = "the truth's own error";

/// A pattern on a device, and the targets for pictures of this pattern.
pub struct Lab {
    pub gpu: Gpu,
    pub size: [u32; 2],
    /// Object-space texturing: distance from the eye to the projection plane.
    pub camera_px: f64,
    /// Object-space texturing: a plane is cut off where a pixel would receive more fragments than this.
    pub max_per_pixel: f64,
    texels: GreyMipmap,
    tiled: Tiled,
    uploaded: Uploaded,
    targets: Targets,
}

/// The passes of a method.
pub enum LabPass {
    Filter(Box<FilterPass>),
    /// The polygons of each plane, prepared once and kept for the next pictures.
    ObjectSpace {
        stages: Stages,
        spacing: f32,
        prepared: RefCell<Vec<(TiltedPlane, ObjectSpaceBuffers)>>,
    },
}

/// A picture and its cost.
pub struct LabPicture {
    pub picture: Picture,
    /// Texels fetched per pixel, on average.
    pub fetched: f64,
}

/// Why a method is not measured on this device.
pub const NO_GPU_SAMPLER: &str =
    "a software device, whose sampler is an EWA filter: see `software driver's EWA`";

impl Lab {
    /// # Errors
    /// Out of memory, device lost.
    pub fn new(gpu: &Gpu, pattern: Pattern, size: [u32; 2]) -> anyhow::Result<Lab> {
        Lab::of_texels(gpu, (&pattern.name(), pattern.texels(SIDE)), size)
    }

    /// As [`Lab::new`], for a name and [`SIDE`] x [`SIDE`] texels, one byte of linear light each.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn of_texels(gpu: &Gpu, (name, texels): (&str, Vec<u8>), size: [u32; 2]) -> anyhow::Result<Lab> {
        let texels = GreyMipmap::new(SIDE, texels);
        Ok(Lab {
            uploaded: Uploaded::new(gpu, name, &texels)?,
            targets: Targets::new(gpu, size, false)?,
            tiled: Tiled::new(SIDE, &texels.levels[0]),
            gpu: gpu.clone(),
            size,
            camera_px: Tilt::of(0.0).focal_px(size[1]),
            max_per_pixel: MAX_PER_PIXEL,
            texels,
        })
    }

    pub fn pass(&self, method: &Method) -> anyhow::Result<LabPass> {
        Ok(match *method {
            Method::ObjectSpace(spacing) => LabPass::ObjectSpace {
                stages: Stages::new(&self.gpu, false)?,
                spacing,
                prepared: RefCell::default(),
            },
            _ => {
                let pass = FilterPass::new(&self.gpu, method, self.texels.coarsest(), false)?;
                LabPass::Filter(Box::new(pass))
            }
        })
    }

    /// A pass of an ellipse filter that computes coordinates by the given method. The pass draws only pictures of
    /// `plane`.
    ///
    /// # Errors
    /// Out of memory.
    pub fn pass_by(
        &self,
        ellipse: &EllipseFilter,
        coordinates: Coordinates,
        plane: &TiltedPlane,
    ) -> anyhow::Result<LabPass> {
        let of = (plane, self.size);
        let pass = FilterPass::by(&self.gpu, ellipse, self.texels.coarsest(), coordinates, of, false)?;
        Ok(LabPass::Filter(Box::new(pass)))
    }

    fn polygons(&self, plane: &TiltedPlane, spacing: f32) -> TexturedPolygons {
        TexturedPolygons::of_plane(plane, self.size, self.camera_px, spacing.into(), self.max_per_pixel)
    }

    /// The f64 reference of object-space texturing.
    pub fn fragments(&self, plane: &TiltedPlane, spacing: f32) -> Vec<Mean> {
        reference::picture(&self.polygons(plane, spacing), spacing.into(), self.size, &self.texels)
    }

    /// The f64 reference of a filter: a value for each pixel of a picture of `size`, which shows the plane.
    pub fn reference(&self, ellipse: &EllipseFilter, plane: &TiltedPlane, size: [u32; 2]) -> Vec<f64> {
        let method = Method::Ellipse(*ellipse);
        let value = |n: u32| {
            let at = [n % size[0], n / size[0]].map(|place| f64::from(place) + 0.5);
            let [x, y] = [0, 1].map(|axis| at[axis] - f64::from(size[axis]) / 2.0);
            let Some(centre) = plane.texels(x, y) else { return 0.0 };
            let jacobian @ [u, v] = plane.jacobian(x, y);
            let determinant = u[0] * v[1] - u[1] * v[0];
            let pixel = PixelCentre { place: [0, 0], centre, jacobian, determinant };
            let [level, _] = filters::levels(&method, &pixel, &self.texels);
            filters::filtered(&method, &pixel, &self.texels, level, 0).map_or(0.0, |texel| texel.value)
        };
        (0..size[0] * size[1]).into_par_iter().map(value).collect()
    }

    /// The f64 truth of a plane.
    pub fn truth(&self, plane: &TiltedPlane, kernel: PixelKernel) -> Truth {
        self.supersampled(plane, kernel, Density::FINE)
    }

    /// As [`Lab::truth`], with fewer samples per pixel: where footprints are unbounded, `truth` takes too long.
    pub fn coarse_truth(&self, plane: &TiltedPlane, kernel: PixelKernel) -> Truth {
        self.supersampled(plane, kernel, Density { per_texel: 1.0, min: 32, max: 96 })
    }

    pub fn supersampled(&self, plane: &TiltedPlane, kernel: PixelKernel, density: Density) -> Truth {
        let [middle_x, middle_y] = self.size.map(|side| f64::from(side) / 2.0);
        let surface = |x: f64, y: f64| plane.texels(x - middle_x, y - middle_y);
        supersample(self.size, surface, |at| self.tiled.at(at), kernel, density)
    }

    /// What the method computed and chose for every pixel.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn dumped(&self, method: &Method, plane: &TiltedPlane) -> anyhow::Result<Vec<Dumped>> {
        let pass = FilterPass::new(&self.gpu, method, self.texels.coarsest(), true)?;
        let targets = Targets::new(&self.gpu, self.size, true)?;
        pass.run(&self.gpu, &self.uploaded, &targets, &push(plane, self.size, 0))?;
        Ok(targets.dumped(&self.gpu)?)
    }

    /// Compares a method's pixels with the reference. `plane` must be rounded to f32, as shaders receive it ([`TiltedPlane::rounded`]).
    pub fn agreement(&self, dumped: &[Dumped], method: &Method, plane: &TiltedPlane) -> Agreement {
        compare(dumped, method, plane, self.size, &self.texels, 0)
    }

    /// # Errors
    /// Device lost, out of memory.
    pub fn show(&self, pass: &LabPass, plane: &TiltedPlane, frame: u32) -> anyhow::Result<LabPicture> {
        self.run(pass, plane, frame)?;
        let mut rgba = self.targets.colours(&self.gpu)?;
        let fetched = mean(rgba.iter().map(|pixel| f64::from(pixel[3])));
        rgba.iter_mut().for_each(|pixel| pixel[3] = 1.0);
        Ok(LabPicture { picture: Picture::new(self.size[0], self.size[1], rgba), fetched })
    }

    /// The mean of the pictures of several frames. Each frame has its own random numbers, and shows the plane that
    /// `plane` returns for it. `fetched` counts the texels of the first frame.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn accumulated(
        &self,
        pass: &LabPass,
        frames: u32,
        plane: impl Fn(u32) -> TiltedPlane,
    ) -> anyhow::Result<LabPicture> {
        let mut sum = self.show(pass, &plane(0), 0)?;
        for frame in 1..frames {
            let next = self.show(pass, &plane(frame), frame)?.picture.rgba;
            let channels = sum.picture.rgba.iter_mut().flatten();
            channels.zip(next.iter().flatten()).for_each(|(sum, next)| *sum += next);
        }
        sum.picture.rgba.iter_mut().flatten().for_each(|channel| *channel /= frames as f32);
        Ok(sum)
    }

    fn run(&self, pass: &LabPass, plane: &TiltedPlane, frame: u32) -> crate::vk::Result<Vec<PassTime>> {
        let Lab { gpu, uploaded, targets, size, .. } = self;
        match pass {
            LabPass::Filter(pass) => pass.run(gpu, uploaded, targets, &push(plane, *size, frame)),
            LabPass::ObjectSpace { stages, spacing, prepared } => {
                let mut prepared = prepared.borrow_mut();
                if !prepared.iter().any(|(of, _)| of == plane) {
                    let polygons = self.polygons(plane, *spacing);
                    let own =
                        ObjectSpaceBuffers::new(gpu, &polygons, *spacing, *size, self.texels.coarsest())?;
                    prepared.push((*plane, own));
                }
                let (_, of) = prepared.iter().find(|(of, _)| of == plane).expect("prepared");
                stages.run(gpu, of, uploaded, targets)
            }
        }
    }

    /// A laboratory for times. On a GPU its pictures are larger than `size`, because a pass over a small picture takes a
    /// GPU no longer than an empty pass.
    ///
    /// # Errors
    /// Out of memory, device lost.
    pub fn timed(gpu: &Gpu, pattern: Pattern, size: [u32; 2]) -> anyhow::Result<Lab> {
        let scale = if gpu.physical().is_software() { 1 } else { 8 };
        Lab::new(gpu, pattern, size.map(|side| scale * side))
    }

    /// Interleaved times of all methods. A run of a method draws every plane once.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn times(
        &self,
        bench: &Bench,
        methods: &[(String, Method)],
        planes: &[TiltedPlane],
    ) -> anyhow::Result<Vec<Timed>> {
        let passes: Vec<(String, LabPass)> = methods
            .iter()
            .map(|(name, method)| Ok((name.clone(), self.pass(method)?)))
            .collect::<anyhow::Result<_>>()?;
        self.times_of(bench, &passes, planes)
    }

    /// The rows of [`Lab::times`].
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn time_rows(
        &self,
        bench: &Bench,
        methods: &[(String, Method)],
        planes: &[TiltedPlane],
    ) -> anyhow::Result<Vec<Row>> {
        let timed = self.times(bench, methods, planes)?;
        Ok(timed.iter().map(|timed| self.time_row(timed, planes.len())).collect())
    }

    /// As [`Lab::times`], for existing passes.
    ///
    /// # Errors
    /// Device lost, out of memory.
    pub fn times_of(
        &self,
        bench: &Bench,
        passes: &[(String, LabPass)],
        planes: &[TiltedPlane],
    ) -> anyhow::Result<Vec<Timed>> {
        let contenders = passes.iter().map(|(name, pass)| {
            Contender::new(&**name, move || {
                let runs = planes.iter().map(|plane| self.run(pass, plane, 0));
                Ok(runs.collect::<crate::vk::Result<Vec<_>>>()?.concat())
            })
        });
        bench.interleave(&self.gpu, contenders.collect())
    }

    /// The row [`TIME`] of a timed method, in nanoseconds per pixel.
    pub fn time_row(&self, timed: &Timed, planes: usize) -> Row {
        let pixels = f64::from(self.size[0] * self.size[1]);
        let drawn = if timed.variant == "empty pass" { pixels } else { pixels * planes as f64 };
        let rounds = timed.total_of_rounds();
        let ns_a_pixel = |rounds: Vec<f64>| rounds.iter().map(|ms| ms * 1e6 / drawn).collect();
        Row { work: timed.total_work(), ..Row::of_rounds(&timed.variant, TIME, "ns", rounds.map(ns_a_pixel)) }
    }
}

/// Why the device cannot run a method under this name; `None` if it can.
pub fn excused(gpu: &Gpu, name: &str, method: &Method) -> Option<&'static str> {
    let software = gpu.physical().is_software();
    match method {
        Method::Baseline(FilterBaseline::Hardware(_)) if name.starts_with(SOFTWARE_SAMPLER) != software => {
            Some(if software { NO_GPU_SAMPLER } else { "not a software device" })
        }
        _ => None,
    }
}

/// Lavapipe's anisotropic sampler scans an ellipse, unlike a GPU's sampler, so this sampler has a separate name.
pub const SOFTWARE_SAMPLER: &str = "software driver's EWA";

/// Errors of a picture against a truth. All except FLIP cover only pixels whose kernel lies wholly on the surface.
pub fn errors(picture: &Picture, truth: &Truth) -> anyhow::Result<Errors> {
    let exact = grey(truth.size, &truth.values);
    let width = truth.size[0];
    let difference = compare_where(picture, &exact, |x, y| truth.whole[(y * width + x) as usize])?;
    Ok(Errors { nmse: difference.nmse(), flip: flip(picture, &exact)?.mean(), max: difference.largest() })
}

/// The truth's own errors: those of one half of its samples against all of them. This difference is the one that
/// [`Truth::own_nmse`] takes as the error of the mean.
pub fn own_errors(truth: &Truth) -> anyhow::Result<Errors> {
    errors(&grey(truth.size, &truth.of_one_half), truth)
}

/// A picture of grey values.
pub fn grey([width, height]: [u32; 2], values: &[f64]) -> Picture {
    let pixel = |&value: &f64| [value as f32, value as f32, value as f32, 1.0];
    Picture::new(width, height, values.iter().map(pixel).collect())
}
