//! The commands of docs/github-actions.yml.

use super::*;

#[test]
fn the_commands_of_the_github_actions_example_run_and_write_what_it_uploads() {
    let example = include_str!("../../docs/github-actions.yml");
    let folder = folder();
    std::fs::create_dir(folder.path().join("mine")).unwrap();
    write(&folder, "mine/scene.toml", &small_scene(SYNTHETIC));
    let commands = example.lines().filter_map(|line| line.trim().strip_prefix("- run: ortelius "));
    let commands: Vec<Vec<&str>> = commands.map(|command| command.split(' ').collect()).collect();
    assert_eq!(
        commands.iter().map(|command| command[0]).collect::<Vec<_>>(),
        ["doctor", "render", "reproduce"]
    );
    for command in &commands {
        // The whole figure takes 20 s, so only the last cell runs. Its model, the dragon, is absent: --fail-on applies.
        let is_figure = command[0] == "reproduce";
        let part: &[&str] = if is_figure { &["--partition", "6/6"] } else { &[] };
        let mut command = ortelius(&folder, &[command, part].concat());
        let ran = command.env("XDG_DATA_HOME", folder.path()).output().unwrap();
        let words = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(i32::from(is_figure)), "{command:?}: {words}");
        assert!(!is_figure || words.contains("--fail-on: 3 claims not measured"), "{words}");
    }
    let (_, uploaded) = example.rsplit_once("path: |\n").unwrap();
    let uploaded: Vec<&str> = uploaded.lines().map(str::trim).collect();
    assert_eq!(uploaded.len(), 4, "{uploaded:?}");
    for path in uploaded {
        assert!(folder.path().join(path).exists(), "{path}");
    }
}
