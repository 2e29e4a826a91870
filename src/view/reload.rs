//! F5: recompiles the shaders with the build's compiler while frames continue.

use anyhow::{Context, anyhow, bail};
use ortelius::vk::shader::{ALL, Replaced, Shader};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

/// Path of this build's shader compiler, which is its build script.
const COMPILER: &str = env!("ORTELIUS_SHADER_COMPILER");

/// The running compilation, if any.
#[derive(Default)]
pub struct Reload(Option<Receiver<anyhow::Result<Replaced>>>);

impl Reload {
    /// Starts compiling `glsl/` of the folder `ORTELIUS_SOURCES`; without that variable, of this build's
    /// sources.
    ///
    /// # Errors
    /// The sources are missing (an installed program has none), or the compiler is missing (the
    /// build folder was removed).
    pub fn start(&mut self) -> anyhow::Result<()> {
        if self.is_under_way() {
            return Ok(());
        }
        let sources = std::env::var_os("ORTELIUS_SOURCES").map(PathBuf::from);
        let sources = sources.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")));
        if !sources.join("glsl").is_dir() {
            bail!(
                "F5 compiles {}, which does not exist; set ORTELIUS_SOURCES to a folder that contains glsl/",
                sources.join("glsl").display()
            );
        }
        if !Path::new(COMPILER).is_file() {
            bail!(
                "F5 runs the build's shader compiler {COMPILER}, which does not exist; rebuild the program"
            );
        }
        let (sender, receiver) = channel();
        std::thread::Builder::new().name("shader compiler".to_owned()).spawn(move || {
            // Sending fails if the window is already closed.
            let _closed = sender.send(compile(&sources));
        })?;
        self.0 = Some(receiver);
        Ok(())
    }

    pub fn is_under_way(&self) -> bool {
        self.0.is_some()
    }

    /// The result of a finished compilation, returned once: the shaders whose SPIR-V differs from the built
    /// ones.
    pub fn poll(&mut self) -> Option<anyhow::Result<Replaced>> {
        let result = match self.0.as_ref()?.try_recv() {
            Err(TryRecvError::Empty) => return None,
            Ok(result) => result,
            Err(TryRecvError::Disconnected) => Err(anyhow!("the shader compiler's thread panicked")),
        };
        self.0 = None;
        Some(result)
    }
}

fn compile(sources: &Path) -> anyhow::Result<Replaced> {
    let output =
        tempfile::NamedTempFile::new().context("cannot create a temporary file for the shader compiler")?;
    let ran = Command::new(COMPILER).arg(output.path()).current_dir(sources).output().context(COMPILER)?;
    if !ran.status.success() {
        let words = String::from_utf8_lossy(&ran.stderr);
        // Omits glslang's headings and empty lines.
        let errors: Vec<&str> = words.lines().filter(|line| line.starts_with("ERROR: glsl")).collect();
        bail!("{}", if errors.is_empty() { words.trim().to_owned() } else { errors.join("\n") });
    }
    let text = std::fs::read_to_string(output.path()).context("cannot read the shader compiler's output")?;
    let mut replaced = Replaced::new();
    for line in text.lines() {
        let (shader, words) = parse(line)?;
        if words != shader.spirv {
            replaced.insert(shader.name.to_owned(), words);
        }
    }
    Ok(replaced)
}

/// Parses a line of the compiler's output: the shader that it replaces, and the new SPIR-V words.
fn parse(line: &str) -> anyhow::Result<(&'static Shader, Vec<u32>)> {
    let mut parts = line.split('\t');
    let (Some(name), Some(interface), Some(words)) = (parts.next(), parts.next(), parts.next()) else {
        bail!("the shader compiler wrote {line:?}");
    };
    let built = ALL.iter().copied().flatten().find(|shader| shader.name == name);
    let built = built.with_context(|| format!("{name} is new; rebuild the program"))?;
    if u64::from_str_radix(interface, 16)? != built.interface {
        bail!("{name}: its bindings, constants or inputs have changed; rebuild the program");
    }
    let words = words.split(' ').map(|word| u32::from_str_radix(word, 16)).collect::<Result<_, _>>()?;
    Ok((built, words))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shader_of_another_interface_is_refused() {
        let built = ALL[0][0].name;
        let line = |interface: u64| format!("{built}\t{interface:x}\t7230203 1");
        assert_eq!(parse(&line(ALL[0][0].interface)).unwrap().1, [0x0723_0203, 1]);
        let refused = parse(&line(ALL[0][0].interface ^ 1)).err().unwrap().to_string();
        assert!(refused.contains(built) && refused.contains("rebuild the program"), "{refused}");
        assert!(parse("view/none.frag\t0\t1").err().unwrap().to_string().contains("is new"));
    }
}
