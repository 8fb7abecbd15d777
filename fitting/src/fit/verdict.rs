//! Whether a fit is to be trusted: a table of rules over shares (0–1), metres and standard deviations.

use nalgebra::Point3;
use toile_character::{BodyModel, Region};
use toile_geometry::Mesh;

use super::{
    astray::Astray,
    evidence::{Coverage, Distances, samples},
    placement::Extent,
    report::{FitReport, PartShown, Verdict},
};
use crate::{
    Measurements,
    solve::{Descent, State},
};

/// Distances within which scan and body belong together, metres.
struct Reach {
    /// The body explains the scan.
    explained: f32,
    /// The scan covers the body.
    covered: f32,
}

/// Of skin: four times the misfit of the coarsest model that is believed.
const SKIN: Reach = Reach { explained: 0.02, covered: 0.015 };
/// Under clothes: as far as a coat or a wide skirt stands off.
const CLOTHES: Reach = Reach { explained: 0.10, covered: 0.10 };
/// Scan and bare skin belong together within this, metres.
pub(crate) const SKIN_COVERED: f32 = SKIN.covered;
/// A region of which a smaller share than this was scanned is estimated.
const BARELY_SEEN: f64 = 0.3;
/// A region of which a smaller share than this was scanned is not in the scan: noise and neighbours reach that far over its border.
const NOT_SEEN: f64 = 0.1;
/// Each doubt alone may have a reason of its own; this many together have one: the fit is wrong. A dressed person
/// brings one of them along.
const TOO_MANY_DOUBTS: usize = 3;

/// The figures that rules judge.
struct Evidence<'a> {
    report: &'a FitReport,
    /// Large regions that were barely seen.
    hidden: &'a [String],
    /// Those of them of which nothing was seen.
    unseen: &'a [String],
    /// Standing, metres.
    stature: f64,
}

/// Values at which a rule finds fault.
#[derive(Clone, Copy)]
enum Bounds {
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
    fn is_close(&self) -> bool {
        let (share, distance) = CLOSE;
        let r = self.report;
        !r.estimated && r.scan_explained >= share && 1e-3 * r.scan_to_model.mean_mm <= distance
    }
}

/// One thing that can be wrong with a fit.
struct Rule {
    /// The value that is judged: a share, metres, or standard deviations.
    value: fn(&Evidence) -> f64,
    doubtful: Bounds,
    failed: Bounds,
    /// The sentence for people, with the remedy.
    reason: fn(&Evidence) -> String,
}

/// Shares explained: hair stands off and leaves up to 3 % of the scan over. Limbs: of 36 right fits (by their mean joint) of generated people in poses of
/// dance, running and gestures 0.0075 of the scan lay far from all limbs at most, and 0.03 of a part inside another (one hand 0.13);
/// of fits with an arm in another place at least 0.010, or 0.19.
const ON_SKIN: [Rule; 10] = [
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
const UNDER_CLOTHES: [Rule; 8] = [
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
const OF_PART: [Rule; 8] = [
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
const OF_DRESSED_PART: [Rule; 8] = [
    Rule { doubtful: Bounds::Below(0.97), failed: Bounds::Below(0.93), ..EXPLAINED },
    Rule { doubtful: Bounds::Below(0.80), failed: Bounds::Below(0.60), ..PART_COVERED },
    Rule { doubtful: Bounds::Below(0.75), failed: Bounds::Below(0.60), ..HEAD },
    Rule { doubtful: Bounds::Above(0.030), failed: Bounds::Above(0.040), ..MODEL_DISTANCE },
    STATURE,
    Rule { doubtful: Bounds::Above(1.6), failed: Bounds::Above(2.0), ..UNUSUAL },
    PART_SHOWN,
    DRESSED,
];

/// The trunk's share from which on a body is fitted: shoulders and chest, and some of the waist.
const ENOUGH: f64 = 0.55;
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
    fn is_exceeded(self, value: f64) -> bool {
        match self {
            Self::Below(limit) => value < limit,
            Self::Above(limit) => value > limit,
            Self::Outside(low, high) => !(low..=high).contains(&value),
            Self::Never => false,
        }
    }
}

/// What a fit was asked for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asked {
    /// How much of a person the scan is taken to show.
    pub extent: Extent,
    /// The person is dressed.
    pub dressed: bool,
}

/// Measures a fit and judges it; the report, and of each vertex whether the scan shows its skin. `points` is the conformed body in
/// the scan's pose, `scan` has normals.
pub(crate) fn judge(
    model: &BodyModel,
    (scan, trust): (&Mesh, &[f32]),
    fine: &Descent,
    points: &[Point3<f32>],
    measurements: &Measurements,
    astray: &Astray,
    Asked { extent, dressed }: Asked,
) -> (FitReport, Vec<bool>) {
    let reach = if dressed { CLOTHES } else { SKIN };
    let State { beta, pose } = &fine.state;
    let samples = samples(scan, trust);
    let to_model = Distances::new(&samples, &model.posed(beta, pose), model);
    let skin = Coverage::new(model, points, scan, trust, SKIN.covered);
    let clothed = dressed.then(|| Coverage::new(model, points, scan, trust, CLOTHES.covered));
    let covered = clothed.as_ref().unwrap_or(&skin);
    let shown = || PartShown::new(model, &fine.state, points, &covered.seen, (scan, trust));
    let mut report = FitReport {
        verdict: Verdict::Trusted,
        reasons: Vec::new(),
        notices: Vec::new(),
        iterations: fine.iterations,
        converged: fine.converged,
        scan_to_model: to_model.stats(),
        scan_to_body: Distances::new(&samples, points, model).stats(),
        body_covered: covered.whole,
        scan_explained: to_model.share_within(reach.explained),
        limbs_unexplained: astray.limbs_unexplained,
        limb_buried: astray.region_buried,
        // Whatever else is dressed, a face is seen.
        head_covered: skin.of(Region::Head),
        shape_rms: (beta.iter().map(|b| b * b).sum::<f64>() / beta.len().max(1) as f64).sqrt(),
        estimated: dressed,
        part: (extent == Extent::FromCrown).then(shown),
        is_too_little: false,
        region_covered: covered.regions.clone(),
    };
    decide(&mut report, measurements.stature_m);
    (report, skin.seen)
}

/// Sets verdict and reasons; regions that do not matter for the rest of the body become a notice.
fn decide(report: &mut FitReport, stature: f64) {
    let hidden = report.region_covered.iter().filter(|r| *r.1 < BARELY_SEEN).map(|r| r.0.clone());
    let (small, large): (Vec<String>, Vec<String>) = hidden.partition(|r| is_small(r));
    let is_unseen = |r: &&String| report.region_covered.get(*r).is_none_or(|share| *share < NOT_SEEN);
    let unseen: Vec<String> = large.iter().filter(is_unseen).cloned().collect();
    let evidence = Evidence { report, hidden: &large, unseen: &unseen, stature };
    let mut verdict = Verdict::Trusted;
    let mut reasons = Vec::new();
    let rules: &[Rule] = match (report.estimated, report.part.is_some()) {
        (false, false) => &ON_SKIN,
        (true, false) => &UNDER_CLOTHES,
        (false, true) => &OF_PART,
        (true, true) => &OF_DRESSED_PART,
    };
    for rule in rules {
        let value = (rule.value)(&evidence);
        let has_failed = rule.failed.is_exceeded(value);
        if has_failed || rule.doubtful.is_exceeded(value) {
            verdict = verdict.max(if has_failed { Verdict::Failed } else { Verdict::Doubtful });
            reasons.push((rule.reason)(&evidence));
        }
    }
    let expected = usize::from(report.estimated) + usize::from(report.part.is_some());
    report.verdict = if reasons.len() >= TOO_MANY_DOUBTS + expected { Verdict::Failed } else { verdict };
    report.reasons = reasons;
    refuse_too_little(report);
    if !small.is_empty() {
        report.notices.push(barely_seen(&small));
    }
}

/// A part of a person that shows too little of the trunk gives no body, and says so in place of everything else.
fn refuse_too_little(report: &mut FitReport) {
    let Some(part) = report.part.as_ref().filter(|part| part.trunk_covered < ENOUGH) else { return };
    report.is_too_little = report.verdict != Verdict::Failed;
    report.verdict = Verdict::Failed;
    if report.is_too_little {
        report.reasons = vec![format!(
            "the scan shows a person from the {} up, which is too little for a body: neither its size nor its shape can be \
             told; scan the person from the hips up at least",
            part.from
        )];
    }
}

/// A hand, a foot or the head alone moves the rest of the body little.
fn is_small(region: &str) -> bool {
    region.ends_with("hand") || region.ends_with("foot") || region == "head"
}

fn barely_seen(regions: &[String]) -> String {
    format!("barely seen, so estimated: {}", regions.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::report::DistanceStats;

    fn good(estimated: bool) -> FitReport {
        FitReport {
            verdict: Verdict::Failed,
            reasons: Vec::new(),
            notices: Vec::new(),
            iterations: 1,
            converged: true,
            scan_to_model: DistanceStats { mean_mm: 2.0, ..DistanceStats::default() },
            scan_to_body: DistanceStats { mean_mm: 1.0, ..DistanceStats::default() },
            body_covered: 0.95,
            scan_explained: 0.999,
            limbs_unexplained: 0.0,
            limb_buried: 0.0,
            head_covered: 0.9,
            shape_rms: 1.0,
            estimated,
            part: None,
            is_too_little: false,
            region_covered: [("left hand".into(), 0.1), ("torso".into(), 0.9)].into(),
        }
    }

    fn judged(mut report: FitReport, stature: f64) -> (Verdict, usize) {
        decide(&mut report, stature);
        (report.verdict, report.reasons.len())
    }

    #[test]
    fn each_rule_finds_its_own_fault_and_three_doubts_fail() {
        assert_eq!(judged(good(false), 1.7), (Verdict::Trusted, 0));
        assert_eq!(judged(good(true), 1.7), (Verdict::Doubtful, 1));
        let explained = FitReport { scan_explained: 0.96, ..good(false) };
        assert_eq!(judged(explained.clone(), 1.7), (Verdict::Doubtful, 1));
        assert_eq!(judged(FitReport { scan_explained: 0.7, ..good(false) }, 1.7), (Verdict::Failed, 1));
        assert_eq!(judged(FitReport { body_covered: 0.2, ..good(false) }, 1.7), (Verdict::Failed, 1));
        assert_eq!(
            judged(FitReport { region_covered: [("torso".into(), 0.2)].into(), ..good(false) }, 1.7).0,
            Verdict::Doubtful
        );
        let far = |mean_mm| DistanceStats { mean_mm, ..DistanceStats::default() };
        assert_eq!(judged(FitReport { scan_to_model: far(9.0), ..good(false) }, 1.7), (Verdict::Doubtful, 1));
        assert_eq!(judged(FitReport { scan_to_model: far(9.0), ..good(true) }, 1.7), (Verdict::Doubtful, 1));
        assert_eq!(judged(FitReport { scan_to_body: far(4.0), ..good(false) }, 1.7), (Verdict::Doubtful, 1));
        assert_eq!(judged(FitReport { shape_rms: 2.5, ..good(false) }, 1.7), (Verdict::Trusted, 0));
        assert_eq!(judged(FitReport { shape_rms: 3.5, ..good(false) }, 1.7), (Verdict::Doubtful, 1));
        let loose = FitReport { scan_to_model: far(6.0), shape_rms: 2.5, ..good(false) };
        assert_eq!(judged(loose, 1.7), (Verdict::Doubtful, 1));
        for (limbs_unexplained, limb_buried, verdict) in [
            (0.01, 0.0, Verdict::Doubtful),
            (0.02, 0.0, Verdict::Failed),
            (0.0, 0.12, Verdict::Doubtful),
            (0.0, 0.3, Verdict::Failed),
        ] {
            assert_eq!(judged(FitReport { limbs_unexplained, limb_buried, ..good(false) }, 1.7), (verdict, 1));
        }
        assert_eq!(judged(FitReport { shape_rms: 2.5, ..good(true) }, 1.7), (Verdict::Failed, 2));
        assert_eq!(judged(FitReport { head_covered: 0.5, ..good(true) }, 1.7), (Verdict::Doubtful, 2));
        assert_eq!(judged(FitReport { head_covered: 0.2, ..good(true) }, 1.7), (Verdict::Failed, 2));
        assert_eq!(judged(FitReport { head_covered: 0.2, ..good(false) }, 1.7), (Verdict::Trusted, 0));
        assert_eq!(judged(good(false), 1.15), (Verdict::Doubtful, 1));
        assert_eq!(judged(good(false), 0.72), (Verdict::Failed, 1));
        assert_eq!(judged(good(false), f64::NAN), (Verdict::Failed, 1));
        let three = FitReport { scan_to_body: far(4.0), shape_rms: 2.5, ..explained };
        assert_eq!(judged(three, 1.7), (Verdict::Failed, 3));
    }

    #[test]
    fn a_scan_without_legs_is_said_to_show_a_part_of_a_person() {
        let mut report = good(false);
        report.body_covered = 0.55;
        report.region_covered.extend([("left leg".into(), 0.02), ("right leg".into(), 0.0)]);
        decide(&mut report, 1.7);
        assert_eq!(report.verdict, Verdict::Doubtful);
        let told = report.reasons.iter().find(|r| r.contains("a part of a person"));
        assert!(told.is_some_and(|r| r.contains("left leg, right leg")), "{:?}", report.reasons);
    }

    #[test]
    fn a_hidden_hand_is_a_notice_only() {
        let mut report = good(false);
        decide(&mut report, 1.7);
        assert_eq!(report.notices, ["barely seen, so estimated: left hand"]);
    }
}
