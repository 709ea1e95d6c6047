//! The eleven dense routines that the conic solver `clarabel` links against, in Rust.
//!
//! `clarabel` is the second opinion on `dynid_estimate::consistent` in tests and benchmarks, and no part of the program.
//! For matrix inequalities it calls BLAS and LAPACK by their C symbols and leaves it to a crate `blas-src` to bring them,
//! which in the registry means to download, to compile (C, Fortran) or to find on the machine. This package takes its
//! place (`[patch.crates-io]` of the workspace), so that tests need nothing but cargo.
//!
//! Matrices are 4 × 4 or 6 × 6 there: plain loops, and Jacobi rotations for eigenvalues and singular values, which also
//! have the better accuracy. What a caller may rely on: argument order and storage of the reference BLAS and LAPACK,
//! unit increments only; queries of work space answer 1, since none is used; options that `clarabel` does not use give
//! `info < 0`, the (negative) position of the argument.
#![expect(unsafe_code, reason = "C symbols take pointers and cannot be checked by the compiler")]

mod dense;

use std::ffi::{c_char, c_int};
use std::slice::{from_raw_parts, from_raw_parts_mut};

use dense::{Columns, Part, View};

fn is(option: &c_char, letter: u8) -> bool {
    (*option as u8).eq_ignore_ascii_case(&letter)
}

fn size(n: &c_int) -> usize {
    usize::try_from(*n).unwrap_or(0)
}

fn part(uplo: &c_char) -> Part {
    if is(uplo, b'U') { Part::Upper } else { Part::Lower }
}

/// Entries that a matrix of `rows × columns` with columns `stride` apart occupies.
fn span(rows: usize, columns: usize, stride: &c_int) -> usize {
    match (rows, columns) {
        (0, _) | (_, 0) => 0,
        _ => size(stride) * (columns - 1) + rows,
    }
}

/// Read access to `op(A)` of `rows × columns`, `op` a transposition if `trans` says so.
///
/// # Safety
/// `a` must point to a matrix of that size before `op`, columns `stride` apart, that nothing writes to meanwhile.
unsafe fn view<'a, T>(a: *const T, trans: bool, rows: usize, columns: usize, stride: &c_int) -> View<'a, T> {
    let length = if trans { span(columns, rows, stride) } else { span(rows, columns, stride) };
    let data = if length == 0 { &[] } else { unsafe { from_raw_parts(a, length) } };
    View { data, stride: size(stride), transposed: trans }
}

/// Write access to a matrix of `rows × columns`.
///
/// # Safety
/// The memory is as [`view`] asks for, and nothing else may read it meanwhile.
unsafe fn columns<'a, T>(a: *mut T, rows: usize, columns: usize, stride: &c_int) -> Columns<'a, T> {
    let length = span(rows, columns, stride);
    let data = if length == 0 { &mut [] } else { unsafe { from_raw_parts_mut(a, length) } };
    Columns { data, stride: size(stride) }
}

/// The routines for one type of number. Pointers must be what the reference BLAS and LAPACK ask for, which is all the
/// safety there is: `clarabel` derives each of them from a slice of sufficient length.
macro_rules! routines {
    ($t:ty, $gemm:ident, $gemv:ident, $symv:ident, $syrk:ident, $syr2k:ident, $potrf:ident, $potrs:ident, $gesv:ident,
     $syevr:ident, $gesdd:ident, $gesvd:ident) => {
        /// `C := α op(A) op(B) + β C`.
        ///
        /// # Safety
        /// Pointers as in the reference BLAS.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $gemm(
            transa: &c_char,
            transb: &c_char,
            m: &c_int,
            n: &c_int,
            k: &c_int,
            alpha: &$t,
            a: *const $t,
            lda: &c_int,
            b: *const $t,
            ldb: &c_int,
            beta: &$t,
            c: *mut $t,
            ldc: &c_int,
        ) {
            let (m, n, k) = (size(m), size(n), size(k));
            let a = unsafe { view(a, !is(transa, b'N'), m, k, lda) };
            let b = unsafe { view(b, !is(transb, b'N'), k, n, ldb) };
            let mut c = unsafe { columns(c, m, n, ldc) };
            c.update((m, n, k), Part::Whole, *beta, |i, j, p| alpha * a.at(i, p) * b.at(p, j));
        }

        /// `y := α op(A) x + β y`.
        ///
        /// # Safety
        /// Pointers as in the reference BLAS.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $gemv(
            trans: &c_char,
            m: &c_int,
            n: &c_int,
            alpha: &$t,
            a: *const $t,
            lda: &c_int,
            x: *const $t,
            _incx: &c_int,
            beta: &$t,
            y: *mut $t,
            _incy: &c_int,
        ) {
            let trans = !is(trans, b'N');
            let (rows, along) = if trans { (size(n), size(m)) } else { (size(m), size(n)) };
            let a = unsafe { view(a, trans, rows, along, lda) };
            let x = unsafe { view(x, false, along, 1, &0) };
            let mut y = unsafe { columns(y, rows, 1, &0) };
            y.update((rows, 1, along), Part::Whole, *beta, |i, _, p| alpha * a.at(i, p) * x.at(p, 0));
        }

        /// `y := α A x + β y` with one triangle of a symmetric `A`.
        ///
        /// # Safety
        /// Pointers as in the reference BLAS.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $symv(
            uplo: &c_char,
            n: &c_int,
            alpha: &$t,
            a: *const $t,
            lda: &c_int,
            x: *const $t,
            _incx: &c_int,
            beta: &$t,
            y: *mut $t,
            _incy: &c_int,
        ) {
            let n = size(n);
            let a = unsafe { view(a, false, n, n, lda) };
            let x = unsafe { view(x, false, n, 1, &0) };
            let mut y = unsafe { columns(y, n, 1, &0) };
            let part = part(uplo);
            y.update((n, 1, n), Part::Whole, *beta, |i, _, p| alpha * a.symmetric(part, i, p) * x.at(p, 0));
        }

        /// One triangle of `C := α op(A) op(A)ᵀ + β C`.
        ///
        /// # Safety
        /// Pointers as in the reference BLAS.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $syrk(
            uplo: &c_char,
            trans: &c_char,
            n: &c_int,
            k: &c_int,
            alpha: &$t,
            a: *const $t,
            lda: &c_int,
            beta: &$t,
            c: *mut $t,
            ldc: &c_int,
        ) {
            let (n, k) = (size(n), size(k));
            let a = unsafe { view(a, !is(trans, b'N'), n, k, lda) };
            let mut c = unsafe { columns(c, n, n, ldc) };
            c.update((n, n, k), part(uplo), *beta, |i, j, p| alpha * a.at(i, p) * a.at(j, p));
        }

        /// One triangle of `C := α op(A) op(B)ᵀ + α op(B) op(A)ᵀ + β C`.
        ///
        /// # Safety
        /// Pointers as in the reference BLAS.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $syr2k(
            uplo: &c_char,
            trans: &c_char,
            n: &c_int,
            k: &c_int,
            alpha: &$t,
            a: *const $t,
            lda: &c_int,
            b: *const $t,
            ldb: &c_int,
            beta: &$t,
            c: *mut $t,
            ldc: &c_int,
        ) {
            let (n, k) = (size(n), size(k));
            let a = unsafe { view(a, !is(trans, b'N'), n, k, lda) };
            let b = unsafe { view(b, !is(trans, b'N'), n, k, ldb) };
            let mut c = unsafe { columns(c, n, n, ldc) };
            c.update((n, n, k), part(uplo), *beta, |i, j, p| {
                alpha * (a.at(i, p) * b.at(j, p) + b.at(i, p) * a.at(j, p))
            });
        }

        /// Cholesky factor of a positive definite matrix, in place.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $potrf(uplo: &c_char, n: &c_int, a: *mut $t, lda: &c_int, info: &mut c_int) {
            let n = size(n);
            *info = dense::cholesky(&mut unsafe { columns(a, n, n, lda) }, n, part(uplo));
        }

        /// Solves `A X = B` with the factor of a Cholesky factorisation.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $potrs(
            uplo: &c_char,
            n: &c_int,
            nrhs: &c_int,
            a: *const $t,
            lda: &c_int,
            b: *mut $t,
            ldb: &c_int,
            info: &mut c_int,
        ) {
            let (n, sides) = (size(n), size(nrhs));
            let l = unsafe { view(a, is(uplo, b'U'), n, n, lda) };
            dense::cholesky_solve(&l, &mut unsafe { columns(b, n, sides, ldb) }, n, sides);
            *info = 0;
        }

        /// Solves `A X = B` by elimination with row exchanges.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $gesv(
            n: &c_int,
            nrhs: &c_int,
            a: *mut $t,
            lda: &c_int,
            ipiv: *mut c_int,
            b: *mut $t,
            ldb: &c_int,
            info: &mut c_int,
        ) {
            let (n, sides) = (size(n), size(nrhs));
            let mut a = unsafe { columns(a, n, n, lda) };
            let mut b = unsafe { columns(b, n, sides, ldb) };
            let pivots = unsafe { columns(ipiv, n, 1, &0) };
            *info = dense::eliminate(&mut a, &mut b, pivots.data, n, sides);
        }

        /// All eigenvalues, ascending, and on demand eigenvectors of a symmetric matrix.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $syevr(
            jobz: &c_char,
            range: &c_char,
            uplo: &c_char,
            n: &c_int,
            a: *mut $t,
            lda: &c_int,
            _vl: &$t,
            _vu: &$t,
            _il: &c_int,
            _iu: &c_int,
            _abstol: &$t,
            m: &mut c_int,
            w: *mut $t,
            z: *mut $t,
            ldz: &c_int,
            _isuppz: *mut c_int,
            work: &mut $t,
            lwork: &c_int,
            iwork: &mut c_int,
            _liwork: &c_int,
            info: &mut c_int,
        ) {
            *info = if is(range, b'A') { 0 } else { -2 };
            if *lwork == -1 {
                (*work, *iwork) = (1.0, 1);
            } else if *info == 0 {
                *m = *n;
                let (n, vectors) = (size(n), is(jobz, b'V'));
                let mut a = unsafe { columns(a, n, n, lda) };
                let values = unsafe { columns(w, n, 1, &0) };
                let z = vectors.then(|| unsafe { columns(z, n, n, ldz) });
                dense::eigen(&mut a, n, part(uplo), values.data, z);
            }
        }

        /// Singular values, descending, with as many left and right vectors.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $gesdd(
            jobz: &c_char,
            m: &c_int,
            n: &c_int,
            a: *mut $t,
            lda: &c_int,
            s: *mut $t,
            u: *mut $t,
            ldu: &c_int,
            vt: *mut $t,
            ldvt: &c_int,
            work: &mut $t,
            lwork: &c_int,
            _iwork: *mut c_int,
            info: &mut c_int,
        ) {
            unsafe { $gesvd(jobz, jobz, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, info) };
        }

        /// Singular values, descending, with as many left and right vectors.
        ///
        /// # Safety
        /// Pointers as in LAPACK.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $gesvd(
            jobu: &c_char,
            jobvt: &c_char,
            m: &c_int,
            n: &c_int,
            a: *mut $t,
            lda: &c_int,
            s: *mut $t,
            u: *mut $t,
            ldu: &c_int,
            vt: *mut $t,
            ldvt: &c_int,
            work: &mut $t,
            lwork: &c_int,
            info: &mut c_int,
        ) {
            *info = match (is(jobu, b'S'), is(jobvt, b'S')) {
                (true, true) => 0,
                (false, _) => -1,
                (_, false) => -2,
            };
            if *lwork == -1 {
                *work = 1.0;
            } else if *info == 0 {
                let (m, n) = (size(m), size(n));
                let few = m.min(n);
                let a = unsafe { view(a, false, m, n, lda) };
                let values = unsafe { columns(s, few, 1, &0) };
                let mut u = unsafe { columns(u, m, few, ldu) };
                let mut vt = unsafe { columns(vt, few, n, ldvt) };
                dense::singular(&a, (m, n), values.data, &mut u, &mut vt);
            }
        }
    };
}

routines!(f64, dgemm_, dgemv_, dsymv_, dsyrk_, dsyr2k_, dpotrf_, dpotrs_, dgesv_, dsyevr_, dgesdd_, dgesvd_);
routines!(f32, sgemm_, sgemv_, ssymv_, ssyrk_, ssyr2k_, spotrf_, spotrs_, sgesv_, ssyevr_, sgesdd_, sgesvd_);

#[cfg(test)]
mod tests {
    use super::*;

    const N: c_char = b'N' as c_char;
    const T: c_char = b'T' as c_char;
    const U: c_char = b'U' as c_char;

    /// One product in five spellings, in the corner of a larger matrix.
    #[test]
    fn products_agree_with_each_other() {
        // A = [1 3; 2 4] with one row more in memory, B = [5 7; 6 8].
        let (a, b) = ([1.0, 2.0, 9.0, 3.0, 4.0, 9.0], [5.0, 6.0, 7.0, 8.0]);
        let mut c = [1.0_f64; 6];
        unsafe {
            dgemm_(&N, &N, &2, &2, &2, &1.0, a.as_ptr(), &3, b.as_ptr(), &2, &0.0, c.as_mut_ptr(), &3);
        }
        assert_eq!(c, [23.0, 34.0, 1.0, 31.0, 46.0, 1.0]);
        unsafe {
            dgemm_(&T, &T, &2, &2, &2, &1.0, a.as_ptr(), &3, b.as_ptr(), &2, &2.0, c.as_mut_ptr(), &3);
        }
        // Aᵀ Bᵀ = (B A)ᵀ = [19 22; 43 50].
        assert_eq!(c, [65.0, 111.0, 1.0, 84.0, 142.0, 1.0]);
        let mut y = [0.0; 2];
        unsafe { dgemv_(&T, &2, &2, &1.0, a.as_ptr(), &3, b.as_ptr(), &1, &0.0, y.as_mut_ptr(), &1) };
        assert_eq!(y, [17.0, 39.0]);
        unsafe { dsymv_(&U, &2, &1.0, a.as_ptr(), &3, b.as_ptr(), &1, &1.0, y.as_mut_ptr(), &1) };
        // [1 3; 3 4] (5, 6) = (23, 39).
        assert_eq!(y, [40.0, 78.0]);
        let mut c = [-1.0; 4];
        unsafe { dsyrk_(&U, &N, &2, &2, &1.0, a.as_ptr(), &3, &0.0, c.as_mut_ptr(), &2) };
        assert_eq!(c, [10.0, -1.0, 14.0, 20.0]);
        unsafe {
            dsyr2k_(&U, &N, &2, &2, &0.5, a.as_ptr(), &3, a.as_ptr(), &3, &1.0, c.as_mut_ptr(), &2);
        }
        assert_eq!(c, [20.0, -1.0, 28.0, 40.0]);
    }

    #[test]
    fn queries_of_work_space_touch_nothing_else() {
        let (mut work, mut iwork, mut info, mut m) = (0.0_f64, 0, 7, 0);
        let (mut a, mut w, mut isuppz) = ([3.0], [0.0], [0, 0]);
        let mut run = |lwork: c_int, w: &mut [f64; 1], work: &mut f64| unsafe {
            let range = b'A' as c_char;
            dsyevr_(
                &N,
                &range,
                &U,
                &1,
                a.as_mut_ptr(),
                &1,
                &0.0,
                &0.0,
                &0,
                &0,
                &0.0,
                &mut m,
                w.as_mut_ptr(),
                std::ptr::null_mut(),
                &1,
                isuppz.as_mut_ptr(),
                work,
                &lwork,
                &mut iwork,
                &lwork,
                &mut info,
            );
            info
        };
        assert_eq!((run(-1, &mut w, &mut work), work, w), (0, 1.0, [0.0]));
        assert_eq!((run(1, &mut w, &mut work), w), (0, [3.0]));
    }
}
