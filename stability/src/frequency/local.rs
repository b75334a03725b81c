//! Transfer functions against an instrument, smooth over neighbouring lines.
//!
//! `y = R u + e`, where `u` and `e` are correlated (the loop is closed) and the instrument `d` and `e` are not: `S_yd = R S_ud`. About each line `R`
//! is a quadratic in frequency over a window of lines, and is solved for by least squares over the window. The window also has mirrored lines, of
//! negative frequency, where `R` is conjugate. With as many inputs as instruments this also separates inputs whose excitations are coherent at each
//! line but not over several. The residual `e = y - R u` gives the noise: its scatter over averages, or, where that is larger, the residual of the
//! smooth `R` in the averages themselves (nonlinear distortion repeats with the excitation and does not scatter).

use crate::spectra::{CrossSpectra, Window};
use nalgebra::{Complex, DMatrix, DVector, SymmetricEigen};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};

type Matrix = DMatrix<Complex<f64>>;

/// Lines on each side of a window, at most.
const WIDEST: usize = 20;
/// Lines over which noise is pooled, on each side.
const POOLED: usize = 6;
/// Of a dither lines of less than this share of its largest do not count: 40 dB down.
pub(super) const DITHERED: f64 = 1e-4;
/// The same of a hand, or of a command, whose power falls steeply with frequency: 100 dB.
pub(super) const MOVED: f64 = 1e-10;
/// Estimates lie no closer than this share of their frequency: a smooth response needs no more.
const SPACING: f64 = 0.005;
/// Of the noise of one line with the next, Hann window: `(2/3)^2`; as a moving average of two.
const NEXT_LINE: f64 = 0.61;

/// Bandwidth of a window to each side of a line, Hz: modes of a held device are wider.
pub(super) fn half_width_hz(hz: f64) -> f64 {
    (0.06 * hz).max(1.0)
}

/// Which columns of the spectra are what.
#[derive(Debug, Clone, Copy)]
pub(super) struct Columns<'a> {
    pub outputs: &'a [usize],
    pub inputs: &'a [usize],
    pub instruments: &'a [usize],
    /// Lines of less than this share of the instruments' largest power do not count.
    pub least_power: f64,
}

/// A transfer matrix over frequency with its uncertainty.
#[derive(Debug, Clone)]
pub(super) struct LocalFit {
    pub hz: Vec<f64>,
    /// outputs x inputs at each line.
    pub value: Vec<Matrix>,
    /// Degrees of freedom of the noise, at each line.
    pub freedom: Vec<f64>,
    /// Variance of the error of the averages at each line, per output: of `S_ed`, over `S_dd`.
    noise: Vec<Vec<f64>>,
    /// Root of `S_dd`.
    root: Vec<Matrix>,
    windows: Vec<Vec<Member>>,
    correlated: bool,
}

/// One line in the window of another.
#[derive(Debug, Clone)]
struct Member {
    line: usize,
    mirrored: bool,
    /// How an error of `S_yd` there moves the estimate: `delta R = sum S_ed weight`.
    weight: Matrix,
}

/// Lines at which something exogenous acts, as indices of the spectra.
pub(super) fn shaken(spectra: &CrossSpectra, instruments: &[usize], least_power: f64) -> Vec<usize> {
    let power = |k: usize, d: usize| spectra.lines[k][(d, d)].re;
    let largest: Vec<f64> = instruments.iter().map(|d| (0..spectra.hz.len()).map(|k| power(k, *d)).fold(0.0, f64::max)).collect();
    // With trends removed and a Hann window the two lowest lines hold what leaks from DC.
    let first = if spectra.averaging.window == Window::Hann { 2 } else { 0 };
    (first..spectra.hz.len())
        .filter(|k| instruments.iter().zip(&largest).any(|(d, most)| power(*k, *d) > least_power * most && *most > 0.0))
        .collect()
}

/// Estimates a transfer matrix. `narrow` divides the width of the windows: what changes with it is bias.
///
/// `None` where too few lines are excited, or the inputs cannot be separated.
pub(super) fn fit(spectra: &CrossSpectra, columns: Columns, narrow: f64) -> Option<LocalFit> {
    let Columns { outputs, inputs, instruments, least_power } = columns;
    let (ny, nu) = (outputs.len(), inputs.len());
    let used = shaken(spectra, instruments, least_power);
    if used.len() < 4 || nu == 0 || nu != instruments.len() {
        return None;
    }
    let part =
        |k: usize, rows: &[usize], cols: &[usize]| Matrix::from_fn(rows.len(), cols.len(), |i, j| spectra.lines[k][(rows[i], cols[j])]);
    let s_ud: Vec<Matrix> = used.iter().map(|k| part(*k, inputs, instruments)).collect();
    let s_yd: Vec<Matrix> = used.iter().map(|k| part(*k, outputs, instruments)).collect();
    let s_dd: Vec<Matrix> = used.iter().map(|k| part(*k, instruments, instruments)).collect();
    let hz: Vec<f64> = used.iter().map(|k| spectra.hz[*k]).collect();
    // Of lines of a Hann window every other one is new.
    let least = 3 * nu + if spectra.averaging.window == Window::Hann { 4 } else { 2 };
    let (mut solved, mut windows, mut kept) = (Vec::new(), Vec::new(), Vec::<usize>::new());
    for at in 0..hz.len() {
        let found = solve(&members(&hz, at, least, narrow), &s_ud, &s_yd);
        let far = kept.last().is_none_or(|last| hz[at] - hz[*last] >= SPACING * hz[at] - 1e-9);
        solved.push(found.map(|(value, members, spent)| {
            if far {
                windows.push(members);
                kept.push(at);
            }
            (value, spent)
        }));
    }
    if kept.len() < 4 {
        return None;
    }
    let averages = spectra.averaging.averages;
    let (mut misfit, mut scatter) = (vec![vec![0.0; ny]; hz.len()], vec![vec![0.0; ny]; hz.len()]);
    for at in 0..hz.len() {
        let (Some((r, spent)), k) = (&solved[at], used[at]) else { continue };
        let s_ed = &s_yd[at] - r * &s_ud[at];
        let (s_yy, s_uy, s_uu) = (part(k, outputs, outputs), part(k, inputs, outputs), part(k, inputs, inputs));
        let cross = r * s_uy;
        let s_ee = s_yy - &cross - cross.adjoint() + r * s_uu * r.adjoint();
        let power = s_dd[at].trace().re.max(f64::MIN_POSITIVE);
        for i in 0..ny {
            let fixed = s_ed.row(i).iter().map(|x| x.norm_sqr()).sum::<f64>() / power;
            misfit[at][i] = fixed / (1.0 - spent).max(0.2);
            scatter[at][i] = if averages > 1.5 { (s_ee[(i, i)].re - fixed).max(0.0) / (averages - 1.0) } else { 0.0 };
        }
    }
    let correlated = spectra.averaging.window == Window::Hann;
    let mut freedom = Vec::with_capacity(hz.len());
    let noise = (0..hz.len())
        .map(|at| {
            let (from, to) = (at.saturating_sub(POOLED), (at + POOLED + 1).min(hz.len()));
            // Neighbouring lines of a Hann window share half of what they say.
            let lines = (to - from) as f64 / if correlated { 1.9 } else { 1.0 };
            let spent = solved[at].as_ref().map_or(1.0, |(_, spent)| *spent);
            freedom.push((2.0 * lines * (averages - 1.0).max(1.0 - spent)).max(1.0));
            let pooled = |of: &[Vec<f64>], i: usize| of[from..to].iter().map(|v| v[i]).sum::<f64>() / (to - from) as f64;
            (0..ny).map(|i| pooled(&misfit, i).max(pooled(&scatter, i))).collect()
        })
        .collect();
    let root = s_dd.iter().map(root).collect::<Option<Vec<_>>>()?;
    let pick = |of: &[f64]| kept.iter().map(|k| of[*k]).collect::<Vec<f64>>();
    let value = kept.iter().filter_map(|k| solved[*k].as_ref().map(|(value, _)| value.clone())).collect();
    Some(LocalFit { value, freedom: pick(&freedom), noise, root, windows, correlated, hz: pick(&hz) })
}

/// (line, mirrored, distance over the half width, taper) of the lines in the window about one.
fn members(hz: &[f64], at: usize, least: usize, narrow: f64) -> Vec<(usize, bool, f64, f64)> {
    let middle = hz[at];
    let signed = |i: isize| if i >= 0 { hz.get(i as usize).copied() } else { hz.get((-i - 1) as usize).map(|f| -f) };
    let distance = |i: isize| signed(i).map_or(f64::INFINITY, |f| (f - middle).abs());
    let at = at as isize;
    let (mut low, mut high) = (at, at);
    let wanted = half_width_hz(middle) / narrow;
    loop {
        let (below, above) = (distance(low - 1), distance(high + 1));
        let next = below.min(above);
        let count = (high - low + 1) as usize;
        if !next.is_finite() || (count >= least && next > wanted) || count > 2 * WIDEST {
            break;
        }
        if below <= above { low -= 1 } else { high += 1 }
    }
    let reach = (distance(low).max(distance(high)) * 1.1).max(f64::MIN_POSITIVE);
    (low..=high)
        .filter_map(|i| {
            let x = (signed(i)? - middle) / reach;
            let index = if i >= 0 { i as usize } else { (-i - 1) as usize };
            Some((index, i < 0, x, (1.0 - x.abs().powi(3)).max(0.0).powi(3)))
        })
        .collect()
}

/// The estimate at the middle, how errors move it, and the share of the freedom that the fit takes.
fn solve(members: &[(usize, bool, f64, f64)], s_ud: &[Matrix], s_yd: &[Matrix]) -> Option<(Matrix, Vec<Member>, f64)> {
    let (nu, ny) = (s_ud[0].nrows(), s_yd[0].nrows());
    let conj = |m: &Matrix, mirrored: bool| if mirrored { m.conjugate() } else { m.clone() };
    let (mut normal, mut right) = (Matrix::zeros(3 * nu, 3 * nu), Matrix::zeros(ny, 3 * nu));
    for (line, mirrored, x, taper) in members {
        let (ud, yd) = (conj(&s_ud[*line], *mirrored), conj(&s_yd[*line], *mirrored));
        for q in 0..3 {
            for p in 0..3 {
                let factor = Complex::new(taper * x.powi(p as i32 + q as i32), 0.0);
                let mut block = normal.view_mut((p * nu, q * nu), (nu, nu));
                block += &ud * factor;
            }
            let mut block = right.view_mut((0, q * nu), (ny, nu));
            block += &yd * Complex::new(taper * x.powi(q as i32), 0.0);
        }
    }
    let size = normal.iter().map(|x| x.norm()).fold(0.0, f64::max);
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    normal /= Complex::new(size, 0.0);
    let singular = normal.clone().svd(false, false).singular_values;
    if singular.min() < 1e-9 * singular.max() {
        return None;
    }
    let inverse = normal.try_inverse()? / Complex::new(size, 0.0);
    let value = right * inverse.columns(0, nu);
    let mut own = 0.0;
    let weights = members.iter().map(|(line, mirrored, x, taper)| {
        let mut weight = Matrix::zeros(nu, nu);
        for q in 0..3 {
            weight += inverse.view((q * nu, 0), (nu, nu)) * Complex::new(taper * x.powi(q as i32), 0.0);
        }
        if *x == 0.0 {
            // The share of a line's own error that its estimate follows.
            own = (conj(&s_ud[*line], *mirrored) * &weight).trace().re / nu as f64;
        }
        Member { line: *line, mirrored: *mirrored, weight }
    });
    let weights = weights.collect();
    Some((value, weights, own.clamp(0.0, 1.0)))
}

/// Hermitian root of a spectral matrix.
fn root(s_dd: &Matrix) -> Option<Matrix> {
    if s_dd.nrows() == 1 {
        return Some(Matrix::from_element(1, 1, Complex::new(s_dd[(0, 0)].re.max(0.0).sqrt(), 0.0)));
    }
    let eigen = SymmetricEigen::try_new(s_dd.clone(), 1e-12, 1000)?;
    let values = DVector::from_iterator(s_dd.nrows(), eigen.eigenvalues.iter().map(|x| Complex::new(x.max(0.0).sqrt(), 0.0)));
    Some(&eigen.eigenvectors * Matrix::from_diagonal(&values) * eigen.eigenvectors.adjoint())
}

fn normal(rng: &mut impl Rng) -> Complex<f64> {
    let (re, im): (f64, f64) = (StandardNormal.sample(rng), StandardNormal.sample(rng));
    Complex::new(re, im) * std::f64::consts::FRAC_1_SQRT_2
}

impl LocalFit {
    /// The estimate with an error drawn from its distribution.
    pub(super) fn draw(&self, rng: &mut impl Rng) -> Vec<Matrix> {
        let errors = self.errors(rng);
        self.value
            .iter()
            .zip(&self.windows)
            .map(|(value, members)| {
                let mut drawn = value.clone();
                for m in members {
                    let error = &errors[m.line];
                    for i in 0..drawn.nrows() {
                        for j in 0..drawn.ncols() {
                            for k in 0..error.ncols() {
                                let e = if m.mirrored { error[(i, k)].conj() } else { error[(i, k)] };
                                drawn[(i, j)] += e * m.weight[(k, j)];
                            }
                        }
                    }
                }
                drawn
            })
            .collect()
    }

    /// Errors of `S_yd` at every line.
    fn errors(&self, rng: &mut impl Rng) -> Vec<Matrix> {
        let (ny, nd) = (self.noise.first().map_or(0, Vec::len), self.root.first().map_or(0, |r| r.nrows()));
        let mut white = || Matrix::from_fn(ny, nd, |_, _| normal(rng));
        let share = if self.correlated { NEXT_LINE } else { 0.0 };
        let scale = 1.0 / (1.0 + share * share).sqrt();
        let mut before = white();
        self.noise
            .iter()
            .zip(&self.root)
            .map(|(noise, root)| {
                let now = white();
                let mixed = (&now + &before * Complex::new(share, 0.0)) * Complex::new(scale, 0.0);
                before = now;
                Matrix::from_fn(ny, nd, |i, j| mixed[(i, j)] * noise[i].max(0.0).sqrt()) * root
            })
            .collect()
    }

    /// Standard deviation of the real (or imaginary) part of each element at each line, without drawing.
    pub(super) fn sigma(&self) -> Vec<DMatrix<f64>> {
        let share = if self.correlated { 1.0 + 2.0 * NEXT_LINE / (1.0 + NEXT_LINE * NEXT_LINE) } else { 1.0 };
        self.value
            .iter()
            .zip(&self.windows)
            .map(|(value, members)| {
                let mut variance = DMatrix::<f64>::zeros(value.nrows(), value.ncols());
                for m in members {
                    let spread = &self.root[m.line] * &m.weight;
                    for i in 0..value.nrows() {
                        for j in 0..value.ncols() {
                            variance[(i, j)] += self.noise[m.line][i] * spread.column(j).norm_squared();
                        }
                    }
                }
                variance.map(|v| (0.5 * share * v).sqrt())
            })
            .collect()
    }
}
