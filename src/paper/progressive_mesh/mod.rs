//! Paper 2: progressive meshes in vertex-cache order.
//!
//! "A continuous level-of-detail algorithm that accounts for the architecture of modern video accelerators"
//! (Novosibirsk, mid-2000s). A mesh M0 and n vertex splits (vsplit) give every level of detail up to Mn; the live
//! vertices and faces are always prefixes of two buffers. Plain view-independent progressive meshes append faces in
//! the order of their importance, so neighbours in the buffer share few vertices and the post-transform cache is
//! wasted. The paper adds cyclic permutations of faces (tswap) between groups of splits, which keep the buffer's
//! order good for that cache at every level.
//!
//! | the paper's word | meaning | file |
//! |---|---|---|
//! | M0, Mn | the coarsest mesh; the full mesh, after n splits | [`mesh`] |
//! | V, F | vertex buffer; index buffer | [`mesh`] |
//! | ecol | edge collapse: removes one vertex and the faces at the edge | [`simplify`] |
//! | vsplit | vertex split, the inverse of ecol: adds a vertex and up to two faces, rewrites corners | [`run`] |
//! | tswap | a cyclic permutation of faces in the index buffer; inverted for ecol | [`order`], [`run`] |
//! | group | the splits between two sets of tswaps | [`order`] |
//! | transforms per vertex | vertex cache misses per vertex (FIFO of 16 entries unless stated) | [`cache`] |
//!
//! Each step is one file or folder. [`simplify`] finds the collapses, and [`order`] arranges the faces and finds the
//! tswaps. The result is a [`mesh`]. [`check`] validates the mesh. [`run`] changes its level on the CPU, and [`apply`]
//! changes its level on the GPU. [`cache`] counts what an order costs; [`baselines`] has other methods to draw a mesh
//! at every level. [`reference`](mod@reference) rebuilds a level from scratch. [`file`](mod@file) is the storage
//! format, and [`encoded`] encodes a file while its mesh is still being ordered. [`load`](mod@load) builds the meshes
//! of a scene, and [`keep`] keeps the built meshes for the next run. [`stand`], [`ground`] and [`place`] position the
//! instances of a mesh. A [`surface`] draws many instances, [`technique`] is the paper's part of a frame, and the
//! [`governor`] keeps the frame's time budget. [`faces`] exposes the faces of a frame, and [`misses`] counts the cache
//! misses of these faces.

pub mod apply;
pub mod baselines;
pub mod cache;
pub mod check;
pub mod choices;
pub mod config;
pub mod encoded;
pub mod faces;
pub mod figures;
pub mod file;
pub mod governor;
pub mod ground;
pub mod keep;
pub mod load;
pub mod mesh;
pub mod misses;
pub mod order;
pub mod place;
mod record;
pub mod reference;
pub mod run;
pub mod simplify;
pub mod stand;
pub mod surface;
pub mod technique;

pub use config::ProgressiveMeshSettings;
pub use keep::ordered;
pub use load::{LoadError, LoadedMesh, Textured, load};
pub use record::MeshFrameRecord;
pub use surface::{FrameChanges, MeshOnDevice, SurfaceError, SurfaceMemory};
pub use technique::ProgressiveMeshes;
