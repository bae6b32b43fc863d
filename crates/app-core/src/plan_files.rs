//! Measurements of plans in files, for later plans.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use cluster::SceneHash;
use coordinator::PlanStore;
use planner::{Kept, KeptKey, MAX_KEPT_BYTES};

const ENDING: &str = "json";

/// A folder with a file for each key.
#[derive(Debug, Clone)]
pub struct PlanFiles {
    folder: PathBuf,
}

impl PlanFiles {
    /// The files of a folder, which need not exist yet.
    #[must_use]
    pub fn at(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// `myriorama/plans` in the user's folder for caches; `None` where the environment names none.
    #[must_use]
    pub fn default_folder() -> Option<PathBuf> {
        let [caches, home] = ["XDG_CACHE_HOME", "HOME"]
            .map(|name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute()));
        Some(caches.or(home.map(|home| home.join(".cache")))?.join("myriorama").join("plans"))
    }

    fn path(&self, key: &KeptKey) -> PathBuf {
        let KeptKey { scene, cell, lighting, view_size, ladder_version } = key;
        let text = [scene, cell, lighting, view_size, ladder_version].map(String::as_str).join("\n");
        self.folder.join(SceneHash::of(text.as_bytes()).to_string()).with_extension(ENDING)
    }

    fn remove_oldest(&self, newest: &Path) -> io::Result<()> {
        let mut files: Vec<(SystemTime, u64, PathBuf)> = Vec::new();
        for entry in fs::read_dir(&self.folder)? {
            let (path, about) = entry.and_then(|entry| Ok((entry.path(), entry.metadata()?)))?;
            if path.extension().is_some_and(|ending| ending == ENDING) && path != newest {
                files.push((about.modified()?, about.len(), path));
            }
        }
        files.sort();
        let mut bytes = files.iter().map(|(_, bytes, _)| bytes).sum::<u64>() + fs::metadata(newest)?.len();
        for (_, file_bytes, path) in files {
            if bytes <= MAX_KEPT_BYTES as u64 {
                break;
            }
            fs::remove_file(path)?;
            bytes -= file_bytes;
        }
        Ok(())
    }
}

impl PlanStore for PlanFiles {
    /// The measurements of a key; none where there is no file. A file that cannot be used is ignored with a warning.
    fn read(&self, key: &KeptKey) -> Kept {
        let path = self.path(key);
        let read = match fs::metadata(&path) {
            Ok(file) if file.len() > MAX_KEPT_BYTES as u64 => Err(format!("it has {} bytes", file.len())),
            Ok(_) => fs::read(&path).map_err(|error| error.to_string()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Kept::empty(key.clone()),
            Err(error) => Err(error.to_string()),
        };
        let kept = read.and_then(|json| Kept::from_json(&json, key).map_err(|error| error.to_string()));
        kept.unwrap_or_else(|reason| {
            tracing::warn!("{} is ignored: {reason}", path.display());
            Kept::empty(key.clone())
        })
    }

    /// Writes the measurements of a key, whole or not at all. The files that were written longest ago are removed where all
    /// together are too large.
    fn write(&self, kept: &Kept) -> io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let path = self.path(&kept.key);
        let part = path.with_extension(format!("{}.part", std::process::id()));
        fs::write(&part, kept.to_json().map_err(io::Error::other)?)?;
        fs::rename(&part, &path)?;
        self.remove_oldest(&path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(scene: &str) -> KeptKey {
        let text = |text: &str| text.to_owned();
        KeptKey {
            scene: text(scene),
            cell: text("c"),
            lighting: text("l"),
            view_size: text("v"),
            ladder_version: text("1"),
        }
    }

    #[test]
    fn measurements_come_back_and_damaged_or_foreign_files_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let files = PlanFiles::at(folder.path().join("plans"));
        assert_eq!(files.read(&key("a")), Kept::empty(key("a")), "nothing is there yet");
        let kept = Kept { fresh_views_drawn: 5, ..Kept::empty(key("a")) };
        files.write(&kept).unwrap();
        assert_eq!(files.read(&key("a")), kept);
        fs::copy(files.path(&key("a")), files.path(&key("b"))).unwrap();
        assert_eq!(files.read(&key("b")), Kept::empty(key("b")), "a file of another key");
        fs::write(files.path(&key("a")), b"{\"key\":").unwrap();
        assert_eq!(files.read(&key("a")), Kept::empty(key("a")), "a damaged file");
        fs::remove_file(files.path(&key("a"))).unwrap();
        fs::create_dir(files.path(&key("a"))).unwrap();
        assert_eq!(files.read(&key("a")), Kept::empty(key("a")), "no file");
    }

    #[test]
    fn the_oldest_files_make_room() {
        let folder = tempfile::tempdir().unwrap();
        let files = PlanFiles::at(folder.path().to_owned());
        for (age_s, scene) in [(20, "old"), (10, "new")] {
            files.write(&Kept::empty(key(scene))).unwrap();
            let file = fs::File::options().append(true).open(files.path(&key(scene))).unwrap();
            file.set_len(MAX_KEPT_BYTES as u64 / 2).unwrap();
            file.set_modified(SystemTime::now() - std::time::Duration::from_secs(age_s)).unwrap();
        }
        files.write(&Kept::empty(key("newest"))).unwrap();
        let exists = ["old", "new", "newest"].map(|scene| files.path(&key(scene)).exists());
        assert_eq!(exists, [false, true, true]);
    }
}
