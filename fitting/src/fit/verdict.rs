//! Whether a fit is to be trusted: it is measured, and judged by a table of rules.

use nalgebra::Point3;
use toile_character::{BodyModel, Region};
use toile_geometry::Mesh;

use super::{
    astray::Astray,
    evidence::{Coverage, Distances, samples},
    placement::Extent,
    report::{FitReport, PartShown, Verdict},
    rules::{Evidence, OF_DRESSED_PART, OF_PART, ON_SKIN, Rule, UNDER_CLOTHES, barely_seen},
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

/// The trunk's share from which on a body is fitted: shoulders and chest, and some of the waist.
const ENOUGH: f64 = 0.55;
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
