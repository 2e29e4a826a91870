//! The page in headless Chromium: measures its layout and takes screenshots at phone and desktop widths,
//! light and dark. The screenshots are kept in `target/tmp/page/` for inspection.

use super::family::{BARS, FAILS, MANY, SWEPT};
use super::*;
use ortelius::figure::Changes;
use ortelius::picture::write::{Srgb8Picture, read_png};
use std::path::PathBuf;
use std::process::Command;

const NAMES: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The path of the browser. `None` if there is no browser and the user allows to skip the check.
fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("ORTELIUS_BROWSER").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut places = std::env::split_paths(&path).flat_map(|folder| NAMES.map(|name| folder.join(name)));
    let found = named.or_else(|| places.find(|place| place.is_file()));
    let allowed = std::env::var_os("ORTELIUS_ALLOW_NO_BROWSER").is_some_and(|value| value == "1");
    let ci = std::env::var_os("CI").is_some_and(|value| value == "true");
    if found.is_none() {
        assert!(
            allowed && !ci,
            "no browser ({}) in PATH: install Chromium, name one in ORTELIUS_BROWSER, or skip the check of the page \
             with ORTELIUS_ALLOW_NO_BROWSER=1",
            NAMES.join(", ")
        );
        eprintln!("NOT RUN: no browser found, and ORTELIUS_ALLOW_NO_BROWSER=1");
    }
    found
}

/// A page with every element.
fn page(folder: &Path) {
    let figures = [&SWEPT, &BARS, &MANY, &FAILS];
    let results = reported(&figures, folder);
    let mut before = results.clone();
    before.figures[0].claims[0].finding.verdict = ortelius::figure::Verdict::InPart;
    for cell in &mut before.figures[2].cells {
        if let ortelius::figure::CellOutcome::Rows(rows) = &mut cell.outcome {
            rows.iter_mut().for_each(|row| row.unit = "s".into());
        }
    }
    let changes = Changes::between(&before, &results);
    assert!(!changes.claims.is_empty() && changes.values.len() > 50);
    let store = Store::at(folder);
    write_outputs(&store, &figures, &results, &store.all(&figures).unwrap(), &[], Some(&changes)).unwrap();
}

fn run_browser(browser: &Path, folder: &Path, arguments: &[&str], page: &str) -> String {
    let page = format!("file://{}", folder.join(page).display());
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let ran = Command::new(browser)
        // Root, as in containers, has no sandbox. The only page is our own.
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"])
        .args(["--no-first-run", "--virtual-time-budget=4000", &profile])
        .args(arguments)
        .arg(page)
        .env("HOME", folder)
        .output()
        .unwrap_or_else(|error| panic!("{}: {error}", browser.display()));
    assert!(ran.status.success(), "{}: {}", browser.display(), String::from_utf8_lossy(&ran.stderr));
    String::from_utf8(ran.stdout).unwrap()
}

/// Window widths at which the layout is measured.
const WIDTHS: [u32; 4] = [320, 390, 768, 1280];

/// Measures five numbers in each frame: the pixels by which the page exceeds the frame, the smallest letters in plots
/// (hundredths of a pixel), the texts outside their plot, the plots, and the opened tables.
const MEASURE: &str = "<script>onload = () => {
  const found = [...document.querySelectorAll('iframe')].map(frame => {
    const page = frame.contentDocument, root = page.documentElement;
    const plots = [...page.querySelectorAll('svg.plot')];
    const letters = plots.map(plot => 12 * plot.getBoundingClientRect().width / plot.viewBox.baseVal.width);
    const outside = plots.flatMap(plot => [...plot.querySelectorAll('text')].filter(text => {
      const box = text.getBBox(), edge = plot.viewBox.baseVal;
      return box.x < -1 || box.x + box.width > edge.width + 1 || box.y < -1 || box.y + box.height > edge.height + 1;
    })).map(text => text.textContent.replace(/[<>&|]/g, ''));
    const tables = page.querySelectorAll('details[open] table').length;
    return [root.scrollWidth - frame.clientWidth, Math.floor(100 * Math.min(...letters)), plots.length, tables,
      outside.join('/')].join('|');
  });
  document.getElementById('found').textContent = found.join('\\n');
};</script>";

#[test]
fn the_page_fits_its_window_and_no_text_leaves_its_plot() {
    let Some(browser) = browser() else { return };
    let folder = folder();
    page(folder.path());
    let frame =
        |width| format!("<iframe src='index.html' style='width:{width}px;height:900px;border:0'></iframe>");
    let frames: String = WIDTHS.iter().map(frame).collect();
    std::fs::write(folder.path().join("frames.html"), format!("{frames}<pre id='found'></pre>{MEASURE}"))
        .unwrap();
    let text = run_browser(
        &browser,
        folder.path(),
        &["--dump-dom", "--allow-file-access-from-files", "--window-size=1400,1000"],
        "frames.html",
    );
    let found = text.split("<pre id=\"found\">").nth(1).and_then(|rest| rest.split("</pre>").next());
    let found: Vec<&str> = found.unwrap_or_else(|| panic!("no measurement in {text}")).lines().collect();
    assert_eq!(found.len(), WIDTHS.len(), "{found:?}");
    for (width, line) in WIDTHS.iter().zip(found) {
        let parts: Vec<&str> = line.split('|').collect();
        let number = |at: usize| parts[at].parse::<i64>().unwrap_or_else(|_| panic!("{line}"));
        assert_eq!(number(0), 0, "at {width} pixels the page is {} wider than its window", number(0));
        // 7 CSS pixels are the smallest letters that are readable on a phone without zooming.
        assert!(number(1) >= 700, "at {width} pixels letters of {} hundredths", number(1));
        assert_eq!((number(2), number(3)), (16, 4), "plots and open tables at {width} pixels");
        assert_eq!(parts[4], "", "at {width} pixels these texts leave their plots");
    }
}

/// Measures each plot of a stored page: its texts that leave the drawing, end in an ellipsis, or overlap another text.
/// A text's box is as high as its line, which is more than its letters, so 3 units of overlap are allowed.
const READ: &str = "<script>onload = () => {
  const found = [...document.querySelectorAll('svg.plot')].flatMap(plot => {
    const edge = plot.viewBox.baseVal, name = plot.getAttribute('aria-label');
    const texts = [...plot.querySelectorAll('text')].map(text => [text.textContent, text.getBBox()]);
    const wrong = texts.flatMap(([text, box], at) => {
      const outside = box.x < -1 || box.x + box.width > edge.width + 1 || box.y < -1
        || box.y + box.height > edge.height + 1;
      const over = texts.slice(at + 1).find(([, other]) =>
        Math.min(box.x + box.width, other.x + other.width) - Math.max(box.x, other.x) > 1
        && Math.min(box.y + box.height, other.y + other.height) - Math.max(box.y, other.y) > 3);
      return [outside && 'outside: ' + text, text.includes('…') && 'cut: ' + text,
        over && 'overlap: ' + text + ' / ' + over[0]].filter(kind => kind);
    });
    return wrong.map(text => (name + ': ' + text).replace(/[<>&]/g, ''));
  });
  const result = document.createElement('pre');
  result.id = 'found';
  result.textContent = document.querySelectorAll('svg.plot').length + ' plots\\n' + found.join('\\n');
  document.body.append(result);
};</script>";

/// The number of plots of a page, and what is wrong with their texts.
fn unreadable(browser: &Path, folder: &Path, page: &str) -> (usize, Vec<String>) {
    std::fs::write(folder.join("stored.html"), page.replace("</body>", &format!("{READ}</body>"))).unwrap();
    let text = run_browser(browser, folder, &["--dump-dom", "--window-size=1280,1000"], "stored.html");
    let found = text.split("<pre id=\"found\">").nth(1).and_then(|rest| rest.split("</pre>").next());
    let mut lines = found.unwrap_or_else(|| panic!("no measurement in {text}")).lines();
    let plots = lines.next().and_then(|line| line.strip_suffix(" plots")?.parse().ok()).unwrap();
    (plots, lines.map(String::from).collect())
}

#[test]
fn every_text_of_the_stored_figures_is_readable() {
    let Some(browser) = browser() else { return };
    let known = ortelius::figure::choose(&ortelius::renderer::figures::FAMILIES, &[]).unwrap();
    let mut wrong = Vec::new();
    for file in super::committed::files() {
        let text = std::fs::read_to_string(&file).unwrap();
        let (page, _) = ortelius::figure::page_of_results(&Results::parse(&text).unwrap(), &known).unwrap();
        let folder = folder();
        let (plots, found) = unreadable(&browser, folder.path(), &page);
        assert_eq!(plots, page.matches("class=\"plot\"").count(), "{}", file.display());
        let stem = file.file_stem().unwrap().to_string_lossy().into_owned();
        wrong.extend(found.into_iter().map(|text| format!("{stem}: {text}")));
    }
    assert!(wrong.is_empty(), "{} texts:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn a_text_outside_its_plot_a_cut_one_and_two_that_overlap_are_found() {
    let Some(browser) = browser() else { return };
    let folder = folder();
    let text = |x: u32, text: &str| format!("<text x='{x}' y='20'>{text}</text>");
    let [left, over, right, cut] =
        [(0, "left"), (5, "over"), (390, "leaves the plot"), (200, "cut…")].map(|(x, words)| text(x, words));
    let svg = format!(
        "<body><svg class=\"plot\" aria-label=\"p\" viewBox=\"0 0 440 40\">{left}{over}{right}{cut}</svg></body>"
    );
    let (plots, found) = unreadable(&browser, folder.path(), &svg);
    assert_eq!(plots, 1);
    assert_eq!(found, ["p: overlap: left / over", "p: outside: leaves the plot", "p: cut: cut…"]);
}

fn screenshot(browser: &Path, folder: &Path, name: &str, size: &str, dark: bool) -> Srgb8Picture {
    let file = folder.join(format!("{name}.png"));
    let scheme = format!("--blink-settings=preferredColorScheme={}", if dark { 0 } else { 1 });
    let shot = format!("--screenshot={}", file.display());
    run_browser(browser, folder, &[&scheme, &shot, &format!("--window-size={size}")], "index.html");
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("page");
    std::fs::create_dir_all(&kept).unwrap();
    std::fs::copy(&file, kept.join(format!("{name}.png"))).unwrap();
    read_png(&file).unwrap()
}

fn pixels(picture: &Srgb8Picture, colour: u32) -> usize {
    let rgb = [(colour >> 16) as u8, (colour >> 8) as u8, colour as u8];
    picture.rgba.chunks_exact(4).filter(|pixel| pixel[..3] == rgb).count()
}

/// Colours of `page.css` and `plot.css`: paper, ink, verdicts (yes, part, no), first and last hue, bars.
const LIGHT: [u32; 8] = [0xffffff, 0x1c2126, 0x1a7f4b, 0x8a6100, 0xb3261e, 0x0068a8, 0x5a6066, 0x3b7fb5];
const DARK: [u32; 8] = [0x14181c, 0xe8ebee, 0x4cc38a, 0xe5b53c, 0xff8a80, 0x5cb3ee, 0xc3c9cf, 0x5a9fd4];

#[test]
fn the_page_shows_its_colours_on_phone_and_desk_light_and_dark() {
    let Some(browser) = browser() else { return };
    let folder = folder();
    page(folder.path());
    for (place, size, width) in [("phone", "390,9000", 390), ("desk", "1280,6000", 1280)] {
        for (scheme, colours, others) in [("light", LIGHT, DARK), ("dark", DARK, LIGHT)] {
            let name = format!("{place}-{scheme}");
            let picture = screenshot(&browser, folder.path(), &name, size, scheme == "dark");
            assert_eq!(picture.width, width, "{name}");
            let whole = (picture.width * picture.height) as usize;
            // Most pixels are paper; letters, badges, lines and bars have the colours of this scheme, and hardly any
            // pixel has a colour of the other scheme.
            assert!((whole / 2..whole * 99 / 100).contains(&pixels(&picture, colours[0])), "{name}: paper");
            for (n, colour) in colours.into_iter().enumerate().skip(1) {
                assert!(pixels(&picture, colour) >= 20, "{name}: colour {n} is nowhere");
                // Antialiased edges of letters have many colours.
                let (own, other) = (pixels(&picture, colour), pixels(&picture, others[n]));
                assert!(
                    other * 4 < own,
                    "{name}: colour {n}: {own} pixels, and {other} of the other scheme's"
                );
            }
            // Nothing crosses the right edge of the window.
            let right = picture.rgba.chunks_exact(4).skip(width as usize - 4).step_by(width as usize);
            let paper = (colours[0] >> 8) as u8;
            assert!(
                right.into_iter().all(|pixel| pixel[1] == paper),
                "{name}: something in the right margin"
            );
        }
    }
}
