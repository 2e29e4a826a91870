//! Compiles `glsl/` to SPIR-V 1.5 and writes `shaders.rs`. It contains the code words and everything on which Rust and
//! GLSL must agree, so that nothing is typed twice: binding numbers, specialization ids, vertex inputs, the structs of
//! push-constant blocks. If two shaders declare a struct differently, the build fails.
//!
//! SPIR-V 1.5, not 1.6: Mesa 22.3's lavapipe crashes on helper-invocation queries in 1.6. A shader with `// variants
//! NAME: a b c` in its first lines is compiled once for each value of that macro.
//! The window's F5 runs this program again with a path as its argument. It then compiles the `glsl/` of the current
//! folder and writes the words to that path, one line per shader: `NAME<tab>INTERFACE<tab>words in hexadecimal`.

use glslang::{
    Compiler, CompilerOptions, ShaderInput, ShaderMessage, ShaderSource, SourceLanguage, SpirvVersion,
    Target, VulkanVersion,
    include::{IncludeHandler, IncludeResult, IncludeType},
};
use spirq::{ReflectConfig, prelude::*, ty::ScalarType, var::Variable};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

fn main() {
    if let Some(path) = std::env::args_os().nth(1) {
        return finish(&generated(), |generated| generated.words(), Path::new(&path));
    }
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=build.rs");
    // The commit reported by the program depends on these too.
    for path in ["src", "Cargo.toml", "Cargo.lock"] {
        println!("cargo:rerun-if-changed={path}");
    }
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]).filter(|log| Path::new(log).exists()) {
        println!("cargo:rerun-if-changed={log}");
    }
    println!("cargo:rustc-env=ORTELIUS_COMMIT={}", commit());
    let this = std::env::current_exe().unwrap_or_default();
    println!("cargo:rustc-env=ORTELIUS_SHADER_COMPILER={}", this.display());
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")).join("shaders.rs");
    finish(&generated(), |generated| generated.text(), &out);
}

/// Compiles every shader. The error has all messages.
fn generated() -> Result<Generated, String> {
    let mut generated = Generated::default();
    let mut failures = Vec::new();
    for path in shader_files(Path::new("glsl")) {
        if let Err(message) = generated.add(&path) {
            failures.push(message);
        }
    }
    if failures.is_empty() { Ok(generated) } else { Err(failures.join("\n")) }
}

/// Writes `text` of the compiled shaders to `path`, or ends the program with the messages.
fn finish(generated: &Result<Generated, String>, text: impl Fn(&Generated) -> String, path: &Path) {
    let written = generated.as_ref().map_err(String::clone).and_then(|generated| {
        std::fs::write(path, text(generated)).map_err(|error| format!("{}: {error}", path.display()))
    });
    if let Err(message) = written {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

/// The commit that is built, for the manifests of reports. "+changes" is appended if the compiled files differ from the
/// commit. In a tree without history it is "unknown".
fn commit() -> String {
    // A tarball unpacked inside another repository must not report that repository's commit.
    let ours = git(&["rev-parse", "--show-prefix"]).is_some_and(|prefix| prefix.is_empty());
    let Some(commit) = git(&["rev-parse", "HEAD"]).filter(|_| ours) else { return "unknown".to_string() };
    let compiled = ["src", "glsl", "build.rs", "Cargo.toml", "Cargo.lock"];
    let changes = git(&[&["status", "--porcelain", "--"], &compiled[..]].concat());
    if changes.is_none_or(|changes| changes.is_empty()) { commit } else { commit + "+changes" }
}

/// The output of git; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = std::process::Command::new("git").args(arguments).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
}

/// Every `STEM.STAGE` below `folder`, sorted so that the output is the same on every machine.
fn shader_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        for entry in entries {
            let path = entry.unwrap_or_else(|e| panic!("{}: {e}", folder.display())).path();
            if path.is_dir() {
                folders.push(path);
            } else if stage_of(&path).is_some() {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn stage_of(path: &Path) -> Option<glslang::ShaderStage> {
    match path.extension()?.to_str()? {
        "vert" => Some(glslang::ShaderStage::Vertex),
        "geom" => Some(glslang::ShaderStage::Geometry),
        "frag" => Some(glslang::ShaderStage::Fragment),
        "comp" => Some(glslang::ShaderStage::Compute),
        _ => None,
    }
}

/// Resolves `#include "x"` relative to `glsl/`.
struct Includes;

impl IncludeHandler for Includes {
    fn include(&mut self, _: IncludeType, header: &str, _: &str, _: usize) -> Option<IncludeResult> {
        let data = std::fs::read_to_string(Path::new("glsl").join(header)).ok()?;
        Some(IncludeResult { name: format!("glsl/{header}"), data })
    }
}

fn compile(path: &Path, define: Option<(&str, &str)>) -> Result<Vec<u32>, String> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|e| format!("{name}: {e}"))?;
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        target: Target::Vulkan { version: VulkanVersion::Vulkan1_2, spirv_version: SpirvVersion::SPIRV1_5 },
        version_profile: None,
        messages: ShaderMessage::VULKAN_RULES
            | ShaderMessage::SPV_RULES
            | ShaderMessage::DISPLAY_ERROR_COLUMN,
    };
    let source = ShaderSource::from(text);
    let defines: Vec<(&str, Option<&str>)> = define.into_iter().map(|(k, v)| (k, Some(v))).collect();
    // glslang reports errors in the main file as `ERROR: 0:line:column`.
    let readable = |e: glslang::error::GlslangError| {
        let lines = e.to_string().replace("ERROR: 0:", &format!("ERROR: {name}:"));
        define.map_or(lines.clone(), |(k, v)| format!("{lines}(with {k} = {v})"))
    };
    let mut includes = Includes;
    let stage = stage_of(path).expect("shader_files lists shaders only");
    let input =
        ShaderInput::new(&source, stage, &options, Some(&defines), Some(&mut includes)).map_err(readable)?;
    let compiler = Compiler::acquire().ok_or("glslang does not start")?;
    compiler.create_shader(input).map_err(readable)?.compile().map_err(readable)
}

/// The content of `shaders.rs`.
#[derive(Default)]
struct Generated {
    /// Module texts by folder.
    modules: BTreeMap<String, String>,
    /// Block structs by name: (text, first shader that has it).
    structs: BTreeMap<String, (String, String)>,
    /// Each module's shaders, as an expression.
    statics: Vec<String>,
    /// Name, hash of the interface, words.
    compiled: Vec<(String, u64, Vec<u32>)>,
}

impl Generated {
    fn add(&mut self, path: &Path) -> Result<(), String> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let variants =
            text.lines().take(3).find_map(|line| line.strip_prefix("// variants ")?.split_once(':'));
        let mut shaders = Vec::new();
        let mut bindings = BTreeMap::new();
        let values: Vec<Option<(&str, &str)>> = match variants {
            Some((name, values)) => values.split_whitespace().map(|v| Some((name, v))).collect(),
            None => vec![None],
        };
        for define in values {
            let words = compile(path, define)?;
            shaders.push(self.shader(path, define, &words, &mut bindings)?);
        }
        // glsl/FOLDER/STEM.STAGE becomes shader::FOLDER::STEM_STAGE.
        let mut parts = path.iter().skip(1).map(|part| part.to_str().expect("ASCII names").replace('.', "_"));
        let (Some(folder), Some(stem), None) = (parts.next(), parts.next(), parts.next()) else {
            return Err(format!("{}: shaders live in glsl/FOLDER/STEM.STAGE", path.display()));
        };
        let one = if variants.is_some() { "SHADERS" } else { "SHADER" };
        let path_of = format!("{folder}::{stem}::{one}");
        self.statics.push(match variants {
            Some(_) => format!("&{path_of}"),
            None => format!("std::slice::from_ref(&{path_of})"),
        });
        let modules = self.modules.entry(folder).or_default();
        writeln!(modules, "/// `{}`\npub mod {stem} {{\n    use super::super::*;", path.display()).unwrap();
        for (name, binding) in bindings {
            writeln!(modules, "    pub const {name}: u32 = {binding};").unwrap();
        }
        match variants {
            Some((name, values)) => writeln!(
                modules,
                "    /// One for each {name}:{values}.\n    pub static SHADERS: [Shader; {}] = [{}];\n}}",
                shaders.len(),
                shaders.join(", ")
            ),
            None => writeln!(modules, "    pub static SHADER: Shader = {};\n}}", shaders[0]),
        }
        .unwrap();
        Ok(())
    }

    /// The text of one `Shader { … }`.
    fn shader(
        &mut self,
        path: &Path,
        define: Option<(&str, &str)>,
        words: &[u32],
        bindings: &mut BTreeMap<String, u32>,
    ) -> Result<String, String> {
        let name = path.strip_prefix("glsl").unwrap_or(path).display().to_string();
        let fail = |e: &dyn std::fmt::Display| format!("{name}: reflection: {e}");
        let entry = reflect(words).map_err(|e| fail(&e))?;
        let [mut descriptors, mut resources, mut spec] = [const { Vec::new() }; 3];
        let mut inputs = Vec::new();
        let (mut push_bytes, mut block) = (0, String::new());
        for variable in &entry.vars {
            match variable {
                Variable::Descriptor { name: Some(resource), desc_bind, desc_ty, nbind, ty } => {
                    let kind =
                        descriptor_kind(desc_ty).ok_or_else(|| fail(&format!("{resource}: {desc_ty:?}")))?;
                    if desc_bind.set() != 0 || *nbind != 1 {
                        return Err(fail(&format!(
                            "{resource}: only single descriptors in set 0 are supported"
                        )));
                    }
                    bindings.insert(resource.to_uppercase(), desc_bind.bind());
                    descriptors.push(format!("({}, DescriptorKind::{kind})", desc_bind.bind()));
                    resources.push(declaration(desc_bind.bind(), desc_ty, ty));
                }
                Variable::PushConstant { ty: Type::Struct(ty), .. } => {
                    (push_bytes, block) = self.block(&name, ty)?;
                }
                Variable::SpecConstant { name: Some(constant), spec_id, .. } => {
                    spec.push(format!("({constant:?}, {spec_id})"));
                }
                Variable::Input { location, ty, .. } if name.ends_with(".vert") => {
                    inputs.push((location.loc(), vertex_format(ty).ok_or_else(|| fail(ty))?));
                }
                Variable::Input { .. } | Variable::Output { .. } => {}
                other => return Err(fail(&format!("unnamed or unknown: {other:?}"))),
            }
        }
        let group = group(&entry.exec_modes);
        if name.ends_with(".comp") && group.is_none() {
            return Err(fail(&"local_size must be given in literal numbers"));
        }
        inputs.sort();
        descriptors.sort();
        descriptors.dedup();
        let inputs = inputs.iter().map(|(at, format)| format!("({at}, VertexFormat::{format})"));
        let name = name + &define.map_or(String::new(), |(k, v)| format!(" {k}={v}"));
        let interface = format!(
            "descriptors: &[{}], push_bytes: {push_bytes}, specialization: &[{}], inputs: &[{}], group: {:?}",
            descriptors.join(", "),
            spec.join(", "),
            inputs.collect::<Vec<_>>().join(", "),
            group.unwrap_or([1; 3])
        );
        let hash = hash(&(&interface, &block, &*bindings));
        self.compiled.push((name.clone(), hash, words.to_vec()));
        let words = words.iter().map(|word| format!("{word:#x}")).collect::<Vec<_>>().join(",");
        let resources = resources.join(", ");
        Ok(format!(
            "Shader {{ name: {name:?}, spirv: &[{words}], {interface}, resources: &[{resources}], \
             interface: {hash:#x} }}"
        ))
    }

    /// Generates the struct of a push-constant block; returns its bytes and its text.
    fn block(&mut self, shader: &str, block: &spirq::ty::StructType) -> Result<(usize, String), String> {
        let name =
            block.name.clone().ok_or_else(|| format!("{shader}: a push-constant block without a name"))?;
        let (mut fields, mut asserts, mut end) = (String::new(), String::new(), 0);
        for member in &block.members {
            let field =
                member.name.as_deref().ok_or_else(|| format!("{shader}: {name}: a member without a name"))?;
            let (ty, bytes) =
                rust_type(&member.ty).ok_or_else(|| format!("{shader}: {name}.{field}: {}", member.ty))?;
            let offset = member.offset.ok_or_else(|| format!("{shader}: {name}.{field}: no offset"))?;
            writeln!(fields, "    pub {field}: {ty},").unwrap();
            writeln!(asserts, "const _: () = assert!(std::mem::offset_of!({name}, {field}) == {offset});")
                .unwrap();
            end = offset + bytes;
        }
        // Vulkan guarantees 128 bytes of push constants; lavapipe has 256.
        if end > 128 {
            return Err(format!("{shader}: block {name} has {end} bytes, more than the guaranteed 128"));
        }
        let text = format!(
            "#[repr(C)]\n#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]\n\
             pub struct {name} {{\n{fields}}}\n{asserts}const _: () = assert!(size_of::<{name}>() == {end});\n"
        );
        match self.structs.get(&name) {
            Some((other, first)) if *other != text => {
                Err(format!("{shader}: block {name} differs from the one in {first}:\n{text}\n{other}"))
            }
            _ => {
                self.structs.insert(name, (text.clone(), shader.to_string()));
                Ok((end, text))
            }
        }
    }

    /// The file that F5 reads.
    fn words(&self) -> String {
        let hex = |words: &[u32]| words.iter().map(|word| format!("{word:x}")).collect::<Vec<_>>().join(" ");
        let line = |(name, interface, words): &(String, u64, Vec<u32>)| {
            format!("{name}\t{interface:x}\t{}\n", hex(words))
        };
        self.compiled.iter().map(line).collect()
    }

    fn text(&self) -> String {
        let structs: String = self.structs.values().map(|(text, _)| text.as_str()).collect();
        let modules = self.modules.iter().map(|(folder, text)| {
            format!("/// `glsl/{folder}/`\n#[allow(unused_imports)]\npub mod {folder} {{\n{text}}}\n")
        });
        let all = self.statics.join(", ");
        format!(
            "// Generated by build.rs from glsl/.\n{structs}\n{}\n/// All of them.\npub static ALL: [&[Shader]; {}] = [{all}];\n",
            modules.collect::<String>(),
            self.statics.len()
        )
    }
}

/// Hash of everything on which Rust and a shader must agree.
fn hash(interface: &impl std::hash::Hash) -> u64 {
    let mut hasher = std::hash::DefaultHasher::new();
    interface.hash(&mut hasher);
    std::hash::Hasher::finish(&hasher)
}

/// The single entry point of a module.
fn reflect(words: &[u32]) -> Result<EntryPoint, String> {
    let entries = ReflectConfig::new()
        .spv(words)
        .ref_all_rscs(true)
        .combine_img_samplers(false)
        .gen_unique_names(false)
        .reflect();
    entries.map_err(|e| e.to_string())?.pop().ok_or_else(|| "no entry point".to_string())
}

/// A compute shader's workgroup size.
fn group(modes: &[spirq::func::ExecutionMode]) -> Option<[u32; 3]> {
    let size = modes.iter().find(|mode| mode.exec_mode == spirq::spirv::ExecutionMode::LocalSize)?;
    let side = |n: usize| match size.operands.get(n)?.value {
        spirq::constant::ConstantValue::U32(side) => Some(side),
        _ => None,
    };
    Some([side(0)?, side(1)?, side(2)?])
}

fn descriptor_kind(ty: &DescriptorType) -> Option<&'static str> {
    match ty {
        DescriptorType::CombinedImageSampler() => Some("CombinedImageSampler"),
        DescriptorType::SampledImage() => Some("SampledImage"),
        DescriptorType::StorageImage(_) => Some("StorageImage"),
        DescriptorType::StorageBuffer(_) => Some("StorageBuffer"),
        DescriptorType::UniformTexelBuffer() => Some("TexelBuffer"),
        DescriptorType::StorageTexelBuffer(..) => Some("StorageTexelBuffer"),
        _ => None,
    }
}

/// The text of a `ShaderResource`.
fn declaration(binding: u32, of: &DescriptorType, ty: &Type) -> String {
    let access = match of {
        DescriptorType::StorageImage(access)
        | DescriptorType::StorageBuffer(access)
        | DescriptorType::StorageTexelBuffer(access) => *access,
        _ => AccessType::ReadOnly,
    };
    let access = match access {
        AccessType::ReadOnly => "Read",
        AccessType::WriteOnly => "Write",
        AccessType::ReadWrite => "ReadWrite",
    };
    let elements = elements(of, ty);
    format!("ShaderResource {{ binding: {binding}, access: Access::{access}, elements: {elements:?} }}")
}

/// The name of a buffer's element type: that of the block's only array, otherwise the block's own name. Empty for an
/// image.
fn elements(of: &DescriptorType, ty: &Type) -> String {
    let element = |ty: &Type| match ty {
        Type::Struct(block) => block.name.clone().unwrap_or_default(),
        ty => rust_type(ty).map_or_else(|| ty.to_string(), |(name, _)| name),
    };
    match (of, ty) {
        (DescriptorType::StorageBuffer(_), Type::Struct(block)) => match &block.members[..] {
            [member] => match &member.ty {
                Type::Array(array) => element(&array.element_ty),
                ty => element(ty),
            },
            _ => element(ty),
        },
        (DescriptorType::UniformTexelBuffer() | DescriptorType::StorageTexelBuffer(_), _) => "u32".to_owned(),
        _ => String::new(),
    }
}

fn scalar(ty: &ScalarType) -> Option<&'static str> {
    match ty {
        ScalarType::Float { bits: 32 } => Some("f32"),
        ScalarType::Integer { bits: 32, is_signed: true } => Some("i32"),
        ScalarType::Integer { bits: 32, is_signed: false } => Some("u32"),
        _ => None,
    }
}

/// The Rust type of a member in scalar layout, and its size in bytes.
fn rust_type(ty: &Type) -> Option<(String, usize)> {
    match ty {
        Type::Scalar(s) => Some((scalar(s)?.to_string(), 4)),
        Type::Vector(v) => {
            Some((format!("[{}; {}]", scalar(&v.scalar_ty)?, v.nscalar), 4 * v.nscalar as usize))
        }
        Type::Matrix(m) => {
            let (rows, columns) = (m.vector_ty.nscalar, m.nvector);
            Some((
                format!("[[{}; {rows}]; {columns}]", scalar(&m.vector_ty.scalar_ty)?),
                4 * rows as usize * columns as usize,
            ))
        }
        _ => None,
    }
}

fn vertex_format(ty: &Type) -> Option<String> {
    let (kind, count) = match ty {
        Type::Scalar(s) => (scalar(s)?, 1),
        Type::Vector(v) => (scalar(&v.scalar_ty)?, v.nscalar),
        _ => return None,
    };
    let kind = match kind {
        "f32" => "Float",
        "u32" => "Uint",
        _ => return None,
    };
    Some(format!("{kind}{count}"))
}
