//! The window's part of `view --measure`: times and pictures of its frames.

use super::live::Live;
use super::screen::PASSES;
use egui::RawInput;

impl Live {
    /// Records the times of the frame. Prints each part of the report as soon as it is complete.
    pub(super) fn end_measured_frame(&mut self, drawn: bool) -> anyhow::Result<()> {
        let cost = std::mem::take(&mut self.cost);
        let Some(measure) = self.measure.as_mut().filter(|_| drawn) else { return Ok(()) };
        let renderer = &self.stage.renderer;
        let passes = renderer.records.last().map(|record| &record.passes);
        let ns = |label: &str| passes?.iter().find(|pass| pass.label == label)?.ns;
        let [present, panels] = PASSES.map(ns);
        let device_ns = present.zip(panels).map(|(present, panels)| [present, panels]);
        let Some(part) = measure.end(cost, renderer.gpu.waited(), device_ns) else { return Ok(()) };
        if measure.response.is_some() {
            // The times are saved before the key presses, and again with their outcome.
            measure.save(&self.stage.scene, renderer.size(), renderer.gpu.physical())?;
            (self.panels.open, self.laid_out) = (false, None);
        }
        self.print(&part)
    }

    /// The input since the last frame, and the keys that a measurement presses.
    pub(super) fn take_input(&mut self) -> RawInput {
        let mut raw = self.input.take_egui_input(&self.window);
        if let Some(response) = self.measure.as_mut().and_then(|measure| measure.response.as_mut()) {
            raw.events.extend(response.events());
            if response.is_at_rest() {
                self.panels.hide_message();
            }
        }
        raw
    }

    /// Compares the presented picture with the one before, during the last part of a measurement.
    pub(super) fn count_response(&mut self) -> anyhow::Result<()> {
        let has_jobs = self.jobs() > 0;
        let Some(response) = self.measure.as_mut().and_then(|measure| measure.response.as_mut()) else {
            return Ok(());
        };
        if let Some(buffer) = self.screen.take_read() {
            self.stage.renderer.drain()?;
            response.count_frame(&buffer.mapped(), self.stage.settled() && !has_jobs);
        }
        Ok(())
    }
}
