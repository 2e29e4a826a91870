//! Times of a list: the passes on the device and on the host.

use super::super::common::passes;
use super::super::list_on_the_host::and_list;
use super::watch::{Sampler, Watch, name};
use super::{ALL_PIXELS, TIME};
use crate::figure::{Bench, Contender, Row, Timed};

pub fn measure(bench: &Bench, watch: &Watch) -> anyhow::Result<Vec<Row>> {
    let session = &watch.opened.session;
    let (gpu, requests, copy) =
        (&session.gpu, &session.technique.stage1().expect("a staged variant").requests, &watch.copy);
    let host = &watch.host;
    let mut contenders: Vec<Contender> = Vec::new();
    for Sampler { n, feedback, samples } in &watch.samplers {
        let mut number = 0;
        let bring = passes(gpu, name(*n), move |frame| {
            number += 1;
            frame.pass("gather", |cmd| feedback.run(cmd, requests, samples, number))?;
            frame.pass("feedback read-back", |cmd| {
                samples.read_back(cmd);
                Ok(())
            })
        });
        contenders.push(and_list(bring, host, || samples.words()));
    }
    let bring = passes(gpu, ALL_PIXELS, |frame| {
        frame.pass("copy request image", |cmd| {
            copy.run(cmd, requests);
            Ok(())
        })
    });
    contenders.push(and_list(bring, host, || copy.words()));
    let timed = bench.interleave(gpu, contenders)?;
    let rows = |timed: &Timed| [timed.row(TIME)].into_iter().chain(timed.pass_rows()).collect::<Vec<_>>();
    Ok(timed.iter().flat_map(rows).collect())
}
