//! Robots: what a file says, and the numbers of rigid bodies for batches of states.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use dynid::estimators::{Factor as Triangle, FactorBuilder, FactorError};
use dynid::io::robot::stem;
use dynid::model::dynamics::{AddedInertia, Dynamics, LoadedState};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, RegressorBlock, RobotModel};
use dynid::{RobotOptions, inspect};
use numpy::{PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Batch, Matrix, Vector, by_chunks, demand_finite, filled, vector};
use crate::error::{raise, setting, unsupported, warn};
use crate::settings::as_json;
use crate::states::{Given, Scratch, States};
use crate::work::pool;

/// Standard parameters in the order of this library, by their place in the order of Pinocchio.
const PINOCCHIO: [usize; 10] = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9];

/// A robot or mechanism as a file, a text or another library's model describes it.
#[pyclass(frozen, module = "dynid")]
pub(crate) struct Robot {
    pub(crate) robot: dynid::Robot,
    /// The text that it was made of, where no file holds it.
    pub(crate) text: Option<Arc<str>>,
    options: RobotOptions,
    /// Rigid bodies, with springs where joints are elastic.
    model: RobotModel,
    values: Vec<f64>,
    dynamics: OnceLock<Dynamics>,
    base: OnceLock<BaseParameters>,
}

impl Robot {
    fn of(
        py: Python<'_>,
        robot: dynid::Robot,
        text: Option<Arc<str>>,
        options: RobotOptions,
    ) -> PyResult<Self> {
        let model = robot.skeleton().map_err(|e| raise(py, &e))?;
        let values = robot.skeleton_values(&model);
        Ok(Robot { robot, text, options, model, values, dynamics: OnceLock::new(), base: OnceLock::new() })
    }

    /// The robot, once its doubts have been told.
    fn told(self, py: Python<'_>) -> PyResult<Self> {
        self.robot.warnings.iter().try_for_each(|warning| warn(py, warning))?;
        Ok(self)
    }

    fn nq_nv(&self) -> (usize, usize) {
        self.model.dimensions()
    }

    fn outputs(&self) -> usize {
        self.model.outputs().len()
    }

    fn columns(&self) -> usize {
        self.model.parameters().linear.len()
    }

    fn base(&self) -> &BaseParameters {
        self.base.get_or_init(|| {
            BaseParameters::of_model(
                &self.model,
                &self.model.parameters().shape_start(),
                &BaseSettings::default(),
            )
        })
    }

    /// Recursions of the rigid tree; what has no mass matrix of its joints alone is refused.
    fn tree(&self, py: Python<'_>, what: &str) -> PyResult<&Dynamics> {
        if let Some(closure) = self.robot.file.closures.first() {
            let text = format!("{what} of a mechanism with loops (`{}`)", closure.name);
            return Err(unsupported(py, text, "`inverse_dynamics` and `regressor` know loops"));
        }
        if !self.robot.elements.elastic.is_empty() {
            let text = format!("{what} of a robot with elastic joints");
            return Err(unsupported(py, text, "`inverse_dynamics` and `regressor` know springs"));
        }
        Ok(self.dynamics.get_or_init(|| Dynamics::new(&self.robot.mechanism)))
    }

    /// Parameters in place of the robot file's.
    fn parameters_or_own(&self, given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
        let Some(given) = given else { return Ok(self.values.clone()) };
        let batch = Batch::take("parameters", given, self.columns())?;
        if batch.rows != 1 {
            return Err(PyValueError::new_err("parameters: expected one set of them"));
        }
        let values = batch.values()?;
        demand_finite("parameters", values, self.columns())?;
        Ok(values.to_vec())
    }

    /// Per output: its acting columns by number, and where each goes.
    fn targets(&self, places: &[Option<usize>]) -> Vec<Vec<(usize, usize)>> {
        let layout = self.model.layout();
        let of = |o: usize| {
            let columns = layout.columns(o).iter().enumerate();
            columns.filter_map(|(k, c)| Some((k, places[*c]?))).collect()
        };
        (0..self.outputs()).map(of).collect()
    }

    /// Columns of a regressor in the order asked for: where each goes.
    fn places(&self, py: Python<'_>, order: &str, base: bool) -> PyResult<(usize, Vec<Option<usize>>)> {
        let total = self.columns();
        let hint = "`order=\"dynid\"`: m mx my mz Ixx Ixy Ixz Iyy Iyz Izz; `order=\"pinocchio\"`: m mx my mz Ixx Ixy Iyy Ixz Iyz Izz";
        match (order, base) {
            ("dynid", false) => Ok((total, (0..total).map(Some).collect())),
            ("dynid", true) => {
                let kept = &self.base().kept;
                Ok((kept.len(), (0..total).map(|c| kept.binary_search(&c).ok()).collect()))
            }
            ("pinocchio", false) => {
                let bodies = self.robot.mechanism.inertial_parameters();
                let place = |c: usize| if c < bodies { c / 10 * 10 + PINOCCHIO[c % 10] } else { c };
                Ok((total, (0..total).map(|c| Some(place(c))).collect()))
            }
            ("pinocchio", true) => {
                let text = "base=True beside order=\"pinocchio\": base parameters have an order of their own";
                Err(setting(py, text, "leave `order` out"))
            }
            _ => {
                Err(setting(py, format!("order: expected \"dynid\" or \"pinocchio\", found {order:?}"), hint))
            }
        }
    }
}

#[pymethods]
impl Robot {
    /// Reads a robot file: URDF, MJCF, SDF, each as xacro too, or TOML with DH rows or bodies.
    ///
    /// `arguments`: those of a xacro file, by name; `gravity`: m/s² in base axes, in place of the file's; `couple_mimics`: mimic joints follow their leaders; `floating_base`: a floating
    /// joint under the root link; `locked`: joints held at a position (rad or m), by name. Raises `RobotError`.
    #[staticmethod]
    #[pyo3(signature = (path, *, arguments=None, gravity=None, couple_mimics=false, floating_base=false, locked=None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        arguments: Option<BTreeMap<String, String>>,
        gravity: Option<[f64; 3]>,
        couple_mimics: bool,
        floating_base: bool,
        locked: Option<BTreeMap<String, f64>>,
    ) -> PyResult<Self> {
        let options = options(gravity, couple_mimics, floating_base, locked);
        let path = with_arguments(path, arguments.as_ref());
        let robot = dynid::Robot::load(&path, &options).map_err(|e| raise(py, &e))?;
        Robot::of(py, robot, None, options)?.told(py)
    }

    /// A robot from the text of a robot file; `name` says by its ending which kind (`.urdf`, `.xml`, `.toml`), and stands in messages.
    #[staticmethod]
    #[pyo3(signature = (text, name="robot", *, gravity=None, couple_mimics=false, floating_base=false, locked=None))]
    fn parse(
        py: Python<'_>,
        text: &str,
        name: &str,
        gravity: Option<[f64; 3]>,
        couple_mimics: bool,
        floating_base: bool,
        locked: Option<BTreeMap<String, f64>>,
    ) -> PyResult<Self> {
        let options = options(gravity, couple_mimics, floating_base, locked);
        let mut robot = dynid::Robot::parse(text, Path::new(name), &options).map_err(|e| raise(py, &e))?;
        // What is kept must need no other file: of xacro what it expands to.
        let kept = robot.file.xml.clone().filter(|_| text.trim_start().starts_with('<'));
        if kept.as_deref().is_some_and(|kept| kept != text) {
            let ending = if robot.file.mjcf.is_some() { "xml" } else { "urdf" };
            robot.path = format!("{}.{ending}", stem(&robot.path)).into();
        }
        Robot::of(py, robot, Some(kept.unwrap_or_else(|| text.into())), options)?.told(py)
    }

    /// A robot that was pickled; its doubts were told before.
    #[staticmethod]
    fn restored(
        py: Python<'_>,
        text: &str,
        name: &str,
        stated: (Option<[f64; 3]>, bool, bool),
        locked: BTreeMap<String, f64>,
        warnings: Vec<String>,
    ) -> PyResult<Self> {
        let (gravity, couple_mimics, floating_base) = stated;
        let options = options(gravity, couple_mimics, floating_base, Some(locked));
        let robot = dynid::Robot::parse(text, Path::new(name), &options).map_err(|e| raise(py, &e))?;
        Robot::of(py, dynid::Robot { warnings, ..robot }, Some(text.into()), options)
    }

    /// The robot of a `pinocchio.Model`: joints, bodies, limits, armature, damping and dry friction.
    ///
    /// Joints keep their order. Bodies are about their joint frames; `regressor(.., order="pinocchio")` has Pinocchio's columns. Joints
    /// that turn without end have an angle as position.
    #[staticmethod]
    fn from_pinocchio(py: Python<'_>, model: &Bound<'_, PyAny>) -> PyResult<Self> {
        described(py, "from_pinocchio", model)
    }

    /// The robot of a `mujoco.MjModel`: hinges and slides on a fixed base, bodies, limits, armature, damping and friction loss.
    ///
    /// What has no place (constraints, springs, gravity compensation) is named in `warnings`; free and ball joints are refused.
    #[staticmethod]
    fn from_mujoco(py: Python<'_>, model: &Bound<'_, PyAny>) -> PyResult<Self> {
        described(py, "from_mujoco", model)
    }

    /// Name.
    #[getter]
    fn name(&self) -> &str {
        self.robot.mechanism.name()
    }

    /// Where it came from.
    #[getter]
    fn path(&self) -> PathBuf {
        self.robot.path.clone()
    }

    /// The robot file that it was made of, where that is a text.
    #[getter]
    fn text(&self) -> Option<&str> {
        self.text.as_deref()
    }

    /// The plain XML of a URDF or MJCF, xacro expanded; of a robot in TOML that of the URDF that it names. `None`: it has none.
    #[getter]
    fn xml(&self) -> Option<&str> {
        self.robot.file.xml.as_deref()
    }

    /// Joints, then motors behind springs: the order of efforts. Of a mechanism with loops the drives.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.model.outputs().iter().map(|o| o.name.clone()).collect()
    }

    /// Units of the efforts, `N m` or `N`.
    #[getter]
    fn units(&self) -> Vec<String> {
        self.model.outputs().iter().map(|o| o.unit.to_string()).collect()
    }

    /// Moving bodies.
    #[getter]
    fn links(&self) -> Vec<String> {
        self.robot.mechanism.bodies().iter().map(|b| b.name.clone()).collect()
    }

    /// What a user should know about the file.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.robot.warnings.clone()
    }

    /// Number of positions.
    #[getter]
    fn nq(&self) -> usize {
        self.nq_nv().0
    }

    /// Number of velocities, and of efforts.
    #[getter]
    fn nv(&self) -> usize {
        self.nq_nv().1
    }

    /// Acceleration of gravity in base axes, m/s².
    #[getter]
    fn gravity_vector(&self) -> [f64; 3] {
        self.robot.mechanism.gravity().0
    }

    /// Names of the columns of `regressor`: per body `m mx my mz Ixx Ixy Ixz Iyy Iyz Izz` about its joint frame.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.model.parameters().linear.iter().map(|p| p.name.clone()).collect()
    }

    /// Their values in the robot file, 0 where it states none.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> Vector<'py> {
        vector(py, &self.values)
    }

    /// Efforts of the rigid bodies (springs of elastic joints included; friction and rotors are elements, see `Estimate.predict`).
    ///
    /// `q` `(n, nq)`, `v`, `a` `(n, nv)`, or one state each without the axis of states; gives `(n, nv)`. `parameters`: standard parameters in
    /// place of the robot file's. `threads`: 0 for all cores; the bits do not depend on it. Raises `LogError` for states that a mechanism
    /// with loops cannot be in.
    #[pyo3(signature = (q, v, a, *, parameters=None, threads=1))]
    fn inverse_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
        parameters: Option<&Bound<'py, PyAny>>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let given = Given::take(&self.model, q, v, a)?;
        let linear = self.parameters_or_own(parameters)?;
        given.of(py, &self.model)?.efforts(py, &linear, &[], threads)
    }

    /// Regressor `W` with `effort = W parameters`, `(n, nv, columns)`.
    ///
    /// `order`: of the ten parameters of a body, `"dynid"` (`m mx my mz Ixx Ixy Ixz Iyy Iyz Izz`) or `"pinocchio"` (`.. Ixx Ixy Iyy Ixz Iyz Izz`).
    /// `base`: the columns of base parameters alone.
    #[pyo3(signature = (q, v, a, *, order="dynid", base=false, threads=1))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn regressor<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
        order: &str,
        base: bool,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (width, places) = self.places(py, order, base)?;
        let given = Given::take(&self.model, q, v, a)?;
        let states = given.of(py, &self.model)?;
        let (outputs, shape) = (self.outputs(), self.model.parameters().shape_start());
        let targets = self.targets(&places);
        filled(py, (states.rows, states.single), &[outputs, width], |out| {
            let scratch =
                || (states.scratch(), RegressorBlock::new(self.model.layout().clone(), states.block()));
            let per_state = outputs * width;
            let work = |from: usize, part: &mut [f64], (scratch, block): &mut (Scratch, RegressorBlock)| {
                let motion = scratch.take(&states, from, part.len() / per_state);
                self.model.regressor(&motion, &shape, block);
                for (o, targets) in targets.iter().enumerate() {
                    let (rows, stride) = (block.rows(o), block.stride());
                    for (s, state) in part.chunks_exact_mut(per_state).enumerate() {
                        let row = &mut state[o * width..][..width];
                        targets.iter().for_each(|(k, to)| row[*to] = rows[k * stride + s]);
                    }
                }
            };
            py.detach(|| by_chunks((threads, states.block()), per_state, out, scratch, work))
        })
    }

    /// Efforts that hold the bodies at rest against gravity, `(n, nv)`.
    fn gravity<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let batch = Batch::take("q", q, self.nq_nv().0)?;
        let rest = filled(py, (batch.rows, batch.single), &[self.nq_nv().1], |_| Ok(()))?;
        self.inverse_dynamics(py, q, rest.as_any(), rest.as_any(), None, 1)
    }

    /// Triangular factor of all rows of the regressor beside measured efforts, without forming them: `(R, z, rho)` with
    /// `‖W x - tau‖² = ‖R x - z‖² + rho²` for every `x`. Factors of many batches stack: reduce them again by QR.
    #[pyo3(signature = (q, v, a, tau, *, base=false, threads=1))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
    fn reduce<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        a: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
        base: bool,
        threads: usize,
    ) -> PyResult<(Matrix<'py>, Vector<'py>, f64)> {
        let (width, places) = self.places(py, "dynid", base)?;
        let given = Given::take(&self.model, q, v, a)?;
        let states = given.of(py, &self.model)?;
        let efforts = Batch::take("tau", tau, self.outputs())?;
        efforts.demand_rows("tau", states.rows)?;
        let measured = efforts.values()?;
        demand_finite("tau", measured, efforts.columns)?;
        let reduced = py.detach(|| self.triangle(&states, measured, (width, &places), threads))?;
        let reduced = reduced.map_err(|e| PyValueError::new_err(e.to_string()))?;
        let r = PyArray2::zeros(py, [width, width], false);
        {
            let mut to = r.try_readwrite()?;
            let to = to.as_slice_mut()?;
            for row in 0..width {
                (0..width).for_each(|c| to[row * width + c] = reduced.r(row, c));
            }
        }
        Ok((r, vector(py, &reduced.z()), reduced.rho()))
    }

    /// Base parameters: names of the kept parameters, expressions, and the matrix `K` with `base values = K parameters`.
    fn base_parameters<'py>(&self, py: Python<'py>) -> PyResult<(Vec<String>, Vec<String>, Matrix<'py>)> {
        let (base, table) = (self.base(), self.model.parameters());
        let names = base.kept.iter().map(|c| table.linear[*c].name.clone()).collect();
        let matrix = vector(py, &base.matrix()).reshape([base.len(), self.columns()])?;
        Ok((names, base.expressions(table), matrix))
    }

    /// Mass matrix of the rigid bodies, `(n, nv, nv)`; armature is not part of it.
    fn mass_matrix<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let dynamics = self.tree(py, "the mass matrix")?;
        let (nq, nv) = self.nq_nv();
        let batch = Batch::take("q", q, nq)?;
        let values = batch.values()?;
        demand_finite("q", values, nq)?;
        let inertias = self.robot.mechanism.inertia_vector();
        filled(py, (batch.rows, batch.single), &[nv, nv], |out| {
            py.detach(|| {
                let mut work = dynamics.workspace();
                for (q, out) in values.chunks_exact(nq.max(1)).zip(out.chunks_exact_mut((nv * nv).max(1))) {
                    out.copy_from_slice(&dynamics.mass_matrix(q, &inertias, &mut work));
                }
            });
            Ok(())
        })
    }

    /// Accelerations of the rigid bodies under efforts `tau`, `(n, nv)`.
    fn forward_dynamics<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        v: &Bound<'py, PyAny>,
        tau: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let dynamics = self.tree(py, "the forward dynamics")?;
        let (nq, nv) = self.nq_nv();
        let given = Given::take(&self.model, q, v, tau)?;
        let States { values: [q, v, tau], rows, single, .. } = given.of(py, &self.model)?;
        let inertias = self.robot.mechanism.inertia_vector();
        filled(py, (rows, single), &[nv], |out| {
            let found = py.detach(|| {
                let mut work = dynamics.forward_workspace();
                for (s, ddq) in out.chunks_exact_mut(nv.max(1)).enumerate() {
                    let state = LoadedState {
                        q: &q[s * nq..][..nq],
                        dq: &v[s * nv..][..nv],
                        effort: &tau[s * nv..][..nv],
                        gravity: None,
                    };
                    dynamics.forward_dynamics(&state, &inertias, AddedInertia::None, &mut work, ddq)?;
                }
                Ok(())
            });
            found.map_err(|e: dynid::model::dynamics::NotPositive| {
                let hint = "inertias of the robot file must be those of bodies: `identify` makes them so";
                unsupported(py, format!("forward dynamics: {e}"), hint)
            })
        })
    }

    /// What `dynid inspect --json` prints: tree, parameters, base parameters and what is folded into them.
    fn inspect(&self, py: Python<'_>) -> PyResult<String> {
        let found = inspect::inspect(&self.robot, None).map_err(|e| raise(py, &e))?;
        as_json(&found)
    }

    /// How the file was read, as keys of a configuration in JSON.
    #[getter]
    fn options(&self, py: Python<'_>) -> PyResult<String> {
        let RobotOptions { gravity, couple_mimics, floating_base, locked } = &self.options;
        if *floating_base {
            let hint = "a floating base cannot be identified: leave `floating_base` out";
            return Err(unsupported(py, "a robot with a floating base", hint));
        }
        let locked: BTreeMap<&String, f64> = locked.iter().map(|(joint, q)| (joint, *q)).collect();
        let mut keys = serde_json::json!({ "couple_mimics": couple_mimics, "locked": locked });
        if let Some(gravity) = gravity {
            keys["gravity"] = serde_json::json!(gravity);
        }
        Ok(keys.to_string())
    }

    fn __repr__(&self) -> String {
        let (nq, nv) = self.nq_nv();
        format!("<dynid.Robot {}: {nv} efforts, {nq} positions, {} bodies>", self.name(), self.links().len())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Pickled)> {
        let Some(text) = &self.text else {
            let text = format!("a robot of a file cannot be pickled: {}", self.robot.path.display());
            let hint = "pickle the path, or make it of a text: `Robot.parse(text, name)`";
            return Err(unsupported(py, text, hint));
        };
        let RobotOptions { gravity, couple_mimics, floating_base, locked } = &self.options;
        let state = (
            text.to_string(),
            self.robot.path.display().to_string(),
            (*gravity, *couple_mimics, *floating_base),
            locked.iter().cloned().collect(),
            self.robot.warnings.clone(),
        );
        Ok((py.get_type::<Robot>().getattr("restored")?, state))
    }
}

/// What is pickled of a robot: text, name, options, warnings.
type Pickled = (String, String, (Option<[f64; 3]>, bool, bool), BTreeMap<String, f64>, Vec<String>);

/// How a robot file is to be read.
fn options(
    gravity: Option<[f64; 3]>,
    couple_mimics: bool,
    floating_base: bool,
    locked: Option<BTreeMap<String, f64>>,
) -> RobotOptions {
    let locked = locked.unwrap_or_default().into_iter().collect();
    RobotOptions { gravity, couple_mimics, floating_base, locked }
}

impl Robot {
    /// Rows of every output reduced on their own, then merged: joints near the end have few columns.
    fn triangle(
        &self,
        states: &States<'_>,
        measured: &[f64],
        (width, places): (usize, &[Option<usize>]),
        threads: usize,
    ) -> PyResult<Result<Triangle, FactorError>> {
        let (outputs, layout) = (self.outputs(), self.model.layout());
        let shape = self.model.parameters().shape_start();
        let columns = self.targets(places);
        let mut builders: Vec<FactorBuilder> = columns.iter().map(|c| FactorBuilder::new(c.len())).collect();
        let (rows, chunk) = (states.rows, states.block());
        let (mut scratch, mut block) = (states.scratch(), RegressorBlock::new(layout.clone(), chunk));
        let mut run = || {
            let mut from = 0;
            while from < rows {
                let count = chunk.min(rows - from);
                self.model.regressor(&scratch.take(states, from, count), &shape, &mut block);
                let push = |(o, builder): (usize, &mut FactorBuilder)| {
                    let (values, stride, columns) = (block.rows(o), block.stride(), &columns[o]);
                    let offset = block.offset(o);
                    builder.push_with(count, |c, range, out| match columns.get(c) {
                        Some((k, _)) => out.copy_from_slice(&values[k * stride..][range]),
                        None => {
                            for (to, s) in out.iter_mut().zip(range) {
                                *to = measured[(from + s) * outputs + o] - offset[s];
                            }
                        }
                    })
                };
                match threads {
                    1 => builders.iter_mut().enumerate().try_for_each(push)?,
                    _ => builders.par_iter_mut().enumerate().try_for_each(push)?,
                }
                from += count;
            }
            Ok(())
        };
        let ran = match threads {
            0 | 1 => run(),
            n => pool(n)?.install(run),
        };
        Ok(ran.map(|()| {
            let parts = builders.into_iter().zip(&columns).map(|(builder, columns)| {
                let places: Vec<usize> = columns.iter().map(|c| c.1).collect();
                builder.finish().embed(width, &places)
            });
            let parts: Vec<Triangle> = parts.collect();
            Triangle::merge(&parts.iter().collect::<Vec<_>>())
        }))
    }
}

/// A robot that a function of the package describes in TOML.
/// `FILE#name:=value,name:=value`.
fn with_arguments(path: PathBuf, arguments: Option<&BTreeMap<String, String>>) -> PathBuf {
    let Some(arguments) = arguments.filter(|arguments| !arguments.is_empty()) else { return path };
    let stated: Vec<String> = arguments.iter().map(|(name, value)| format!("{name}:={value}")).collect();
    format!("{}#{}", path.display(), stated.join(",")).into()
}

fn described(py: Python<'_>, function: &str, model: &Bound<'_, PyAny>) -> PyResult<Robot> {
    let (text, warnings): (String, Vec<String>) =
        py.import("dynid._models")?.getattr(function)?.call1((model,))?.extract()?;
    let mut robot = dynid::Robot::parse(&text, Path::new("model.toml"), &RobotOptions::default())
        .map_err(|e| raise(py, &e))?;
    robot.warnings.extend(warnings);
    Robot::of(py, robot, Some(text.into()), RobotOptions::default())?.told(py)
}
