//! Pipelines made from generated shaders. Layouts come from reflection, variants from specialization
//! constants.

use super::device::{Dead, Device};
use super::graphics_info::{Blend, Depth, GraphicsInfo, vertex_attributes};
use super::shader::{Access, DescriptorKind, Replaced, Shader, ShaderResource};
use super::{Check, Format, Gpu, Result};
use ash::vk;
use std::sync::{Arc, MutexGuard};

pub(crate) struct PipelineHandles {
    pub(crate) handle: vk::Pipeline,
    pub(crate) layout: vk::PipelineLayout,
    pub(crate) set_layout: vk::DescriptorSetLayout,
    pub(crate) descriptors: Vec<(u32, DescriptorKind)>,
    /// One for each binding, with the accesses of all stages together.
    pub(super) resources: Vec<ShaderResource>,
    pub(super) writes_depth: bool,
    pub(crate) push_bytes: u32,
    pub(crate) push_stages: vk::ShaderStageFlags,
    pub(crate) name: String,
    device: Arc<Device>,
}

pub struct GraphicsPipeline(pub(crate) Arc<PipelineHandles>);
pub struct ComputePipeline(pub(crate) Arc<PipelineHandles>);

/// Maximum number of unused pipelines that are kept. Some are kept because a window resizes its picture and returns to
/// earlier variants.
const MAX_UNUSED: usize = 64;

/// The pipelines of a device. A request for a known description compiles nothing: lavapipe keeps some memory for each
/// compilation until the program ends.
#[derive(Default)]
pub(crate) struct Pipelines {
    /// In the order of their last requests.
    known: Vec<(Description, Arc<PipelineHandles>)>,
    compiled: u64,
    /// Number of times that shaders were replaced.
    replacements: u64,
}

/// Everything on which a pipeline depends.
#[derive(PartialEq)]
struct Description {
    name: String,
    shaders: Vec<&'static str>,
    specialization: Vec<(String, u32)>,
    /// `None` for a compute pipeline.
    draw: Option<(bool, Option<Depth>, Vec<Format>, Blend)>,
}

impl Description {
    fn new(name: &str, stages: &Stages<'_>, specialization: &[(&str, u32)]) -> Description {
        Description {
            name: name.to_owned(),
            shaders: stages.iter().map(|(_, shader)| shader.name).collect(),
            specialization: specialization.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
            draw: None,
        }
    }
}

impl Pipelines {
    fn find(&mut self, description: &Description) -> Option<Arc<PipelineHandles>> {
        let at = self.known.iter().position(|(known, _)| known == description)?;
        self.known[at..].rotate_left(1);
        self.known.last().map(|(_, base)| base.clone())
    }

    /// Adds a pipeline. Drops unused ones beyond [`MAX_UNUSED`], the least recently requested first.
    fn add(&mut self, description: Description, base: Arc<PipelineHandles>) {
        self.compiled += 1;
        let is_unused = |(_, base): &(_, Arc<PipelineHandles>)| Arc::strong_count(base) == 1;
        let mut surplus =
            self.known.iter().filter(|known| is_unused(known)).count().saturating_sub(MAX_UNUSED);
        self.known.retain(|known| {
            let drops = surplus > 0 && is_unused(known);
            surplus -= usize::from(drops);
            !drops
        });
        self.known.push((description, base));
    }
}

type Stages<'a> = [(vk::ShaderStageFlags, &'a Shader)];

impl PipelineHandles {
    /// Builds the layouts from the shaders' reflection.
    fn new(gpu: &Gpu, name: &str, stages: &Stages<'_>) -> Result<PipelineHandles> {
        let device = &gpu.device;
        let mut descriptors: Vec<(u32, DescriptorKind)> = Vec::new();
        for (_, shader) in stages {
            for &(binding, kind) in shader.descriptors {
                match descriptors.iter().find(|(b, _)| *b == binding) {
                    Some((_, other)) => {
                        assert_eq!(*other, kind, "{name}: binding {binding} in {}", shader.name)
                    }
                    None => descriptors.push((binding, kind)),
                }
            }
        }
        let group = stages.last().map_or([1; 3], |(_, shader)| shader.group);
        gpu.require_pipeline(name, group, &descriptors)?;
        let all = stages.iter().fold(vk::ShaderStageFlags::empty(), |all, (stage, _)| all | *stage);
        let bindings: Vec<_> = descriptors
            .iter()
            .map(|&(binding, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind.vk())
                    .descriptor_count(1)
                    .stage_flags(all)
            })
            .collect();
        let push_bytes = stages.iter().map(|(_, shader)| shader.push_bytes).max().unwrap_or(0);
        let pushers = stages.iter().filter(|(_, shader)| shader.push_bytes > 0);
        let push_stages = pushers.fold(vk::ShaderStageFlags::empty(), |all, (stage, _)| all | *stage);
        let ranges = [vk::PushConstantRange { stage_flags: push_stages, offset: 0, size: push_bytes }];
        let set_info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: the device lives.
        let set_layout = unsafe { device.handle.create_descriptor_set_layout(&set_info, None) }
            .check("vkCreateDescriptorSetLayout", name)?;
        let mut handles = PipelineHandles {
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout,
            descriptors,
            resources: resources(stages),
            writes_depth: false,
            push_bytes,
            push_stages,
            name: name.to_string(),
            device: device.clone(),
        };
        let set_layouts = [set_layout];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(if push_bytes > 0 { &ranges } else { &[] });
        // SAFETY: as above.
        handles.layout = unsafe { device.handle.create_pipeline_layout(&info, None) }
            .check("vkCreatePipelineLayout", name)?;
        device.name(set_layout, name);
        device.name(handles.layout, name);
        Ok(handles)
    }
}

/// What the stages declare, one for each binding.
fn resources(stages: &Stages<'_>) -> Vec<ShaderResource> {
    let mut found: Vec<ShaderResource> = Vec::new();
    for resource in stages.iter().flat_map(|(_, shader)| shader.resources) {
        match found.iter_mut().find(|known| known.binding == resource.binding) {
            Some(known) => known.access = known.access.and(resource.access),
            None => found.push(*resource),
        }
    }
    found
}

impl PipelineHandles {
    /// What the shaders declare of a binding.
    pub(super) fn declared(&self, binding: u32) -> (Access, &'static str) {
        let declared = self.resources.iter().find(|resource| resource.binding == binding);
        declared.map_or((Access::ReadWrite, ""), |resource| (resource.access, resource.elements))
    }
}

impl Drop for PipelineHandles {
    fn drop(&mut self) {
        self.device.bury(Dead::Pipeline(self.handle, self.layout, self.set_layout));
    }
}

/// A shader module with its specialization, alive while a pipeline is created.
struct Module<'a> {
    handle: vk::ShaderModule,
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u32>,
    stage: vk::ShaderStageFlags,
    device: &'a Device,
}

impl<'a> Module<'a> {
    fn new(
        device: &'a Device,
        stage: vk::ShaderStageFlags,
        shader: &Shader,
        specialization: &[(&str, u32)],
    ) -> Result<Self> {
        let replaced = device.replaced.lock().expect("no panic while words are moved");
        let words = replaced.get(shader.name).map_or(shader.spirv, Vec::as_slice);
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: the words are glslang's.
        let handle = unsafe { device.handle.create_shader_module(&info, None) }
            .check("vkCreateShaderModule", shader.name)?;
        device.name(handle, shader.name);
        let used = shader.specialization.iter().filter_map(|(name, id)| {
            let (_, value) = specialization.iter().find(|(given, _)| given == name)?;
            Some((*id, *value))
        });
        let (ids, data): (Vec<u32>, Vec<u32>) = used.unzip();
        let entries = ids
            .into_iter()
            .enumerate()
            .map(|(n, constant_id)| vk::SpecializationMapEntry { constant_id, offset: 4 * n as u32, size: 4 })
            .collect();
        Ok(Module { handle, entries, data, stage, device })
    }

    fn specialization(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(bytemuck::cast_slice(&self.data))
    }

    fn stage<'m>(
        &'m self,
        specialization: &'m vk::SpecializationInfo<'m>,
    ) -> vk::PipelineShaderStageCreateInfo<'m> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(self.stage)
            .module(self.handle)
            .name(c"main")
            .specialization_info(specialization)
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: a module is needed only while pipelines are created from it.
        unsafe { self.device.handle.destroy_shader_module(self.handle, None) };
    }
}

fn assert_names_exist(name: &str, stages: &Stages<'_>, specialization: &[(&str, u32)]) {
    for (constant, _) in specialization {
        let known = stages.iter().any(|(_, shader)| shader.specialization.iter().any(|(n, _)| n == constant));
        assert!(known, "{name}: no shader has a constant {constant}");
    }
}

impl Gpu {
    fn pipelines(&self) -> MutexGuard<'_, Pipelines> {
        self.pipelines.lock().expect("no panic while pipelines are moved")
    }

    /// The number of pipelines that were compiled.
    pub fn compiled_pipelines(&self) -> u64 {
        self.pipelines().compiled
    }

    /// The pipeline of this description; `compile` compiles it if it is new, and again if another thread replaces
    /// shaders meanwhile.
    fn pipeline(
        &self,
        description: Description,
        compile: impl Fn() -> Result<PipelineHandles>,
    ) -> Result<Arc<PipelineHandles>> {
        let mut pipelines = self.pipelines();
        loop {
            if let Some(known) = pipelines.find(&description) {
                return Ok(known);
            }
            let before = pipelines.replacements;
            drop(pipelines);
            let base = Arc::new(compile()?);
            pipelines = self.pipelines();
            if pipelines.replacements == before {
                pipelines.add(description, base.clone());
                return Ok(base);
            }
        }
    }

    /// Replaces the SPIR-V of shaders in pipelines that are created later. Returns the previous replacements.
    /// The words must come from this build's own compiler, for shaders of the same interface.
    pub fn replace_shaders(&self, words: Replaced) -> Replaced {
        let mut replaced = self.device.replaced.lock().expect("no panic while words are moved");
        let before = std::mem::replace(&mut *replaced, words);
        let mut pipelines = self.pipelines();
        pipelines.known.clear();
        pipelines.replacements += 1;
        before
    }

    /// # Errors
    /// The workgroup or the number of buffers exceeds the device's limit, or the driver fails to compile the shader.
    pub fn compute_pipeline(
        &self,
        name: &str,
        shader: &'static Shader,
        specialization: &[(&str, u32)],
    ) -> Result<ComputePipeline> {
        let stages = [(vk::ShaderStageFlags::COMPUTE, shader)];
        assert_names_exist(name, &stages, specialization);
        let description = Description::new(name, &stages, specialization);
        let compile = || {
            let mut base = PipelineHandles::new(self, name, &stages)?;
            let module = Module::new(&self.device, stages[0].0, shader, specialization)?;
            let constants = module.specialization();
            let info =
                vk::ComputePipelineCreateInfo::default().stage(module.stage(&constants)).layout(base.layout);
            let cache = vk::PipelineCache::null();
            // SAFETY: module and layout live.
            base.handle = unsafe { self.device.handle.create_compute_pipelines(cache, &[info], None) }
                .map_err(|(_, result)| result)
                .check("vkCreateComputePipelines", name)?[0];
            self.device.name(base.handle, name);
            Ok(base)
        };
        self.pipeline(description, compile).map(ComputePipeline)
    }

    /// # Errors
    /// The number of buffers exceeds the device's limit, or the driver fails to compile a shader.
    pub fn graphics_pipeline(&self, info: &GraphicsInfo<'_>) -> Result<GraphicsPipeline> {
        let mut stages = vec![(vk::ShaderStageFlags::VERTEX, info.vertex)];
        stages.extend(info.geometry.map(|shader| (vk::ShaderStageFlags::GEOMETRY, shader)));
        stages.extend(info.fragment.map(|shader| (vk::ShaderStageFlags::FRAGMENT, shader)));
        assert_names_exist(info.name, &stages, info.specialization);
        let description = Description {
            draw: Some((info.points, info.depth, info.colors.to_vec(), info.blend)),
            ..Description::new(info.name, &stages, info.specialization)
        };
        let compile = || {
            let mut base = PipelineHandles::new(self, info.name, &stages)?;
            let modules: Vec<_> = stages
                .iter()
                .map(|(stage, shader)| Module::new(&self.device, *stage, shader, info.specialization))
                .collect::<Result<_>>()?;
            let constants: Vec<_> = modules.iter().map(Module::specialization).collect();
            let stages: Vec<_> = modules.iter().zip(&constants).map(|(module, c)| module.stage(c)).collect();
            base.handle = self.create_graphics(info, &base, &stages)?;
            base.writes_depth = info.depth == Some(Depth::Write);
            self.device.name(base.handle, info.name);
            Ok(base)
        };
        self.pipeline(description, compile).map(GraphicsPipeline)
    }

    fn create_graphics(
        &self,
        info: &GraphicsInfo<'_>,
        base: &PipelineHandles,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    ) -> Result<vk::Pipeline> {
        let (attributes, stride) = vertex_attributes(info.vertex);
        let binding = [vk::VertexInputBindingDescription { binding: 0, stride, ..Default::default() }];
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_attribute_descriptions(&attributes)
            .vertex_binding_descriptions(if stride > 0 { &binding } else { &[] });
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(match info.points {
            true => vk::PrimitiveTopology::POINT_LIST,
            false => vk::PrimitiveTopology::TRIANGLE_LIST,
        });
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let attachments = info.attachments();
        let blend = vk::PipelineColorBlendStateCreateInfo::default()
            .attachments(&attachments)
            .logic_op_enable(info.blend == Blend::LogicOr)
            .logic_op(vk::LogicOp::OR);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let formats: Vec<_> = info.colors.iter().map(|format| format.vk()).collect();
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&formats)
            .depth_attachment_format(info.depth_format());
        let (raster, depth) = (info.raster(), info.depth_test());
        let create = vk::GraphicsPipelineCreateInfo::default()
            .stages(stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(base.layout)
            .push_next(&mut rendering);
        // SAFETY: every pointer lives on this stack frame.
        let pipelines = unsafe {
            self.device.handle.create_graphics_pipelines(vk::PipelineCache::null(), &[create], None)
        };
        Ok(pipelines.map_err(|(_, result)| result).check("vkCreateGraphicsPipelines", info.name)?[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::GpuOptions;
    use crate::vk::shader::self_test::dispatch_comp::SHADER;
    use std::cell::Cell;

    #[test]
    fn a_pipeline_is_compiled_again_if_shaders_are_replaced_meanwhile() {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap();
        let stages = [(vk::ShaderStageFlags::COMPUTE, &SHADER)];
        let compilations = Cell::new(0);
        let pipeline = |replaced_during: u32| {
            let compile = || {
                compilations.set(compilations.get() + 1);
                if compilations.get() <= replaced_during {
                    gpu.replace_shaders(Replaced::new());
                }
                PipelineHandles::new(&gpu, "raced", &stages)
            };
            gpu.pipeline(Description::new("raced", &stages, &[]), compile).unwrap()
        };
        let last = pipeline(2);
        assert_eq!((compilations.get(), gpu.compiled_pipelines()), (3, 1));
        // The cache holds the pipeline of the last compilation.
        assert!(Arc::ptr_eq(&last, &pipeline(0)));
        assert_eq!(compilations.get(), 3);
    }
}
