//! Records of written views: camera files with a line for each view, which are written and read line by line.

use std::fs::File;
use std::io::{BufRead as _, BufReader, BufWriter, ErrorKind, Read as _, Write as _};
use std::path::Path;

use depth_image::{PinholeCamera, SourceSpace};
use pictures::camera_frame;
use serde_json::{Map, Value, json};

use crate::camera_file::{CameraFault, CameraFileError, fault};

/// The end of the first line, after the fields that are no frames; and the last line.
const FRAMES: &str = ",\"frames\":[";
const END: &str = "]}";
/// The longest line: that of one view has about 500 bytes.
const MAX_LINE_BYTES: u64 = 1 << 20;

/// A camera to write, with further fields.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedCamera {
    /// The path of the camera's picture.
    pub file_path: String,
    /// The camera.
    pub camera: PinholeCamera,
    /// Further fields of the frame.
    pub more: Map<String, Value>,
}

impl NamedCamera {
    /// The line of the camera in a record, in the space of the scene file.
    #[must_use]
    pub fn line(&self, source_space: SourceSpace) -> String {
        let mut frame = self.more.clone();
        frame.insert("file_path".to_owned(), json!(self.file_path));
        frame.extend(camera_frame(&self.camera, source_space));
        Value::Object(frame).to_string()
    }
}

/// Writes cameras in the convention of `transforms.json`, a line each; `about` has fields to go beside the frames. The file is
/// whole under its name, or as it was before.
///
/// # Errors
/// The file cannot be written.
pub fn write(
    path: &Path,
    cameras: impl IntoIterator<Item = NamedCamera>,
    source_space: SourceSpace,
    about: Map<String, Value>,
) -> Result<(), CameraFileError> {
    let part = path.with_extension("part");
    let lines = cameras.into_iter().map(|camera| camera.line(source_space));
    let written = write_lines(&part, lines, about).and_then(|()| std::fs::rename(&part, path));
    written.map_err(|error| fault("file", error).in_file(path))
}

fn write_lines(
    path: &Path,
    lines: impl Iterator<Item = String>,
    mut about: Map<String, Value>,
) -> Result<(), std::io::Error> {
    about.insert("camera_model".to_owned(), json!("OPENCV"));
    let about = Value::Object(about).to_string();
    let mut out = BufWriter::new(File::create(path)?);
    write!(out, "{}{FRAMES}", about.strip_suffix('}').unwrap_or(&about))?;
    for (index, line) in lines.enumerate() {
        write!(out, "{}{line}", if index == 0 { "\n" } else { ",\n" })?;
    }
    writeln!(out, "\n{END}")?;
    out.flush()
}

/// Reads a record: `frame` is given the line of each view. Returns the fields beside the frames; `None` where there is no
/// file.
///
/// # Errors
/// The file cannot be read, or was not written by [`write()`].
pub fn read(path: &Path, frame: impl FnMut(&str)) -> Result<Option<Map<String, Value>>, CameraFileError> {
    match File::open(path) {
        Ok(file) => read_lines(BufReader::new(file), frame).map(Some).map_err(|error| error.in_file(path)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(fault("file", error).in_file(path)),
    }
}

fn read_lines(mut file: BufReader<File>, mut frame: impl FnMut(&str)) -> Result<Map<String, Value>, CameraFileError> {
    let mut number = 0;
    let mut next_line = || {
        let mut line = String::new();
        number += 1;
        let read = file.by_ref().take(MAX_LINE_BYTES).read_line(&mut line);
        read.map_err(|error| fault(format!("line {number}"), error))?;
        // The last line ends too: without its end, a line is cut off.
        let whole = line.strip_suffix('\n').map(ToOwned::to_owned);
        whole.ok_or_else(|| fault(format!("line {number}"), CameraFault::NotAsWritten))
    };
    let first = next_line()?;
    let about = first.strip_suffix(FRAMES).and_then(|about| serde_json::from_str(&format!("{about}}}")).ok());
    let about = about.ok_or_else(|| fault("line 1", CameraFault::NotAsWritten))?;
    loop {
        match next_line()?.as_str() {
            END => return Ok(about),
            line => frame(line.strip_suffix(',').unwrap_or(line)),
        }
    }
}
