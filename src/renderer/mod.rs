//! A scene becomes passes: which paper's frames a scene asks for, and the report of them.
//!
//! Today every scene is paper 1's, and the work is its [`Session`]; what a scene with meshes or relief adds will be
//! derived here.

pub mod report;

pub use crate::paper::virtual_texture::session::{
    FootprintPicture, FrameRecord, PlainComparison, Session as Renderer, SessionError as RenderError,
    Settings, Target, needs, read_words,
};
