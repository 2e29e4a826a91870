//! Messages of the validation layer and the driver, kept so that a test can fail on them.

use ash::vk;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    Warning,
    Error,
}

/// One message: the layer's identifier and its text.
#[derive(Clone, Debug)]
pub struct Message {
    pub severity: Severity,
    pub id: String,
    pub text: String,
}

/// Accepted warnings, which do not fail a test: (part of the text, reason). Errors are never accepted.
const ACCEPTED: &[(&str, &str)] = &[
    (
        "Decoration not allowed on struct members: SpvDecorationInvariant",
        "from Mesa 22.3's SPIR-V reader, not the layer; the decoration is legal on gl_PerVertex's members and works",
    ),
    // The layer's warning for an image in GENERAL where another layout is faster.
    (
        "For optimal performance",
        "advice: colour images stay in GENERAL, which rules out missing layout transitions",
    ),
];

/// The messages that the debug messenger has received.
#[derive(Default)]
pub(crate) struct Messages(Mutex<Vec<Message>>);

impl Messages {
    pub(crate) fn all(&self) -> Vec<Message> {
        self.0.lock().expect("no panic while a message is stored").clone()
    }

    fn push(&self, message: Message) {
        // The loader reports skipped drivers, and failures that our own errors describe better.
        let from_loader = message.id.contains("Loader Message");
        let accepted = message.severity == Severity::Warning
            && (from_loader || ACCEPTED.iter().any(|(part, _)| message.text.contains(part)));
        match message.severity {
            _ if accepted || from_loader => {
                tracing::debug!(target: "vulkan", "{}: {}", message.id, message.text)
            }
            Severity::Warning => tracing::warn!(target: "vulkan", "{}: {}", message.id, message.text),
            Severity::Error => tracing::error!(target: "vulkan", "{}: {}", message.id, message.text),
        }
        if !accepted {
            self.0.lock().expect("no panic while a message is stored").push(message);
        }
    }
}

/// The messenger's settings; `messages` must outlive the instance.
pub(crate) fn messenger_info(messages: &Arc<Messages>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
        )
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(messages).cast_mut().cast())
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the loader passes a valid `data`; `user` is the Messages that the Instance keeps alive.
    let (messages, data) = unsafe { (&*user.cast::<Messages>(), &*data) };
    // SAFETY: Vulkan's strings are null-terminated and live for the call.
    let text = |p: *const std::ffi::c_char| match p.is_null() {
        true => String::new(),
        false => unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned(),
    };
    messages.push(Message {
        severity: match severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
            true => Severity::Error,
            false => Severity::Warning,
        },
        id: text(data.p_message_id_name),
        text: text(data.p_message),
    });
    vk::FALSE
}
