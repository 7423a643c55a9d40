//! A Gaussian belief and its correction by a measurement: written once, used by every filter here.

use nalgebra::{SMatrix, SVector};

use crate::Real;
use crate::api::real::{ln, sqrt};
use crate::api::snapshot::{Archive, Blank, State, state, visit_symmetric};

/// A belief about `N` quantities: mean `x` and covariance `P` (symmetric, positive semi-definite).
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)] // or the compiler may put x behind P and store them so that the next step waits for the store to reach memory
pub struct Gaussian<const N: usize> {
    /// Mean.
    pub x: SVector<Real, N>,
    /// Covariance.
    pub P: SMatrix<Real, N, N>,
}

/// Correction of a belief about `N` numbers by a measurement of `M`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction<const M: usize, const N: usize> {
    /// Innovation: measured minus predicted.
    pub y: SVector<Real, M>,
    /// Innovation covariance S = H P Hᵀ + R, before the correction.
    pub S: SMatrix<Real, M, M>,
    /// Gain K = P Hᵀ S⁻¹.
    pub K: SMatrix<Real, N, M>,
    /// Normalised innovation squared yᵀ S⁻¹ y; of mean `M` when the filter is consistent.
    pub nis: Real,
    /// ln of the density of `y` under N(0, S).
    pub log_likelihood: Real,
}

/// ln 2π.
const LN_TWO_PI: Real = 1.837_877_066_409_345_5;

/// Gain K = P Hᵀ S⁻¹ with yᵀ S⁻¹ y.
struct Gain<const M: usize, const N: usize> {
    K: SMatrix<Real, N, M>,
    nis: Real,
    /// det S for one measurement, its root for several.
    size: Real,
}

impl<const M: usize, const N: usize> Gain<M, N> {
    /// Correction that the measurement made. ln of a size that [`gain`] let pass is finite.
    #[inline]
    fn correction(self, y: SVector<Real, M>, S: SMatrix<Real, M, M>) -> Correction<M, N> {
        let log_det = if M == 1 { 1.0 } else { 2.0 } * ln(self.size);
        Correction {
            y,
            S,
            K: self.K,
            nis: self.nis,
            log_likelihood: -0.5 * (self.nis + M as Real * LN_TWO_PI + log_det),
        }
    }
}

/// Lower triangular L with L Lᵀ = P, by outer products, in line (that of the library is a call and works in memory):
/// `None` if P is not positive definite. Only the lower triangle of P is read. What is left of P takes a division from
/// column to column, and the root, which is slow, waits for nothing and nothing waits for it.
#[inline(always)]
pub(crate) fn cholesky<const N: usize>(P: &SMatrix<Real, N, N>) -> Option<SMatrix<Real, N, N>> {
    let mut rest = *P;
    let mut L = SMatrix::<Real, N, N>::zeros();
    for j in 0..N {
        let pivot = *rest.get((j, j))?;
        (pivot > 0.0).then_some(())?;
        let column = SVector::<Real, N>::from_fn(|i, _| match rest.get((i, j)) {
            Some(p) if i >= j => *p,
            _ => 0.0,
        });
        rest -= (column / pivot) * column.transpose();
        L.set_column(j, &(column / sqrt(pivot)));
    }
    Some(L)
}

/// X with Lᵀ X = B.
#[inline]
pub(crate) fn solve_transposed<const N: usize, const M: usize>(
    L: &SMatrix<Real, N, N>,
    B: &SMatrix<Real, N, M>,
) -> Option<SMatrix<Real, N, M>> {
    let mut X = *B;
    for i in (0..N).rev() {
        let row = X.row(i) / *L.get((i, i))?;
        X.set_row(i, &row);
        for k in 0..i {
            let rest = X.row(k) - row * *L.get((i, k))?;
            X.set_row(k, &rest);
        }
    }
    Some(X)
}

/// X with L X = B.
#[inline]
pub(crate) fn solve<const N: usize, const M: usize>(
    L: &SMatrix<Real, N, N>,
    B: &SMatrix<Real, N, M>,
) -> Option<SMatrix<Real, N, M>> {
    let mut X = *B;
    for i in 0..N {
        let row = X.row(i) / *L.get((i, i))?;
        X.set_row(i, &row);
        for k in i + 1..N {
            let rest = X.row(k) - row * *L.get((k, i))?;
            X.set_row(k, &rest);
        }
    }
    Some(X)
}

/// `None` if S is not positive definite and finite or y is not finite.
#[inline]
fn gain<const M: usize, const N: usize>(
    y: &SVector<Real, M>,
    PHt: &SMatrix<Real, N, M>,
    S: &SMatrix<Real, M, M>,
) -> Option<Gain<M, N>> {
    let (K, nis, size) = if M == 1 {
        // One number needs no factor: a division instead of a root and two divisions.
        let s = S.trace();
        (s > 0.0).then_some(())?;
        (PHt / s, y.dot(y) / s, s)
    } else {
        let L = cholesky(S)?;
        let K = solve_transposed(&L, &solve(&L, &PHt.transpose())?)?.transpose();
        let whitened = solve(&L, y)?;
        (K, whitened.dot(&whitened), L.diagonal().product())
    };
    (nis.is_finite() && size > 0.0 && size.is_finite()).then_some(Gain { K, nis, size })
}

/// A h without the columns for which h is 0, usually most columns: added up in the order of the product.
#[inline(always)]
fn times_sparse<const N: usize>(A: &SMatrix<Real, N, N>, h: &SVector<Real, N>) -> SVector<Real, N> {
    let (mut product, [h]) = ([0.0; N], &h.data.0);
    for (column, h) in A.data.0.iter().zip(h) {
        if *h != 0.0 {
            for (sum, a) in product.iter_mut().zip(column) {
                *sum += a * h;
            }
        }
    }
    SVector::from(product)
}

/// The sum of the columns at these places, each times its value; a value of 0 counts for nothing.
#[inline(always)]
fn columns_by<const N: usize, const E: usize>(
    columns: &[[Real; N]; N],
    row: &[(usize, Real); E],
) -> [Real; N] {
    let mut sums = [0.0; N];
    for (place, a) in row {
        if *a != 0.0
            && let Some(column) = columns.get(*place)
        {
            for (sum, p) in sums.iter_mut().zip(column) {
                *sum += p * a;
            }
        }
    }
    sums
}

/// Returns true if every number is finite: 0 times it is then 0, and four products run side by side.
#[inline]
pub(crate) fn finite<const R: usize, const C: usize>(numbers: &SMatrix<Real, R, C>) -> bool {
    let (fours, rest) = numbers.data.0.as_flattened().as_chunks::<4>();
    let mut sums = [0.0; 4];
    for four in fours {
        for (sum, number) in sums.iter_mut().zip(four) {
            *sum += 0.0 * number;
        }
    }
    sums == [0.0; 4] && rest.iter().all(|number| number.is_finite())
}

/// The Joseph form with two products of an outer kind in place of two of full matrices: B = (I − K H) P = P − K (P
/// Hᵀ)ᵀ, P⁺ = B (I − K H)ᵀ + K R Kᵀ = B − (B Hᵀ − K R) Kᵀ. It is symmetric but for rounding.
#[inline(always)]
fn joseph<const M: usize, const N: usize>(
    P: &mut SMatrix<Real, N, N>,
    H: &SMatrix<Real, M, N>,
    R: &SMatrix<Real, M, M>,
    PHt: &SMatrix<Real, N, M>,
    K: &SMatrix<Real, N, M>,
) {
    if M == 1
        && let (Some(k), Some(ph)) = (K.data.0.first(), PHt.data.0.first())
    {
        // Products with one number each, and mostly most of H is 0.
        less_outer(P, k, ph);
        let [mut rest] = times_sparse(P, &H.row(0).transpose()).data.0;
        for (rest, k) in rest.iter_mut().zip(k) {
            *rest -= k * R.trace();
        }
        less_outer(P, &rest, k);
    } else {
        *P -= K * PHt.transpose();
        *P -= (*P * H.transpose() - K * R) * K.transpose();
    }
}

/// A ← A − a bᵀ.
#[inline(always)]
fn less_outer<const N: usize>(A: &mut SMatrix<Real, N, N>, a: &[Real; N], b: &[Real; N]) {
    for (column, b) in A.data.0.iter_mut().zip(b) {
        for (number, a) in column.iter_mut().zip(a) {
            *number -= a * b;
        }
    }
}

impl<const N: usize> Gaussian<N> {
    /// The belief with mean `x` and independent standard deviations `sd`.
    pub fn independent(x: SVector<Real, N>, sd: SVector<Real, N>) -> Self {
        Self {
            x,
            P: SMatrix::from_diagonal(&sd.component_mul(&sd)),
        }
    }

    /// Correction by an innovation `y` of a measurement with Jacobian `H` and noise `R`.
    ///
    /// Joseph form P⁺ = (I − K H) P (I − K H)ᵀ + K R Kᵀ (Bucy & Joseph 1968), which stays positive semi-definite for
    /// any gain; S is factored (Cholesky), never inverted. `None`, and nothing changed, if S is not positive definite.
    #[inline(always)]
    pub fn correct<const M: usize>(
        &mut self,
        y: SVector<Real, M>,
        H: &SMatrix<Real, M, N>,
        R: &SMatrix<Real, M, M>,
    ) -> Option<Correction<M, N>> {
        let PHt = self.P * H.transpose();
        let S = H * PHt + R;
        let gain = gain(&y, &PHt, &S)?;
        let (x, mut P) = (self.x + gain.K * y, self.P);
        joseph(&mut P, H, R, &PHt, &gain.K);
        *self = Self { x, P };
        self.symmetrise();
        Some(gain.correction(y, S))
    }

    /// Covariance P hᵀ of the state with a number that has the Jacobian row `h`.
    #[inline]
    pub(crate) fn covariance_with(&self, h: &SVector<Real, N>) -> SVector<Real, N> {
        times_sparse(&self.P, h)
    }

    /// [`Gaussian::correct`] by one number, for callers that need only the belief: innovation `y`, Jacobian row `h`,
    /// its `PHt` = P hᵀ, noise variance `r`.
    #[inline]
    pub(crate) fn update_known(
        &mut self,
        y: Real,
        h: &SVector<Real, N>,
        PHt: &SVector<Real, N>,
        r: Real,
    ) -> Option<()> {
        let (y, H, R) = (SVector::repeat(y), h.transpose(), SMatrix::repeat(r));
        let gain = gain(&y, PHt, &(H * PHt + R))?;
        self.x += gain.K * y;
        joseph(&mut self.P, &H, &R, PHt, &gain.K); // in its place: it may be large
        self.symmetrise();
        Some(())
    }

    /// P ← F P Fᵀ, where F is 1 but for its first three rows: `rows` holds the entries of F − 1 there, as place and
    /// value; entries of 0 fill a row up. Where the compiler knows the places, no product asks for them. What is below
    /// the diagonal is then right ([`Gaussian::symmetrise`] does the rest).
    #[inline]
    pub(crate) fn carry_sparse<const E: usize>(&mut self, rows: &[[(usize, Real); E]; 3]) {
        let columns = &mut self.P.data.0;
        // (F − 1) P
        let [first, second, third] = rows;
        let AP = [
            columns_by(columns, first),
            columns_by(columns, second),
            columns_by(columns, third),
        ];
        for (j, (row, own)) in rows.iter().zip(&AP).enumerate() {
            let Some(column) = columns.get_mut(j) else {
                continue;
            };
            let (changed, rest) = column.split_at_mut(N.min(3));
            let (own_changed, own_rest) = own.split_at(N.min(3));
            for ((carried, p), own) in AP.iter().zip(changed).zip(own_changed).skip(j) {
                // of (F − 1) P (F − 1)ᵀ
                let twice = row.iter().fold(0.0, |sum, (place, a)| {
                    sum + carried.get(*place).map_or(0.0, |ap| ap * a)
                });
                *p += carried.get(j).map_or(0.0, |carried| carried + own + twice);
            }
            for (p, own) in rest.iter_mut().zip(own_rest) {
                *p += own;
            }
        }
    }

    /// Multiplies the standard deviation of state `i` by `factor`; its correlations stay.
    #[inline]
    pub(crate) fn scale_sd(&mut self, i: usize, factor: Real) {
        for column in &mut self.P.data.0 {
            if let Some(p) = column.get_mut(i) {
                *p *= factor;
            }
        }
        for p in self.P.data.0.get_mut(i).into_iter().flatten() {
            *p *= factor;
        }
    }

    /// Sets the value and the variance of state `i`, without covariance with the others.
    #[inline]
    pub(crate) fn set_independent(&mut self, i: usize, x: Real, variance: Real) {
        for (j, column) in self.P.data.0.iter_mut().enumerate() {
            for (k, p) in column.iter_mut().enumerate() {
                if j == i || k == i {
                    *p = if j == k { variance } else { 0.0 };
                }
            }
        }
        if let Some(own) = self.x.get_mut(i) {
            *own = x;
        }
    }

    /// [`Gaussian::correct`] from a factor `L` of P = L Lᵀ and the measurement as `G` = H L: by the Joseph form, P⁺ =
    /// (L − K G)(L − K G)ᵀ + K R Kᵀ, and H is not needed.
    #[inline(always)]
    pub(crate) fn correct_factored<const M: usize>(
        &mut self,
        y: SVector<Real, M>,
        L: &SMatrix<Real, N, N>,
        G: &SMatrix<Real, M, N>,
        R: &SMatrix<Real, M, M>,
    ) -> Option<Correction<M, N>> {
        let PHt = L * G.transpose();
        let S = G * G.transpose() + R;
        let gain = gain(&y, &PHt, &S)?;
        let left = L - gain.K * G;
        self.x += gain.K * y;
        self.P = left * left.transpose() + gain.K * R * gain.K.transpose();
        self.symmetrise();
        Some(gain.correction(y, S))
    }

    /// Correction by one number: innovation `y`, Jacobian row `h`, noise variance `r`.
    #[inline]
    pub fn correct_scalar(
        &mut self,
        y: Real,
        h: &SVector<Real, N>,
        r: Real,
    ) -> Option<Correction<1, N>> {
        self.correct(SVector::repeat(y), &h.transpose(), &SMatrix::repeat(r))
    }

    /// Removes the asymmetry that rounding leaves: what is below the diagonal stands for both.
    #[inline]
    pub(crate) fn symmetrise(&mut self) {
        self.P.fill_upper_triangle_with_lower_triangle();
    }

    /// Limits each variance to `most`, keeping every correlation (P ← D P D with a diagonal D ≤ 1).
    /// Returns true if a limit acted.
    #[inline]
    pub fn limit_variance(&mut self, most: &SVector<Real, N>) -> bool {
        let variance = self.P.diagonal();
        if variance.iter().zip(most).all(|(now, most)| now <= most) {
            return false;
        }
        let shrink = variance.zip_map(most, |now, most| {
            if now > most && now > 0.0 {
                crate::api::real::sqrt(most / now)
            } else {
                1.0
            }
        });
        if shrink.iter().all(|s| *s >= 1.0) {
            return false;
        }
        self.P.component_mul_assign(&(shrink * shrink.transpose())); // D P D, symmetric to the last bit
        true
    }

    /// Returns true if every number of the belief is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        finite(&self.x) && finite(&self.P)
    }
}

/// The covariance is symmetric to the last bit, so a snapshot has its lower triangle only.
impl<const N: usize> State for Gaussian<N> {
    fn visit(&mut self, archive: &mut Archive) {
        self.x.visit(archive);
        visit_symmetric(&mut self.P, archive);
        archive.require(is_covariance(&self.P));
    }
}
impl<const M: usize, const N: usize> Blank for Correction<M, N> {
    fn blank() -> Self {
        Self {
            y: SVector::zeros(),
            S: SMatrix::zeros(),
            K: SMatrix::zeros(),
            nis: 0.0,
            log_likelihood: 0.0,
        }
    }
}

state!(@[const M: usize, const N: usize] Correction<M, N> { y, S, K, nis, log_likelihood; });

/// Returns true if `P` can be a covariance: symmetric and positive semi-definite, to rounding.
pub(crate) fn is_covariance<const N: usize>(P: &SMatrix<Real, N, N>) -> bool {
    let sd = P.diagonal().map(sqrt);
    let rounding = sd * sd.transpose() * sqrt(Real::EPSILON);
    let symmetric = (P - P.transpose()).abs() <= rounding;
    let mut rest = *P;
    let mut positive = true;
    for j in 0..N {
        let (column, pivot) = (rest.column(j).into_owned(), rest.diagonal().get(j).copied());
        let (Some(pivot), Some(least)) = (pivot, rounding.diagonal().get(j).copied()) else {
            return false;
        };
        if pivot > least {
            rest -= (column / pivot) * column.transpose();
        } else {
            // No variance left: then no covariance either.
            positive &= pivot >= -least && column.abs() <= rounding.column(j) * 10.0;
        }
    }
    symmetric && positive
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::real::PI;
    use crate::testing::Random;
    use nalgebra::{Matrix2, Matrix3, Vector2, Vector3, matrix, vector};

    #[test]
    fn correction_equals_the_information_form() {
        // Oracle: P⁺ = (P⁻¹ + Hᵀ R⁻¹ H)⁻¹ and x⁺ = x + P⁺ Hᵀ R⁻¹ y.
        let P: Matrix3<Real> = matrix![2.0, 0.3, 0.1; 0.3, 1.0, -0.2; 0.1, -0.2, 0.5];
        let H = matrix![1.0, 0.5, 0.0; 0.0, 1.0, -2.0];
        let R: Matrix2<Real> = matrix![0.2, 0.05; 0.05, 0.4];
        let y: Vector2<Real> = vector![0.7, -0.4];
        let mut belief = Gaussian {
            x: vector![1.0, 2.0, 3.0],
            P,
        };
        let correction = belief.correct(y, &H, &R).unwrap();
        let P_oracle = (P.try_inverse().unwrap() + H.transpose() * R.try_inverse().unwrap() * H)
            .try_inverse()
            .unwrap();
        let x_oracle: Vector3<Real> =
            vector![1.0, 2.0, 3.0] + P_oracle * H.transpose() * R.try_inverse().unwrap() * y;
        assert!((belief.P - P_oracle).norm() < 1e-12);
        assert!((belief.x - x_oracle).norm() < 1e-12);
        let S = H * P * H.transpose() + R;
        assert!((correction.nis - (y.transpose() * S.try_inverse().unwrap() * y).x).abs() < 1e-12);
        let log_density = -0.5 * correction.nis - 0.5 * (S.determinant() * (2.0 * PI).powi(2)).ln();
        assert!((correction.log_likelihood - log_density).abs() < 1e-12);
    }

    #[test]
    fn joseph_form_stays_positive_over_a_hundred_thousand_random_steps() {
        let mut random = Random::new(1);
        let mut belief = Gaussian::<3>::independent(Vector3::zeros(), vector![1e3, 1.0, 1e-3]);
        for step in 0..100_000 {
            let h = vector![
                random.normal(),
                10.0 * random.normal(),
                1e3 * random.normal()
            ];
            let r = 10f64.powf(-8.0 + 10.0 * random.uniform());
            belief.correct_scalar(random.normal(), &h, r).unwrap();
            if step % 7 == 0 {
                let F = Matrix3::identity() + 0.01 * Matrix3::from_fn(|_, _| random.normal());
                belief.P = F * belief.P * F.transpose() + Matrix3::identity() * 1e-9;
                belief.symmetrise();
                belief.limit_variance(&vector![1e6, 1e3, 1.0]);
            }
            assert_eq!(belief.P, belief.P.transpose());
            assert!(
                belief.P.cholesky().is_some(),
                "not positive definite at step {step}: {}",
                belief.P
            );
        }
        assert!(belief.is_finite());
    }

    #[test]
    fn a_measurement_never_increases_a_variance() {
        let mut random = Random::new(2);
        let mut belief = Gaussian::<2>::independent(Vector2::zeros(), vector![3.0, 4.0]);
        for _ in 0..1000 {
            let before = belief.P.diagonal();
            belief
                .correct_scalar(1.0, &vector![random.normal(), random.normal()], 0.1)
                .unwrap();
            assert!(
                belief
                    .P
                    .diagonal()
                    .zip_map(&before, |a, b| a <= b * (1.0 + 1e-12))
                    .iter()
                    .all(|ok| *ok)
            );
        }
    }

    #[test]
    fn an_impossible_noise_is_refused_and_changes_nothing() {
        let mut belief = Gaussian::<2>::independent(Vector2::zeros(), vector![1.0, 1.0]);
        let before = belief;
        assert!(
            belief
                .correct_scalar(1.0, &vector![1.0, 0.0], -5.0)
                .is_none()
        );
        assert!(
            belief
                .correct_scalar(Real::NAN, &vector![1.0, 0.0], 1.0)
                .is_none()
        );
        assert_eq!(belief, before);
    }

    #[test]
    fn only_what_is_symmetric_and_positive_semi_definite_is_a_covariance() {
        assert!(is_covariance(&matrix![2.0, 0.5; 0.5, 1.0]));
        assert!(is_covariance(&matrix![1e12, 0.9; 0.9, 1e-12]));
        assert!(is_covariance(&matrix![1.0, 1.0; 1.0, 1.0])); // of rank one
        assert!(is_covariance(&matrix![0.0, 0.0; 0.0, 1.0]));
        assert!(!is_covariance(&matrix![1.0, 1.1; 1.1, 1.0]));
        assert!(!is_covariance(&matrix![1e12, 1.1; 1.1, 1e-12]));
        assert!(!is_covariance(&matrix![1.0, 0.5; -0.5, 1.0]));
        assert!(!is_covariance(&matrix![-1.0, 0.0; 0.0, 1.0]));
        assert!(!is_covariance(&matrix![0.0, 0.1; 0.1, 1.0]));
        // Every pair of a triple may be possible, and the triple not.
        let triple = |r| matrix![1.0, r, r; r, 1.0, r; r, r, 1.0];
        assert!(is_covariance(&triple(-0.49)) && !is_covariance(&triple(-0.51)));
        assert!(!is_covariance(&matrix![Real::NAN, 0.0; 0.0, 1.0]));
    }

    #[test]
    fn variance_limit_keeps_correlations() {
        let mut belief = Gaussian {
            x: Vector2::zeros(),
            P: matrix![4.0, 1.0; 1.0, 1.0],
        };
        assert!(belief.limit_variance(&vector![1.0, 2.0]));
        assert!((belief.P - matrix![1.0, 0.5; 0.5, 1.0]).norm() < 1e-15);
        assert!(!belief.limit_variance(&vector![1.0, 2.0]));
    }
}
