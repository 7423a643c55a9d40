//! Shortening long series without a visible change.

/// A line of many points reduced to what a drawing `columns` wide can show: of each column the first, least, greatest
/// and last value. A value that is not finite breaks the line, and stays as one.
pub(crate) fn line(points: &[(f64, f64)], range: (f64, f64), columns: usize) -> Vec<(f64, f64)> {
    let mut out = Vec::new();
    let mut column: Vec<(f64, f64)> = Vec::new();
    let mut here = None;
    for &(x, y) in points {
        let good = x.is_finite() && y.is_finite();
        let there = good.then(|| place(x, range, columns));
        if there != here {
            flush(&mut column, &mut out);
            here = there;
            if !good {
                out.push((f64::NAN, f64::NAN));
            }
        }
        if good {
            column.push((x, y));
        }
    }
    flush(&mut column, &mut out);
    out
}

fn place(x: f64, (from, to): (f64, f64), columns: usize) -> i64 {
    ((x - from) / (to - from) * columns as f64).floor() as i64
}

fn flush(column: &mut Vec<(f64, f64)>, out: &mut Vec<(f64, f64)>) {
    let n = column.len();
    if n <= 4 {
        out.append(column);
        return;
    }
    let by = |a: &usize, b: &usize| column[*a].1.total_cmp(&column[*b].1);
    let least = (0..n).min_by(by).unwrap_or(0);
    let greatest = (0..n).max_by(by).unwrap_or(0);
    let mut keep = [0, least, greatest, n - 1];
    keep.sort_unstable();
    let mut last = None;
    for i in keep {
        if last != Some(i) {
            out.push(column[i]);
            last = Some(i);
        }
    }
    column.clear();
}

/// A band `(x, low, high)` reduced in the same way: of each column the least low and the greatest high. Rows that are
/// not finite part it; the parts come one by one.
pub(crate) fn band(
    rows: &[(f64, f64, f64)],
    range: (f64, f64),
    columns: usize,
) -> Vec<Vec<(f64, f64, f64)>> {
    let mut parts: Vec<Vec<(f64, f64, f64)>> = Vec::new();
    let mut here = None;
    for &(x, low, high) in rows {
        if !(x.is_finite() && low.is_finite() && high.is_finite()) {
            here = None;
            continue;
        }
        let there = place(x, range, columns);
        match (here, parts.last_mut()) {
            (None, _) | (_, None) => parts.push(vec![(x, low, high)]),
            (Some(h), Some(part)) if h == there => {
                if let Some(last) = part.last_mut() {
                    *last = (last.0, last.1.min(low), last.2.max(high));
                }
            }
            (Some(_), Some(part)) => part.push((x, low, high)),
        }
        here = Some(there);
    }
    parts
}

/// Cut a line where it leaves `low`…`high`, and break it where it is not finite: the pieces inside.
pub(crate) fn inside(points: &[(f64, f64)], low: f64, high: f64) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = vec![Vec::new()];
    let mut before: Option<(f64, f64)> = None;
    for &(x, y) in points {
        if !(x.is_finite() && y.is_finite()) {
            before = None;
            pieces.push(Vec::new());
            continue;
        }
        let is_in = (low..=high).contains(&y);
        if let Some((x0, y0)) = before {
            let was_in = (low..=high).contains(&y0);
            let at = |edge: f64| (x0 + (edge - y0) / (y - y0) * (x - x0), edge);
            if was_in != is_in {
                // one end is inside: the crossing is at the border the other end lies beyond
                let out = if is_in { y0 } else { y };
                let crossing = at(if out > high { high } else { low });
                if is_in {
                    pieces.push(vec![crossing]);
                } else if let Some(piece) = pieces.last_mut() {
                    piece.push(crossing);
                }
            } else if !is_in && (y0 > high) != (y > high) {
                // right through
                let (a, b) = if y > high { (low, high) } else { (high, low) };
                pieces.push(vec![at(a), at(b)]);
            }
        }
        if is_in && let Some(piece) = pieces.last_mut() {
            piece.push((x, y));
        }
        if !is_in {
            pieces.push(Vec::new());
        }
        before = Some((x, y));
    }
    pieces.retain(|p| !p.is_empty());
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_line_keeps_its_peaks_and_its_ends() {
        let points: Vec<(f64, f64)> = (0..100_000)
            .map(|i| (i as f64, if i == 54_321 { 9.0 } else { (i % 7) as f64 }))
            .collect();
        let short = line(&points, (0.0, 1e5), 500);
        assert!(short.len() <= 2000, "{}", short.len());
        assert!(short.contains(&(54_321.0, 9.0)));
        assert_eq!(
            (short[0], short[short.len() - 1]),
            (points[0], points[99_999])
        );
        assert!(short.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn gaps_stay_gaps() {
        let nan = f64::NAN;
        let points = [(0.0, 1.0), (1.0, nan), (2.0, nan), (3.0, 1.0)];
        let short = line(&points, (0.0, 3.0), 1);
        assert_eq!(short.iter().filter(|p| p.1.is_nan()).count(), 1);
        assert_eq!(inside(&short, 0.0, 2.0), [[(0.0, 1.0)], [(3.0, 1.0)]]);
        let rows = [(0.0, 0.0, 1.0), (1.0, nan, 1.0), (2.0, 0.0, 1.0)];
        assert_eq!(band(&rows, (0.0, 2.0), 100).len(), 2);
    }

    #[test]
    fn a_band_keeps_its_width() {
        let rows = [(0.0, -1.0, 1.0), (0.1, -3.0, 0.0), (0.2, 0.0, 2.0)];
        assert_eq!(band(&rows, (0.0, 1.0), 1), [[(0.0, -3.0, 2.0)]]);
    }

    #[test]
    fn a_line_is_cut_where_it_leaves() {
        let points = [(0.0, 0.0), (1.0, 2.0), (2.0, 0.0), (3.0, -3.0), (4.0, 3.0)];
        let pieces = inside(&points, -1.0, 1.0);
        assert_eq!(pieces[0], [(0.0, 0.0), (0.5, 1.0)]);
        assert_eq!(pieces[1][0], (1.5, 1.0));
        assert_eq!(pieces[1][1], (2.0, 0.0));
        let last = &pieces[2];
        assert_eq!((last[0].1, last[1].1, last.len()), (-1.0, 1.0, 2));
        assert!(inside(&[(0.0, 5.0), (1.0, 6.0)], -1.0, 1.0).is_empty());
    }
}
