//! Times of a list: the passes on the device and on the host.

use super::super::cost::ON_THE_HOST;
use super::watch::{Subsampling, Watch, name};
use super::{ALL_PIXELS, TIME};
use crate::figure::{Bench, Contender, Row, Timed};

pub fn measure(bench: &Bench, watch: &Watch) -> anyhow::Result<Vec<Row>> {
    let (gpu, requests) = (&watch.opened.session.gpu, &watch.opened.stage1().requests);
    let Watch { copy, host, .. } = watch;
    let mut contenders: Vec<Contender> = Vec::new();
    for Subsampling { n, feedback, samples } in &watch.subsamplings {
        let mut number = 0;
        let bring = Contender::frame(gpu, name(*n), move |frame| {
            number += 1;
            frame.pass("gather", |cmd| feedback.run(cmd, requests, samples, number))?;
            frame.pass("feedback read-back", |cmd| samples.read_back(cmd))
        });
        contenders.push(bring.and_host(ON_THE_HOST, || host.borrow_mut().list(&samples.words())));
    }
    let bring = Contender::frame(gpu, ALL_PIXELS, |frame| {
        frame.pass("copy request image", |cmd| copy.run(cmd, requests))
    });
    contenders.push(bring.and_host(ON_THE_HOST, || host.borrow_mut().list(&copy.words())));
    let timed = bench.interleave(gpu, contenders)?;
    let rows = |timed: &Timed| [timed.row(TIME)].into_iter().chain(timed.pass_rows()).collect::<Vec<_>>();
    Ok(timed.iter().flat_map(rows).collect())
}
