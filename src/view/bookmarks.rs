//! Bookmarks 1 to 9 of each scene. They are saved in `ortelius/bookmarks.toml` in the user's configuration
//! folder. Its table `[SCENE]` has one camera for each digit, in the format of scene files.

use anyhow::{Context, anyhow};
use ortelius::file::{MAX_RESULTS_BYTES, read_text};
use ortelius::scene::Scene;
use ortelius::scene::camera::Camera;
use std::path::{Path, PathBuf};

/// The bookmarks of one scene. Without a saved bookmark, digit N is the scene's N-th camera.
pub struct Bookmarks {
    scene: String,
    path: Option<PathBuf>,
    cameras: [Option<Camera>; 9],
}

/// The name under which a camera is parsed.
const NAME: &str = "bookmark";

impl Bookmarks {
    /// Reads the saved bookmarks. The result reports the first unreadable bookmark; all readable ones are read.
    pub fn open(scene: &Scene) -> (Bookmarks, anyhow::Result<()>) {
        Bookmarks::at(path(|name| std::env::var_os(name).map(PathBuf::from)), scene)
    }

    fn at(path: Option<PathBuf>, scene: &Scene) -> (Bookmarks, anyhow::Result<()>) {
        let mut bookmarks = Bookmarks { scene: scene.name.clone(), path, cameras: [None; 9] };
        for (bookmark, camera) in bookmarks.cameras.iter_mut().zip(scene.cameras.values()) {
            *bookmark = Some(*camera);
        }
        let read = bookmarks.read(scene);
        (bookmarks, read)
    }

    pub fn get(&self, n: usize) -> anyhow::Result<Camera> {
        self.cameras[n]
            .ok_or_else(|| anyhow!("bookmark {0} is empty; Ctrl+{0} saves the current camera", n + 1))
    }

    fn read(&mut self, scene: &Scene) -> anyhow::Result<()> {
        let Some(path) = self.path.clone().filter(|path| path.exists()) else { return Ok(()) };
        let file = table(&path)?;
        let Some(own) = file.get(&self.scene).and_then(toml::Value::as_table) else { return Ok(()) };
        let mut read = Ok(());
        for (n, bookmark) in self.cameras.iter_mut().enumerate() {
            let Some(text) = own.get(&(n + 1).to_string()).and_then(toml::Value::as_str) else { continue };
            match scene.with(&[format!("cameras.{NAME}={text}")]) {
                Ok(with) => *bookmark = Some(with.cameras[NAME]),
                Err(error) => {
                    let context = format!("{}: [{}] {}", path.display(), self.scene, n + 1);
                    read = read.and(Err(anyhow::Error::new(error).context(context)));
                }
            }
        }
        read
    }

    /// Saves a camera. It is kept for this run even if writing the file fails.
    ///
    /// # Errors
    /// The file cannot be written. The error names the file, which is unchanged.
    pub fn save(&mut self, n: usize, camera: Camera) -> anyhow::Result<()> {
        self.cameras[n] = Some(camera);
        let unset = "neither XDG_CONFIG_HOME nor HOME is set: the bookmark is kept until the window closes";
        let path = self.path.as_ref().context(unset)?;
        let mut file = if path.exists() { table(path)? } else { toml::Table::new() };
        let own = file.entry(&self.scene).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        let own = own
            .as_table_mut()
            .with_context(|| format!("{}: {} is not a table", path.display(), self.scene))?;
        let change = camera.to_change(NAME);
        let (_, text) = change.split_once('=').expect("a change is KEY=VALUE");
        own.insert((n + 1).to_string(), toml::Value::String(text.to_owned()));
        write(path, &toml::to_string(&file)?)
            .with_context(|| format!("{}: the bookmark is kept until the window closes", path.display()))
    }
}

fn path(variable: impl Fn(&str) -> Option<PathBuf>) -> Option<PathBuf> {
    let config = variable("XDG_CONFIG_HOME").or_else(|| Some(variable("HOME")?.join(".config")))?;
    Some(config.join("ortelius/bookmarks.toml"))
}

fn table(path: &Path) -> anyhow::Result<toml::Table> {
    let text = read_text(path, MAX_RESULTS_BYTES).with_context(|| path.display().to_string())?;
    text.parse().with_context(|| format!("{}: not valid TOML; correct or remove the file", path.display()))
}

/// Writes the file atomically.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    std::fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    std::io::Write::write_all(&mut file, text.as_bytes())?;
    file.persist(path).map(drop).map_err(|error| error.error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_bookmark_is_read_by_the_next_run_and_other_scenes_keep_theirs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/ortelius/bookmarks.toml");
        let [globe, herd] = ["globe", "herd"].map(|name| Scene::embedded(name).unwrap());
        let open = |scene: &Scene| {
            let (bookmarks, read) = Bookmarks::at(Some(path.clone()), scene);
            read.unwrap();
            bookmarks
        };
        let camera = Camera { altitude_m: 1234.5678, ..*globe.cameras.values().next().unwrap() };
        open(&globe).save(6, camera).unwrap();
        let other = *herd.cameras.values().next().unwrap();
        open(&herd).save(6, other).unwrap();
        assert_eq!(open(&globe).get(6).unwrap(), camera);
        assert_eq!(open(&herd).get(6).unwrap(), other);
        assert!(open(&herd).get(8).unwrap_err().to_string().contains("Ctrl+9"));
        open(&globe).save(8, camera).unwrap();
        let saved = std::fs::read_to_string(&path).unwrap();
        let damaged: Vec<&str> = saved.lines().filter(|line| !line.starts_with("7 =")).collect();
        let damaged = damaged.join("\n").replace("[globe]", "[globe]\n7 = '{ latitude_deg = 900 }'");
        std::fs::write(&path, damaged).unwrap();
        let (bookmarks, read) = Bookmarks::at(Some(path.clone()), &globe);
        let words = format!("{:#}", read.unwrap_err());
        assert!(words.contains("bookmarks.toml: [globe] 7") && bookmarks.get(6).is_err(), "{words}");
        assert_eq!(bookmarks.get(8).unwrap(), camera, "a bookmark after the unreadable one");
        std::fs::write(&path, "no table").unwrap();
        let (mut bookmarks, read) = Bookmarks::at(Some(path.clone()), &globe);
        assert!(read.is_err());
        let refused = format!("{:#}", bookmarks.save(0, camera).unwrap_err());
        assert!(
            refused.contains("not valid TOML") && std::fs::read_to_string(&path).unwrap() == "no table",
            "{refused}"
        );
        std::fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink("/dev/null", &path).unwrap();
        let words = format!("{:#}", Bookmarks::at(Some(path), &globe).1.unwrap_err());
        assert!(words.contains("not a regular file"), "{words}");
    }
}
