//! What can be wrong with a fit: rules over shares (0–1), metres and standard deviations.

use super::report::{FitReport, PartShown};

/// The figures that rules judge.
pub(super) struct Evidence<'a> {
    pub report: &'a FitReport,
    /// Large regions that were barely seen.
    pub hidden: &'a [String],
    /// Those of them of which nothing was seen.
    pub unseen: &'a [String],
    /// Standing, metres.
    pub stature: f64,
}

/// Values at which a rule finds fault.
#[derive(Clone, Copy)]
pub(super) enum Bounds {
    /// Below the value.
    Below(f64),
    /// Above the value.
    Above(f64),
    /// Outside of the range.
    Outside(f64, f64),
    /// At no value.
    Never,
}

/// How much more unusual a shape may be that explains its scan closely (standard deviations): the largest of the model's own
/// population has 1.4, of other sliders 1.9.
const CLOSE_SHAPE: f64 = 1.0;
/// A scan is explained closely with at least this share of it within 20 mm of the model and this mean distance from it, metres:
/// no shape that is not a person comes near both.
const CLOSE: (f64, f64) = (0.97, 0.005);

impl Evidence<'_> {
    pub fn is_close(&self) -> bool {
        let (share, distance) = CLOSE;
        let r = self.report;
        !r.estimated && r.scan_explained >= share && 1e-3 * r.scan_to_model.mean_mm <= distance
    }
}

/// One thing that can be wrong with a fit.
pub(super) struct Rule {
    /// The value that is judged: a share, metres, or standard deviations.
    pub value: fn(&Evidence) -> f64,
    pub doubtful: Bounds,
    pub failed: Bounds,
    /// The sentence for people, with the remedy.
    pub reason: fn(&Evidence) -> String,
}

/// Shares explained: hair stands off and leaves up to 3 % of the scan over. Limbs: of 36 right fits (by their mean joint) of generated people in poses of
/// dance, running and gestures 0.0075 of the scan lay far from all limbs at most, and 0.03 of a part inside another (one hand 0.13);
/// of fits with an arm in another place at least 0.010, or 0.19.
pub(super) const ON_SKIN: [Rule; 10] = [
    Rule { doubtful: Bounds::Below(0.97), failed: Bounds::Below(0.80), ..EXPLAINED },
    LIMBS_UNEXPLAINED,
    LIMB_BURIED,
    PART_ONLY,
    Rule { doubtful: Bounds::Below(0.60), failed: Bounds::Below(0.25), ..COVERED },
    HIDDEN,
    Rule { doubtful: Bounds::Above(0.008), failed: Bounds::Above(0.020), ..MODEL_DISTANCE },
    BODY_DISTANCE,
    STATURE,
    UNUSUAL,
];

/// Clothes leave more over and stand off the model, and whoever is dressed is estimated; but a face is seen whatever else
/// is covered, and the prior keeps shapes ordinary. Of six dressed takes of generated people the head is covered by 0.88 to
/// 0.92 and shapes reach 0.95; of 31 shapes that are not persons two came near: a thin column (0.54 and 2.2) and a flat
/// figure (0.17 and 1.8). A hood may hide two thirds of a head.
pub(super) const UNDER_CLOTHES: [Rule; 8] = [
    Rule { doubtful: Bounds::Below(0.97), failed: Bounds::Below(0.80), ..EXPLAINED },
    Rule { doubtful: Bounds::Below(0.60), failed: Bounds::Below(0.25), ..COVERED },
    HIDDEN,
    Rule { doubtful: Bounds::Above(0.040), failed: Bounds::Above(0.100), ..MODEL_DISTANCE },
    HEAD,
    DRESSED,
    STATURE,
    Rule { doubtful: Bounds::Above(1.6), failed: Bounds::Above(2.0), ..UNUSUAL },
];

/// The upper part of a person. Of a person's scan less is known, so that more is asked of it: the face lies on the scan, and
/// nothing of the scan is left over.
pub(super) const OF_PART: [Rule; 8] = [
    Rule { doubtful: Bounds::Below(0.97), failed: Bounds::Below(0.93), ..EXPLAINED },
    LIMB_BURIED,
    Rule { doubtful: Bounds::Below(0.80), failed: Bounds::Below(0.60), ..PART_COVERED },
    Rule { doubtful: Bounds::Below(0.75), failed: Bounds::Below(0.60), ..HEAD },
    Rule { doubtful: Bounds::Above(0.010), failed: Bounds::Above(0.020), ..MODEL_DISTANCE },
    STATURE,
    Rule { doubtful: Bounds::Above(1.6), failed: Bounds::Above(2.0), ..UNUSUAL },
    PART_SHOWN,
];

/// The same of a dressed person.
pub(super) const OF_DRESSED_PART: [Rule; 8] = [
    Rule { doubtful: Bounds::Below(0.97), failed: Bounds::Below(0.93), ..EXPLAINED },
    Rule { doubtful: Bounds::Below(0.80), failed: Bounds::Below(0.60), ..PART_COVERED },
    Rule { doubtful: Bounds::Below(0.75), failed: Bounds::Below(0.60), ..HEAD },
    Rule { doubtful: Bounds::Above(0.030), failed: Bounds::Above(0.040), ..MODEL_DISTANCE },
    STATURE,
    Rule { doubtful: Bounds::Above(1.6), failed: Bounds::Above(2.0), ..UNUSUAL },
    PART_SHOWN,
    DRESSED,
];

/// The body goes on below the scan's lower end by this much at least, metres; else the scan shows a whole person, or none.
const CUT_OFF: f64 = 0.25;

const PART_COVERED: Rule = Rule {
    value: |e| e.report.part.as_ref().map_or(0.0, |part| part.covered),
    doubtful: Bounds::Never,
    failed: Bounds::Never,
    reason: |e| {
        let covered = 100.0 * e.report.part.as_ref().map_or(0.0, |part| part.covered);
        format!("the scan covers {covered:.0} % of the body above its lower end: is it the upper part of a person?")
    },
};

/// Always worth a sentence; a fault where nothing is cut off.
const PART_SHOWN: Rule = Rule {
    value: |e| e.report.part.as_ref().map_or(0.0, |part| part.below_m),
    doubtful: Bounds::Above(0.0),
    failed: Bounds::Below(CUT_OFF),
    reason: |e| e.report.part.as_ref().map_or_else(String::new, PartShown::sentence),
};

const EXPLAINED: Rule = Rule {
    value: |e| e.report.scan_explained,
    doubtful: Bounds::Never,
    failed: Bounds::Never,
    reason: |e| {
        let explained = 100.0 * e.report.scan_explained;
        format!(
            "the body explains {explained:.1} % of the scan: is there one standing person in it, alone and lightly dressed?"
        )
    },
};

const LIMBS_UNEXPLAINED: Rule = Rule {
    // where most of the scan is unexplained it is no limb, and the rule before says so
    value: |e| if e.report.scan_explained < 0.80 { 0.0 } else { e.report.limbs_unexplained },
    doubtful: Bounds::Above(0.008),
    failed: Bounds::Above(0.012),
    reason: |e| {
        let left = 100.0 * e.report.limbs_unexplained;
        format!(
            "{left:.1} % of the scan lies far from the body, as an arm that was not found: look at the body in the scan, and set \
             landmarks on the limb by hand, or scan the person with arms clear of the trunk"
        )
    },
};

const LIMB_BURIED: Rule = Rule {
    value: |e| e.report.limb_buried,
    doubtful: Bounds::Above(0.10),
    failed: Bounds::Above(0.15),
    reason: |e| {
        let buried = 100.0 * e.report.limb_buried;
        format!(
            "{buried:.0} % of one part of the body lies inside another: look at the body in the scan, and set landmarks on the limb by \
             hand, or scan the person with arms clear of the trunk"
        )
    },
};

const COVERED: Rule = Rule {
    value: |e| e.report.body_covered,
    doubtful: Bounds::Never,
    failed: Bounds::Never,
    reason: |e| {
        let covered = 100.0 * e.report.body_covered;
        format!("the scan covers {covered:.0} % of the body and the rest is estimated: scan the person from all sides")
    },
};

/// The number of large regions of which nothing was seen: a bust, half a person.
const PART_ONLY: Rule = Rule {
    value: |e| e.unseen.len() as f64,
    doubtful: Bounds::Above(1.0),
    failed: Bounds::Above(3.0),
    reason: |e| {
        let unseen = e.unseen.join(", ");
        format!(
            "the scan shows a part of a person only: {unseen} are not in it, and they, the stature and their measures are guessed; \
             scan the whole person"
        )
    },
};

/// The number of large regions that were barely seen, unless another rule already says that much is missing.
const HIDDEN: Rule = Rule {
    value: |e| {
        let is_told = e.report.body_covered < 0.60 || e.unseen.len() > 1;
        if is_told { 0.0 } else { e.hidden.len() as f64 }
    },
    doubtful: Bounds::Above(0.0),
    failed: Bounds::Never,
    reason: |e| barely_seen(e.hidden),
};

const MODEL_DISTANCE: Rule = Rule {
    value: |e| 1e-3 * e.report.scan_to_model.mean_mm,
    doubtful: Bounds::Never,
    failed: Bounds::Never,
    reason: |e| {
        let mean = e.report.scan_to_model.mean_mm;
        format!("the model lies {mean:.1} mm from the scan on average: are clothes, hair or things held in the way?")
    },
};

/// A conformed body farther than 3 mm from its own scan has not found its place: noise leaves 1 to 2 mm.
const BODY_DISTANCE: Rule = Rule {
    value: |e| 1e-3 * e.report.scan_to_body.mean_mm,
    doubtful: Bounds::Above(0.003),
    failed: Bounds::Never,
    reason: |e| {
        let mean = e.report.scan_to_body.mean_mm;
        format!(
            "the body's own surface lies {mean:.1} mm from the scan on average: check whether it stands in the scan"
        )
    },
};

const HEAD: Rule = Rule {
    value: |e| e.report.head_covered,
    doubtful: Bounds::Below(0.6),
    failed: Bounds::Below(0.3),
    reason: |e| {
        let head = 100.0 * e.report.head_covered;
        format!("only {head:.0} % of the head lies on the scan: is it a person, and is the face uncovered?")
    },
};

const DRESSED: Rule = Rule {
    value: |e| f64::from(u8::from(e.report.estimated)),
    doubtful: Bounds::Above(0.0),
    failed: Bounds::Never,
    reason: |_| "the person is dressed: shape and measures are estimated".into(),
};

/// Adults, metres: 1.35 lies 4.3 standard deviations below the mean of ANSUR II's women (1.628 ± 0.064), 2.2 more than six
/// above that of its men (1.756 ± 0.069).
const STATURE: Rule = Rule {
    value: |e| e.stature,
    doubtful: Bounds::Outside(1.35, 2.2),
    failed: Bounds::Outside(1.0, 2.5),
    reason: |e| {
        let stature = e.stature;
        format!(
            "the body would stand {stature:.2} m tall, but the body model is of adults: it fits neither children nor parts \
             of a person, and scans in metres only"
        )
    },
};

/// A shape is a doubt where the model does not explain the scan closely: short and heavy people are rare, but people.
const UNUSUAL: Rule = Rule {
    value: |e| if e.is_close() { e.report.shape_rms - CLOSE_SHAPE } else { e.report.shape_rms },
    doubtful: Bounds::Above(2.0),
    failed: Bounds::Above(3.0),
    reason: |e| {
        let rms = e.report.shape_rms;
        format!(
            "the shape is {rms:.1} times as unusual as an ordinary body's: is there one person in it, and nothing else?"
        )
    },
};

impl Bounds {
    pub fn is_exceeded(self, value: f64) -> bool {
        match self {
            Self::Below(limit) => value < limit,
            Self::Above(limit) => value > limit,
            Self::Outside(low, high) => !(low..=high).contains(&value),
            Self::Never => false,
        }
    }
}

pub(super) fn barely_seen(regions: &[String]) -> String {
    format!("barely seen, so estimated: {}", regions.join(", "))
}
