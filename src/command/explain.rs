//! `render --explain`: passes, device features and memory of a scene, by surface.

use super::say;
use ortelius::frame::Technique;
use ortelius::renderer::Renderer;
use ortelius::vk::Need;

/// Prints the device, the passes in order with their surfaces and features, features that belong to no listed pass, the
/// instances, and the memory by surface.
///
/// # Errors
/// Errors of stdout.
pub fn explain(renderer: &Renderer) -> anyhow::Result<()> {
    let technique = &renderer.technique;
    say(format_args!("device     {}", renderer.gpu.physical().name))?;
    let needs = technique.needs();
    let passes = technique.passes_by_surface();
    for (pass, surfaces) in &passes {
        let features = features(&needs, pass);
        let needs = if features.is_empty() { String::new() } else { format!("; needs {features}") };
        say(format_args!("pass       {pass}: {}{needs}", surfaces.join(", ")))?;
    }
    let elsewhere = needs.iter().filter(|need| !passes.iter().any(|(pass, _)| *pass == need.pass));
    for need in elsewhere {
        say(format_args!("feature    {}: pass {:?}", need.feature.name(), need.pass))?;
    }
    for surface in technique.meshes.iter().flat_map(|meshes| &meshes.surfaces) {
        say(format_args!("instances  {}", surface.of_an_instance()))?;
    }
    let surfaces: Vec<&str> = passes.iter().flat_map(|(_, surfaces)| surfaces).copied().collect();
    memory(renderer, &surfaces)
}

fn features(needs: &[Need], pass: &str) -> String {
    let names = needs.iter().filter(|need| need.pass == pass).map(|need| need.feature.name());
    names.collect::<Vec<_>>().join(", ")
}

/// Prints the memory of each surface: its sum, then lines such as `land: tile pool: 1234 bytes`.
fn memory(renderer: &Renderer, surfaces: &[&str]) -> anyhow::Result<()> {
    let memory = renderer.memory();
    let owner = |name: &str| name.split_once(": ").map(|(owner, _)| owner.to_owned());
    let mut owners: Vec<Option<String>> = memory.iter().map(|(name, _)| owner(name)).collect();
    owners.sort();
    owners.dedup();
    for of in owners {
        let own = || memory.iter().filter(|(name, _)| owner(name) == of);
        // Memory that several surfaces share has another owner, such as `levels` in `levels: staging`.
        if let Some(surface) = of.as_ref().filter(|of| surfaces.contains(&of.as_str())) {
            let in_video_memory = own().filter(|(name, _)| !name.ends_with("on the host"));
            let sum: u64 = in_video_memory.map(|(_, bytes)| bytes).sum();
            say(format_args!("memory     {surface}: {sum} bytes of video memory"))?;
        }
        own().try_for_each(|(name, bytes)| say(format_args!("memory     {name}: {bytes} bytes")))?;
    }
    Ok(())
}
