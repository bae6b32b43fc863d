//! `myriorama view`: a thin client that writes what it receives.

mod args;
mod comparing;
mod file_names;
mod job;
mod record;
mod settings;
mod stopping;
mod writer;

use std::time::Duration;

use anyhow::Context as _;
use app_core::delivery::receive_requests;
use app_core::exit::{BadInput, Outcome};
use app_core::live;
use app_core::live::Drive;
use app_core::print_line;
use app_core::process::StopSignals;
use client::Session;
use depth_image::PinholeCamera;
use indicatif::ProgressBar;
use tokio::runtime::Handle;

pub use args::ViewArgs;
use comparing::compare;
use file_names::remove_parts;
use job::Job;
use record::Record;
use stopping::{how_to_resume, until};
use writer::PictureWriter;

/// The longest wait for the choice of a budget.
const LONGEST_WAIT: Duration = Duration::from_secs(600);

/// Asks for views, receives them, and writes them.
///
/// # Errors
/// Input that cannot be used, a cluster that cannot be reached, or a folder that cannot be written.
pub async fn run(args: ViewArgs) -> anyhow::Result<Outcome> {
    check_cameras(&args)?;
    if args.live {
        let job = Job::place(&args).await?;
        let session = job.open().await?;
        return follow(&args, &session, job.cameras.to_vec()).await;
    }
    let signals = StopSignals::listen()?;
    let second = signals.second.clone();
    let folder = args.out.clone();
    // A thread of its own: a long record is written without a pause in which the second signal could be heard.
    let work = tokio::task::spawn_blocking(move || Handle::current().block_on(pictures(&args, &signals)));
    tokio::select! {
        outcome = work => outcome?,
        () = second.cancelled() => {
            remove_parts(&folder);
            Ok(Outcome::Interrupted)
        }
    }
}

/// The record is written beside the pictures: the caller's file of cameras must not be there under its name.
fn check_cameras(args: &ViewArgs) -> Result<(), BadInput> {
    let record = args.out.join(record::FILE_NAME).canonicalize().ok();
    let given = args.viewpoints.cameras.as_ref().filter(|_| !args.live);
    match given.filter(|given| record.is_some() && given.canonicalize().ok() == record) {
        None => Ok(()),
        Some(given) => {
            let reason = "the record of the views would be written over it; give --out another folder";
            Err(BadInput(format!("--cameras {}: {reason}", given.display())))
        }
    }
}

/// Writes the views that are missing, and compares all of them if that is wanted.
async fn pictures(args: &ViewArgs, signals: &StopSignals) -> anyhow::Result<Outcome> {
    let Some(mut job) = until(&signals.first, Job::place(args)).await? else { return Ok(Outcome::Interrupted) };
    let mut record = job.record(args)?;
    job.expose(&record);
    if record.count() < record.total() {
        let ended = write_missing(args, &job, &mut record, signals).await;
        if matches!(ended, Ok(None)) || ended.is_err() && record.count() > 0 {
            eprintln!("{}", how_to_resume(&record, &args.out));
        }
        if ended?.is_none() {
            return Ok(Outcome::Interrupted);
        }
    } else {
        print_line!("{} views are in {} already", record.total(), args.out.display());
        record.save()?;
    }
    let unkept = record.unkept_promise().filter(|_| args.budget.is_some());
    let is_kept = unkept.map_or(Ok(()), |promise| Err(anyhow::anyhow!(promise)));
    if !args.compare {
        return is_kept.map(|()| Outcome::Done);
    }
    job.expose(&record);
    match until(&signals.first, compare(args, &job, record.total())).await? {
        Some(()) => is_kept.map(|()| Outcome::Done),
        None => {
            eprintln!("{}", how_to_resume(&record, &args.out));
            Ok(Outcome::Interrupted)
        }
    }
}

/// Receives the views that are missing. Writes each picture as it comes, and the record now and then and at the end. `None` where
/// a signal ended it.
async fn write_missing(
    args: &ViewArgs,
    job: &Job,
    record: &mut Record,
    signals: &StopSignals,
) -> anyhow::Result<Option<()>> {
    let Some(session) = until(&signals.first, job.open()).await? else { return Ok(None) };
    if until(&signals.first, job.wait_for_promise(&session, LONGEST_WAIT)).await?.is_none() {
        return Ok(None);
    }
    record.set_tone(session.tone());
    // Neither do pictures of an earlier request stay beside those of this one, nor their record.
    let deleted = if args.resume { 0 } else { record.delete_earlier() };
    if deleted > 0 {
        print_line!("{deleted} pictures of an earlier request are deleted from {}", args.out.display());
    }
    record.save()?;
    let progress = ProgressBar::new(record.total());
    progress.set_position(record.count());
    let pixels = job.cameras.iter().map(PinholeCamera::pixel_count).max().unwrap_or(0);
    let mut writer = PictureWriter::new(&args.out, pixels, args.planes());
    let before = record.count();
    let missing = record.missing();
    let received = async |frame| {
        if let Some((number, depth_scale)) = writer.write(frame).await? {
            record.add(number, depth_scale);
        }
        progress.inc(1);
        record.save_if_due()
    };
    let received = until(&signals.first, receive_requests(&session, missing, received)).await;
    record.set_promise(session.promise().as_ref());
    let finished = finish(&mut writer, record).await;
    progress.finish_and_clear();
    let seconds = received.and_then(|received| finished.map(|()| received))?;
    let Some(seconds) = seconds else { return Ok(None) };
    print_line!("{} views in {seconds:.3} s, in {}", record.count() - before, args.out.display());
    Ok(Some(()))
}

/// Waits for the pictures that are being written, and writes the record.
async fn finish(writer: &mut PictureWriter, record: &mut Record) -> anyhow::Result<()> {
    let mut failed = None;
    loop {
        match writer.next_written().await {
            Ok(Some((number, depth_scale))) => record.add(number, depth_scale),
            Ok(None) => break,
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    record.save()?;
    failed.map_or(Ok(()), Err)
}

/// Moves along `path`, then prints and writes where the time of frames went.
async fn follow(args: &ViewArgs, session: &Session, path: Vec<PinholeCamera>) -> anyhow::Result<Outcome> {
    let drive = Drive {
        path,
        rate_hz: args.rate,
        lasting: Duration::from_secs_f64(args.seconds),
        set_step_s: args.frame_step,
        set_count: args.frames,
    };
    let record = live::drive(session, &drive, std::future::pending::<()>()).await?;
    let file = args.out.join("live.csv");
    std::fs::write(&file, record.frames()?.to_csv()?).with_context(|| format!("cannot write {}", file.display()))?;
    let latencies = live::latencies("From pose to picture", record.shown.iter())?;
    print_line!("{}\n\n{}", latencies.to_text(), record.summary());
    session.promise().into_iter().for_each(|promise| print_line!("{promise}"));
    if let Some(error) = record.error {
        return Err(error.into());
    }
    Ok(Outcome::Done)
}
