//! Every scene with every variant. A case's name defines it completely: `earth/dedup=runs,address=own-level`.

/// A scene with changed settings, and the views that are rendered in this order.
#[derive(Clone, Debug)]
pub struct Case {
    pub scene: &'static str,
    pub paper: Paper,
    /// `key=value`, as in a scene, without the name of the section. The cases of paper 1 have `max_anisotropy=1` unless
    /// they state another number.
    pub changes: Vec<String>,
    pub views: &'static [View],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    VirtualTexture,
    ProgressiveMesh,
    /// All surfaces of the scene as shipped.
    Shipped,
}

/// A camera, or a frame of a path.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// The camera rests until all tiles have arrived.
    Camera(&'static str),
    /// One frame of a path, without waiting for tiles.
    Path(&'static str, u32),
}

impl Case {
    /// `earth/headline/dedup=runs,address=own-level`; `shipped` for the shipped scene. If nothing is changed, `paper`
    /// for paper 2 and `max_anisotropy=1` for paper 1.
    pub fn name(&self, view: &View) -> String {
        let changes = match (self.paper, self.changes.is_empty()) {
            (Paper::Shipped, _) => "shipped".to_owned(),
            (Paper::VirtualTexture, true) => "max_anisotropy=1".to_owned(),
            (_, true) => "paper".to_owned(),
            (_, false) => self.changes.join(","),
        };
        match view {
            View::Camera(camera) => format!("{}/{camera}/{changes}", self.scene),
            View::Path(path, frame) => format!("{}/{path}@{frame}/{changes}", self.scene),
        }
    }

    /// True if the device's list has the same order in every run.
    pub fn ordered(&self) -> bool {
        self.changes.iter().any(|change| change == "compact=ordered" || change.starts_with("list=host-"))
    }
}

fn changes(text: &str) -> Vec<String> {
    text.split(',').filter(|change| !change.is_empty()).map(str::to_owned).collect()
}

/// The scenes of paper 1, the default camera first.
const TEXTURED: [(&str, &[View]); 6] = [
    ("antimeridian", &[View::Camera("nadir"), View::Camera("oblique")]),
    ("earth", &[View::Camera("headline"), View::Camera("oblique")]),
    ("globe", &[View::Camera("africa"), View::Camera("pacific")]),
    ("plane", &[View::Camera("tilted"), View::Camera("grazing")]),
    ("pole", &[View::Camera("above"), View::Camera("oblique")]),
    ("ruler", &[View::Camera("corner"), View::Camera("corner-oblique")]),
];

/// Scenes that run every variant.
const WITH_ALL: [&str; 2] = ["earth", "ruler"];

/// The variants of stage 2 that fill the tile mask in a pass. They fit every stage 3 except fused-append.
const DEDUP_TO_MASK: [&str; 8] =
    ["geometry", "points", "atomic-or", "test-or", "subgroup-unique", "shared-hash", "tile-memo", "runs"];
const COMPACT: [&str; 5] = ["transform-feedback", "append", "subgroup", "workgroup", "ordered"];
const ADDRESS: [&str; 2] = ["level-0", "own-level"];

/// The valid pairs of stages 2 and 3.
fn staged() -> Vec<String> {
    let mut found = Vec::new();
    for address in ADDRESS {
        let mut add = |dedup: &str, compact: &str| {
            found.push(format!("dedup={dedup},compact={compact},address={address}"));
        };
        for dedup in DEDUP_TO_MASK {
            COMPACT.into_iter().for_each(|compact| add(dedup, compact));
        }
        // Transform feedback reads the tile mask as an image, which these variants do not fill. `bitset` has one bit
        // per tile, and level-0 tile addresses need several.
        for compact in COMPACT.into_iter().filter(|&compact| compact != "transform-feedback") {
            add("mark-bytes", compact);
            add("fused", compact);
            add("fused-exact", compact);
            if address == "own-level" {
                add("bitset", compact);
            }
        }
        add("fused", "fused-append");
        add("fused-exact", "fused-append");
    }
    found
}

/// The variants other than those of stages 2 and 3.
const OTHERS: [&str; 16] = [
    "",
    "list=host-hash",
    "list=host-bitmap",
    "list=feedback,feedback_log2=2",
    "filter=bilinear",
    "filter=stochastic,samples=2",
    "max_anisotropy=4",
    "max_anisotropy=16",
    "max_anisotropy=16,dedup=fused-exact,compact=fused-append",
    "max_anisotropy=4,filter=stochastic,samples=4",
    "interpolation=literal",
    "request_format=rgba32",
    "request_format=packed",
    "request_draw=texturing,dedup=runs,compact=append,address=own-level",
    "block_log2=0,memo=false",
    "level_bias=1",
];

/// The variants of scenes that do not run every variant.
const FEW: [&str; 6] = [
    "",
    "max_anisotropy=16",
    "dedup=runs,compact=ordered,address=own-level",
    "dedup=fused-exact,compact=fused-append",
    "list=host-bitmap",
    "filter=stochastic,samples=2",
];

/// Paths on which tiles arrive while the camera moves.
const MOVING: [(&str, &[View]); 3] = [
    ("earth", &[View::Path("pan", 0), View::Path("pan", 4), View::Path("pan", 5), View::Path("pan", 6)]),
    (
        "plane",
        &[View::Path("dive", 0), View::Path("dive", 20), View::Path("dive", 21), View::Path("dive", 22)],
    ),
    ("pole", &[View::Path("crossing", 0), View::Path("crossing", 1), View::Path("crossing", 2)]),
];
const STREAMED: [&str; 4] = [
    "upload_tiles_per_frame=2",
    "fade_in_frames=3",
    "prefetch_frames=4",
    "fade_in_frames=3,prefetch_frames=4",
];

/// Paper 1.
pub fn virtual_texture() -> Vec<Case> {
    let case = |scene, changes, views| Case { scene, paper: Paper::VirtualTexture, changes, views };
    let mut cases = Vec::new();
    for (scene, views) in TEXTURED {
        let all = WITH_ALL.contains(&scene);
        let staged = if all { staged() } else { Vec::new() };
        let others = if all { OTHERS.as_slice() } else { FEW.as_slice() };
        let of_scene = staged.iter().map(String::as_str).chain(others.iter().copied());
        cases.extend(of_scene.map(|text| case(scene, changes(text), views)));
    }
    for (scene, views) in MOVING {
        cases.extend(STREAMED.map(|text| case(scene, changes(text), views)));
    }
    cases
}

/// Scenes whose own filter is not paper 1's.
const SHIPPED: [(&str, &[View]); 10] = [
    ("earth", &[View::Camera("headline"), View::Camera("oblique")]),
    ("globe", &[View::Camera("africa"), View::Camera("antarctica")]),
    ("plane", &[View::Camera("tilted"), View::Camera("grazing")]),
    ("plane-tilt", &[View::Camera("tilted"), View::Camera("grazing")]),
    ("relief-brick", &[View::Camera("low"), View::Camera("above")]),
    ("relief-rock", &[View::Camera("low"), View::Camera("above")]),
    ("sphere", &[View::Camera("whole"), View::Camera("pole")]),
    ("tunnel", &[View::Camera("inside"), View::Camera("wall")]),
    ("valley", &[View::Camera("herd"), View::Camera("massif")]),
    ("zone-plate", &[View::Camera("tilted"), View::Camera("facing")]),
];

/// Scenes as `ortelius render` shows them.
pub fn shipped() -> Vec<Case> {
    let case = |(scene, views)| Case { scene, paper: Paper::Shipped, changes: Vec::new(), views };
    SHIPPED.map(case).into()
}

/// The scenes of paper 2. Their views raise and lower levels, and an instance leaves the picture.
const SURFACES: [(&str, &[View]); 2] = [
    ("bunny", &[View::Camera("near"), View::Camera("far"), View::Path("rise", 0), View::Path("rise", 60)]),
    (
        "herd",
        &[View::Path("walk", 0), View::Path("walk", 80), View::Path("walk", 160), View::Camera("aloft")],
    ),
];
/// Orders of the paper's kind, whose splits the device can execute.
const ORDERS: [&str; 6] = ["classical", "paper", "tail-23", "tail-10", "in-place-23", "in-place-10"];
const BASELINES: [&str; 6] =
    ["random", "re-optimised", "re-optimised-fifo", "re-optimised-rings", "compacted", "skip-lists"];

/// Paper 2. The cases of an order are consecutive, so that the order is made once.
pub fn progressive_mesh() -> Vec<Case> {
    let mut cases = Vec::new();
    let mut add = |order: &str, rest: &str| {
        let changes = changes(&format!("order={order},{rest}"));
        // Each takes 7 s on two cores, so the herd geomorphs in one order only; the bunny in all.
        let slow = rest.ends_with("geomorph=true") && order != "tail-23";
        let case =
            |(scene, views)| Case { scene, paper: Paper::ProgressiveMesh, changes: changes.clone(), views };
        cases.extend(SURFACES.into_iter().filter(|(scene, _)| !slow || *scene != "herd").map(case));
    };
    for order in ORDERS {
        for apply in ["cpu", "gpu"] {
            add(order, &format!("apply={apply},geomorph=false"));
            add(order, &format!("apply={apply},geomorph=true"));
        }
    }
    for order in BASELINES {
        add(order, "geomorph=false");
        add(order, "geomorph=true");
    }
    // A discrete chain has no splits, so nothing can be geomorphed.
    add("discrete", "geomorph=false");
    cases
}
