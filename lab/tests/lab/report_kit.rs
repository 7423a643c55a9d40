//! Every kind of plot on one page. `MONORIG_GALLERY=FILE` also writes it, to be looked at.

use monorig_lab::reports::page::{Page, Section};
use monorig_lab::reports::plot::axis::Axis;
use monorig_lab::reports::plot::boxes::Boxes;
use monorig_lab::reports::plot::cdf::Cdf;
use monorig_lab::reports::plot::consistency::Consistency;
use monorig_lab::reports::plot::history::History;
use monorig_lab::reports::plot::line::{Band, Line, LineChart};
use monorig_lab::reports::plot::pareto::Pareto;
use monorig_lab::reports::plot::scatter::Scatter;
use monorig_lab::reports::plot::theme::Ink;
use monorig_lab::reports::plot::{Figure, ValueGroup};
use monorig_lab::reports::table::{Cell, Table};
use monorig_lab::verdicts::judgement::Grade;

/// Numbers that look like chance, −1 … 1.
fn noise(i: usize) -> f64 {
    let x = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn bell(i: usize) -> f64 {
    (0..6).map(|k| noise(6 * i + k)).sum::<f64>() / 2f64.sqrt()
}

fn lines() -> Figure {
    let times: Vec<f64> = (0..20_000).map(|i| i as f64 * 0.005).collect();
    let truth = |t: f64| 8.0 / (1.0 + (-(t - 50.0) / 4.0).exp());
    let sd = |t: f64| 0.2 + 3.0 * (-t / 15.0).exp();
    let at = |f: &dyn Fn(usize, f64) -> f64| {
        let rows = times.iter().enumerate();
        rows.map(|(i, &t)| (t, f(i, t))).collect::<Vec<_>>()
    };
    let estimate = |i: usize, t: f64| truth(t) + 0.5 * sd(t) * bell(i);
    let mut chart = LineChart::new("Slope", Axis::linear("time, s"), Axis::linear("slope, °"));
    chart.note = "Band: ± 2 standard deviations.".into();
    chart.bands.push(Band {
        name: "± 2 σ".into(),
        ink: Ink::Series(0),
        rows: times
            .iter()
            .map(|&t| (t, truth(t) - 2.0 * sd(t), truth(t) + 2.0 * sd(t)))
            .collect(),
    });
    chart.shades = Some(("not valid".into(), vec![(0.0, 12.0), (70.0, 75.0)]));
    chart
        .lines
        .push(Line::new("estimate", Ink::Series(0), at(&estimate)));
    chart
        .lines
        .push(Line::new("truth", Ink::Text, at(&|_, t| truth(t))));
    chart.figure()
}

fn groups(n: usize) -> Vec<ValueGroup<f64>> {
    let of = |k: usize| {
        let sd = 0.1 + 0.05 * k as f64;
        (0..n).map(|i| sd * bell(i + 9999 * k)).collect()
    };
    let names = ["dffrls_aekf_robust", "rail_fusion", "imm <stf> & co"].iter();
    let names = names.enumerate();
    names
        .map(|(k, n)| ValueGroup::new(*n, Ink::series(k), of(k)))
        .collect()
}

fn run_plots() -> Section {
    let mut absolute = groups(2000);
    for group in &mut absolute {
        group.values.iter_mut().for_each(|x| *x = x.abs());
    }
    let squares = |mean_of: usize| Consistency {
        title: format!("Consistency over {mean_of}"),
        y: "NIS".into(),
        groups: vec![ValueGroup::new(
            "ukf",
            Ink::Series(0),
            (0..5000)
                .map(|i| (i as f64 * 0.02, bell(i).powi(2)))
                .collect(),
        )],
        mean_of,
        happenings: Vec::new(),
    };
    Section::new("Runs")
        .figure(lines())
        .figure(
            Cdf {
                title: "Errors".into(),
                x: Axis::linear("|slope error|, °"),
                groups: absolute,
            }
            .figure(),
        )
        .figure(
            Boxes {
                title: "Errors".into(),
                y: Axis::linear("slope error, °"),
                groups: groups(50),
                references: vec![("published".into(), 1, 0.1)],
                bounds: vec![(0, 0.2)],
            }
            .figure(),
        )
        .figure(squares(1).figure())
        .figure(squares(50).figure())
}

fn search_plots() -> Section {
    let bowl = |x: f64, y: f64| (x - 0.97).powi(2) * 400.0 + (y.log10() + 2.0).powi(2) + 0.1;
    let candidates: Vec<(Vec<f64>, f64)> = (0..300)
        .map(|i| {
            let (x, y) = (
                0.95 + 0.05 * noise(3 * i),
                10f64.powf(-2.0 + 2.0 * noise(3 * i + 1)),
            );
            let score = if i % 40 == 7 { f64::NAN } else { bowl(x, y) };
            (vec![x, y, noise(3 * i + 2)], score)
        })
        .collect();
    let scores: Vec<f64> = candidates.iter().map(|c| c.1).collect();
    let mut scatter = Scatter::new(
        "Score over λ₀",
        Axis::linear("λ₀"),
        Axis::log("slope RMSE, °"),
    );
    scatter.groups.push(ValueGroup::new(
        "trial",
        Ink::Series(0),
        candidates.iter().map(|c| (c.0[0], c.1)).collect(),
    ));
    Section::new("Searches")
        .figure(
            History {
                title: "Search".into(),
                y: Axis::linear("slope RMSE, °"),
                scores,
                references: vec![("published constants".into(), 0.5)],
            }
            .figure(),
        )
        .figure(scatter.figure())
        .figure(
            Pareto {
                title: "Two scores".into(),
                x: Axis::linear("slope RMSE, °"),
                y: Axis::linear("mass error, %"),
                candidates: candidates
                    .iter()
                    .map(|c| (c.1, 0.3 + (c.0[0] - 0.93).abs() * 60.0 + 0.2 / c.1))
                    .collect(),
                named: vec![("published".into(), (1.0, 1.5))],
            }
            .figure(),
        )
}

fn page() -> Page {
    let mut table = Table::new(&["expected"], &["bound", "measured"]);
    table.row([
        "a < b & c".into(),
        "≤ 0.1".into(),
        Cell::number(0.05).judged(true),
    ]);
    let mut page = Page::new("Gallery <of> \"plots\" & more");
    page.banner = Some(("All 2 expectations held".into(), Grade::Held));
    page.sections
        .push(Section::new("Verdicts").text("x < y").table(table));
    page.sections.push(run_plots());
    page.sections.push(search_plots());
    page
}

/// Reads a page as XML, which is stricter than HTML: names of its elements, and all its text.
fn parse(html: &str) -> (Vec<String>, String) {
    use quick_xml::events::Event;
    let mut reader = quick_xml::Reader::from_str(html);
    let (mut open, mut seen, mut text) = (Vec::new(), Vec::new(), String::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Start(e) => {
                for a in e.attributes() {
                    a.unwrap()
                        .normalized_value(quick_xml::XmlVersion::Explicit1_0)
                        .unwrap();
                }
                open.push(String::from_utf8(e.name().as_ref().to_vec()).unwrap());
                seen.extend(open.last().cloned());
            }
            Event::Empty(e) => {
                e.attributes().for_each(|a| drop(a.unwrap()));
                seen.push(String::from_utf8(e.name().as_ref().to_vec()).unwrap());
            }
            Event::End(e) => assert_eq!(open.pop().unwrap().as_bytes(), e.name().as_ref()),
            Event::Text(t) => text += &t.decode().unwrap(),
            Event::GeneralRef(r) => {
                let name = r.decode().unwrap().into_owned();
                text += match name.as_str() {
                    "amp" => "&",
                    "lt" => "<",
                    "gt" => ">",
                    "quot" => "\"",
                    "#39" => "'",
                    other => panic!("&{other};"),
                };
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    (seen, text)
}

#[test]
fn a_page_is_well_formed_self_contained_and_always_the_same() {
    let html = page().to_html();
    if let Some(path) = std::env::var_os("MONORIG_GALLERY") {
        std::fs::write(path, &html).unwrap();
    }
    assert_eq!(html, page().to_html());
    let (elements, text) = parse(&html);
    let figures = elements.iter().filter(|e| *e == "figure").count();
    assert_eq!(figures, 8);
    assert!(!text.contains("no data"), "a plot is missing");
    for part in [
        "Gallery <of> \"plots\" & more",
        "imm <stf> & co",
        "a < b & c",
    ] {
        assert!(text.contains(part), "{part}");
    }
    for outside in [
        "http:", "https:", "src=", "url(", "@import", "<script", "NaN",
    ] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
}

#[test]
fn a_plot_without_numbers_says_so() {
    let nan = vec![f64::NAN; 3];
    let group = || vec![ValueGroup::new("a", Ink::Series(0), nan.clone())];
    let axis = || Axis::linear("x");
    let figures = [
        Cdf {
            title: "t".into(),
            x: axis(),
            groups: group(),
        }
        .figure(),
        Boxes {
            title: "t".into(),
            y: axis(),
            groups: group(),
            references: vec![],
            bounds: vec![],
        }
        .figure(),
        Boxes {
            title: "t".into(),
            y: axis(),
            groups: vec![],
            references: vec![],
            bounds: vec![],
        }
        .figure(),
        Consistency {
            title: "t".into(),
            y: "y".into(),
            groups: vec![ValueGroup::new("a", Ink::Series(0), vec![(0.0, f64::NAN)])],
            mean_of: 1,
            happenings: Vec::new(),
        }
        .figure(),
        History {
            title: "t".into(),
            y: axis(),
            scores: nan.clone(),
            references: vec![],
        }
        .figure(),
        Scatter::new("t", axis(), axis()).figure(),
        Pareto {
            title: "t".into(),
            x: axis(),
            y: axis(),
            candidates: vec![(f64::NAN, 1.0)],
            named: vec![],
        }
        .figure(),
    ];
    for (i, figure) in figures.into_iter().enumerate() {
        assert!(figure.svg.is_none(), "plot {i}");
        let mut page = Page::new("t");
        page.sections.push(Section::new("s").figure(figure));
        assert!(parse(&page.to_html()).1.contains("no data"), "plot {i}");
    }
}
