//! Facts about each setting: its effect, its unit, and its range or choices.

/// A setting.
pub struct Field {
    /// Table and name, as in the file.
    pub key: &'static str,
    /// Unit; empty where there is none.
    pub unit: &'static str,
    /// Smallest and largest value.
    pub range: Option<[f64; 2]>,
    /// The words that it may be.
    pub choices: &'static [&'static str],
    /// Its effect.
    pub about: &'static str,
}

/// A number with a unit in a range.
const fn number(key: &'static str, unit: &'static str, range: [f64; 2], about: &'static str) -> Field {
    Field { key, unit, range: Some(range), choices: &[], about }
}

/// One of some words.
const fn choice(key: &'static str, choices: &'static [&'static str], about: &'static str) -> Field {
    Field { key, unit: "", range: None, choices, about }
}

/// Yes or no, or what is set by other means.
const fn switch(key: &'static str, about: &'static str) -> Field {
    Field { key, unit: "", range: None, choices: &[], about }
}

/// Every setting, in the order of the file.
pub const FIELDS: &[Field] = &[
    number(
        "fusion.voxel_size",
        "metres",
        [0.0005, 0.05],
        "Edge of a voxel. Smaller resolves more and costs its inverse square.",
    ),
    number(
        "fusion.truncation",
        "metres",
        [0.001, 1.0],
        "Truncation distance of the signed distance field; at least two voxels.",
    ),
    choice(
        "fusion.volume",
        &["auto", "all"],
        "The surfaces that are fused: the person who turns, or everything that was seen.",
    ),
    choice(
        "fusion.prior",
        &["turntable", "none"],
        "The assumption about the motion: a turn about a resting axis, or nothing.",
    ),
    switch("fusion.poses", "Known poses instead of tracking; set by `toile fuse --poses`."),
    number(
        "fusion.jump_slope",
        "pixel widths",
        [1.0, 100.0],
        "A pixel is an edge, and is dropped, where its depth differs from a neighbour's by more.",
    ),
    number("fusion.max_depth", "metres", [0.1, 100.0], "Depth beyond this is not used."),
    number(
        "fusion.closing_rounds",
        "rounds",
        [0.0, 100.0],
        "Joint optimisation of all poses over frame pairs after tracking.",
    ),
    number(
        "fusion.refine_rounds",
        "rounds",
        [0.0, 100.0],
        "Rounds that fuse, and then register every frame to the whole model, after closing.",
    ),
    number(
        "fusion.target_triangles",
        "triangles",
        [0.0, 10000000.0],
        "Triangles of the finished scan, about; 0 keeps all.",
    ),
    switch("fusion.fill_holes", "Close all holes, and mark them in the attribute `filled`; a room is never closed."),
    number("fusion.smoothing_passes", "passes", [0.0, 100.0], "Smoothing that does not shrink."),
    number(
        "fusion.known_height",
        "metres",
        [0.0, 3.0],
        "Height of the subject's highest point over what it stands on, as it stands there; the scan is scaled to it. 0: not known.",
    ),
    number(
        "texture.size",
        "texels",
        [0.0, 8192.0],
        "Largest edge of a texture: 1024, 2048, 4096 or 8192; 0 makes none. Pictures that show less get a smaller one.",
    ),
    number(
        "texture.padding",
        "texels",
        [1.0, 64.0],
        "Empty texels around each chart at a size of 4096, for filtering and mip levels; in proportion at others.",
    ),
    number("texture.blended", "pictures", [1.0, 16.0], "At most this many pictures are blended at a place."),
    number(
        "texture.photos",
        "pictures",
        [1.0, 10000.0],
        "At most this many pictures of a take are used, evenly spread.",
    ),
    switch("texture.even_light", "Take the light of the room out, so that the surface's own colours are left."),
    choice(
        "fit.method",
        &["toile", "seed"],
        "Whose way the fit goes: robust and coarse to fine, or eq. 4 as the seed prints it.",
    ),
    number(
        "fit.components",
        "components",
        [1.0, 1000.0],
        "Shape components used; the model has a limit of its own (the seed used 15).",
    ),
    choice(
        "fit.joints",
        &["affine", "mean-value"],
        "How joints follow the shape: affinely, or by mean value coordinates as in the seed.",
    ),
    switch("fit.dressed", "The person wears clothes: the shape is estimated from a scan that stands off."),
    switch("fit.landmarks", "Landmarks set by hand; set in SUBJECT/edits/body.json."),
    number("fit.headings", "headings", [1.0, 360.0], "Headings tried, evenly spread over the turn."),
    number(
        "fit.shape_sigma",
        "standard deviations",
        [0.01, 100.0],
        "Weight of each coefficient against the shape prior; larger trusts the scan more.",
    ),
    number(
        "fit.noise",
        "metres",
        [0.0001, 0.1],
        "Standard deviation of the scan's surface, by which fine residuals are weighed.",
    ),
    number("fit.fine_iterations", "steps", [1.0, 1000.0], "At most this many Gauss-Newton steps at the finest level."),
    switch("fit.conform", "Whether the body takes on the scan's own surface."),
    choice(
        "fit.conformation.map",
        &["by-hand", "whole-body"],
        "Which landmarks carry the body before it is conformed: those set by hand, or all of them, by radial basis functions.",
    ),
    number("fit.conformation.rounds", "rounds", [0.0, 100.0], "Closest-point rounds."),
    number("fit.conformation.reach", "metres", [0.0, 0.5], "How far the scan may draw a vertex."),
    number(
        "fit.conformation.stiffness_length",
        "metres",
        [0.0001, 0.5],
        "Length over which bending smooths the displacement; detail finer than six times this is left out.",
    ),
    number(
        "fit.conformation.extremity_length",
        "metres",
        [0.0001, 0.5],
        "The same for hands and feet, which must stay well-formed.",
    ),
    number("fit.conformation.head_length", "metres", [0.0001, 0.5], "The same for the head."),
    number(
        "fit.conformation.min_cos",
        "",
        [0.0, 1.0],
        "Smallest cosine between the normals of body and scan; half of it on head and feet.",
    ),
    choice(
        "under_clothes.method",
        &["toile", "seed"],
        "Whose way the fit goes: robust and coarse to fine, or eq. 5 and 6 as the seed prints them.",
    ),
    switch(
        "under_clothes.joints",
        "Joints that the seed's way turns, by name; an empty list is all of its own choice.",
    ),
    switch("under_clothes.inside", "Whether the seed's way keeps the body inside the scan (eq. 6)."),
    number("under_clothes.headings", "headings", [1.0, 360.0], "Headings tried, evenly spread over the turn."),
    number(
        "under_clothes.joint_sigma",
        "radians",
        [0.0001, 3.15],
        "Standard deviation of a joint's turn away from the initial pose.",
    ),
    number(
        "under_clothes.cloth",
        "metres",
        [0.0001, 0.1],
        "Distance at which a match counts a quarter: beyond it the scan is taken for new cloth.",
    ),
    number("under_clothes.stand_off", "metres", [0.0001, 0.5], "How far new cloth typically stands off."),
    number(
        "under_clothes.inside_sigma",
        "metres",
        [0.0001, 0.1],
        "Standard deviation of the one-sided term that keeps the body inside.",
    ),
    number(
        "under_clothes.color",
        "levels of 255",
        [0.1, 255.0],
        "Difference of colour at which a match counts a quarter.",
    ),
    number(
        "under_clothes.fine_iterations",
        "steps",
        [1.0, 1000.0],
        "At most this many Gauss-Newton steps at the finest level.",
    ),
    choice(
        "extract.labelling",
        &["graph-cut", "nearest-body-vertex"],
        "How vertices are labelled: one energy minimised by a graph cut, or by the nearest body vertex as in the seed.",
    ),
    number(
        "extract.smoothness",
        "nats times metres",
        [0.0, 1.0],
        "Cost of a metre of hem where neither colour nor shape shows an edge.",
    ),
    number("extract.reach", "metres", [0.01, 2.0], "How far a garment may hang from what was worn before."),
    number(
        "extract.color_search",
        "metres",
        [0.0, 0.1],
        "Radius within which a colour of the earlier layers is looked for.",
    ),
    number(
        "extract.rounds",
        "rounds",
        [1.0, 100.0],
        "Rounds of labelling, each with the colours that the one before found.",
    ),
    number("extract.hem_smoothing", "metres", [0.0, 0.1], "Standard deviation of the smoothing that rounds the hem."),
    number(
        "extract.edge_loss",
        "metres",
        [0.0, 0.1],
        "Width that a scan lacks at the edge of cloth that nothing lies close behind; 0 trusts the scan's edge.",
    ),
    number(
        "extract.rim_smoothing",
        "metres",
        [0.0, 0.1],
        "Standard deviation of the smoothing of a finished hem along itself.",
    ),
    number("extract.hem_depth", "metres", [0.0, 0.5], "The step at a hem is taken off over at most this width."),
    number(
        "extract.least_area",
        "square metres",
        [0.0, 1.0],
        "A garment is at least this large; less is \"no new garment\".",
    ),
    number(
        "extract.piece_share",
        "",
        [0.0, 1.0],
        "A separate piece is kept when it has this share of the largest one's area.",
    ),
    number(
        "extract.hole_rim",
        "metres",
        [0.0, 2.0],
        "Holes with a rim up to this length are closed, unless the body passes through them.",
    ),
    number(
        "extract.loose_distance",
        "metres",
        [0.0, 0.5],
        "Distance over which skin weights become those of the surroundings.",
    ),
    number(
        "extract.edge_length",
        "metres",
        [0.0, 0.1],
        "Mean edge length of the garment's mesh; 0 keeps the scan's own triangles.",
    ),
    choice(
        "stack.method",
        &["regions", "push-along-normal"],
        "How layers are parted: region by region, or pushed along the normal as in the seed (eq. 7).",
    ),
    number(
        "stack.gap",
        "metres",
        [0.0001, 0.05],
        "Gap of a thin layer over each layer below; thicker cloth has a larger one.",
    ),
    number("stack.spread", "metres", [0.0, 0.5], "Distance over which a push spreads into its surroundings."),
    number(
        "stack.rounds",
        "rounds",
        [1.0, 10000.0],
        "At most this many rounds in each region, each time that it is solved.",
    ),
    number("stack.reach", "metres", [0.001, 0.5], "Heights are read up to this distance from a lower layer."),
    number(
        "stack.push_beyond",
        "metres",
        [0.0, 0.02],
        "How far beyond the surface a vertex is pushed (k of the seed's eq. 7); only push-along-normal uses it.",
    ),
    number(
        "motion.max_rate",
        "poses a second",
        [1.0, 1000.0],
        "Faster motions are resampled to this, slower ones are kept.",
    ),
    switch("motion.face_front", "Turn the motion so that the person faces the front in its first frame."),
    switch("motion.in_place", "Stay in place: the travel over the ground is left out."),
    switch("motion.looped", "Cut and blend the motion so that its end goes over into its start, in place."),
    switch("motion.fingers", "Turn finger joints where the source has them."),
    switch(
        "motion.lift_feet",
        "Hold feet that stand in their place on the floor, and lift out of it what would dip below.",
    ),
    switch("motion.room_for_clothes", "Hold arms as far from the body as the clothes between them need."),
    choice("avatar.springs", &["on", "off"], "Whether skirts, dresses and coats swing by spring bones in avatar.vrm."),
];
