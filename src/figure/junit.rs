//! Verdicts as JUnit XML for CI systems: a suite for each figure, a case for each claim.

use super::plot::escaped;
use super::{ClaimResult, Results, Verdict};

impl Results {
    /// The text of the file. A claim that holds is a passed case. A claim that fails, wholly or in part, is a failure.
    /// A claim that is undecided or not measured is skipped.
    pub fn junit(&self) -> String {
        let mut text =
            String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"ortelius\">\n");
        for figure in &self.figures {
            let of = |outcome| figure.claims.iter().filter(|claim| outcome_of(claim) == outcome).count();
            let (id, count) = (escaped(&figure.id), figure.claims.len());
            let (failures, skipped) = (of(Some("failure")), of(Some("skipped")));
            text += &format!(
                "<testsuite name=\"{id}\" tests=\"{count}\" failures=\"{failures}\" skipped=\"{skipped}\">\n"
            );
            figure.claims.iter().for_each(|claim| text += &case(&id, claim));
            text += "</testsuite>\n";
        }
        text + "</testsuites>\n"
    }
}

fn outcome_of(claim: &ClaimResult) -> Option<&'static str> {
    match claim.finding.verdict {
        Verdict::Reproduced | Verdict::BetterThanStated | Verdict::HoldsHere => None,
        Verdict::InPart | Verdict::InPartHere | Verdict::NotReproduced | Verdict::NotHere => Some("failure"),
        Verdict::Undecided | Verdict::NotMeasurable | Verdict::NotMeasured => Some("skipped"),
    }
}

fn case(figure: &str, claim: &ClaimResult) -> String {
    let [id, numbers, why] =
        [&claim.id, &claim.finding.numbers, &claim.finding.why].map(|text| escaped(text));
    let name = claim.finding.verdict.name();
    let body = match outcome_of(claim) {
        Some(outcome) => format!("<{outcome} message=\"{name}: {why}\"/>"),
        None => String::new(),
    };
    format!(
        "<testcase classname=\"{figure}\" name=\"{id}\">{body}<system-out>{name}: {numbers}</system-out></testcase>\n"
    )
}
