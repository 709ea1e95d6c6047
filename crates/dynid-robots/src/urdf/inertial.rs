//! A body about its centre of mass, and `<inertial>` as text.

use dynid_model::Inertia;

use crate::robot_numbers::is_in_range;

/// Centre of mass (m) and tensor about it (kg m²) in link axes, as URDF and MJCF state a body.
pub(crate) struct Inertial {
    pub(crate) mass: f64,
    pub(crate) com: [f64; 3],
    pub(crate) tensor: [[f64; 3]; 3],
}

impl Inertial {
    /// Splits the parameters about the frame origin; `Err` says why they cannot be stated that way.
    pub(crate) fn of(inertia: &Inertia) -> Result<Self, String> {
        if !inertia.0.iter().all(|x| x.is_finite()) {
            return Err("a parameter is not finite".to_owned());
        }
        let split = match inertia.about_com() {
            Some((com, about_com)) => Inertial { mass: inertia.mass(), com: com.0, tensor: about_com.rows() },
            None if inertia.first_moment().0 == [0.0; 3] => {
                Inertial { mass: 0.0, com: [0.0; 3], tensor: inertia.tensor().rows() }
            }
            None => return Err("it has a first moment but no mass, so no centre of mass".to_owned()),
        };
        split.within_range()
    }

    /// What readers take: numbers of moderate size, a denormal one as zero.
    fn within_range(mut self) -> Result<Self, String> {
        let numbers = self.com.iter_mut().chain(self.tensor.iter_mut().flatten()).chain([&mut self.mass]);
        for x in numbers {
            if x.is_subnormal() {
                *x = 0.0;
            }
            if !is_in_range(*x) {
                return Err(format!(
                    "its mass, centre of mass or tensor holds {x:e}, beyond what readers take"
                ));
            }
        }
        Ok(self)
    }

    /// The element over several lines; the first line is not indented, the others by `indent` and two spaces a level.
    pub(super) fn element(&self, indent: &str, newline: &str) -> String {
        let Inertial { mass, com: [x, y, z], tensor: [[xx, xy, xz], [_, yy, yz], [_, _, zz]] } = self;
        [
            "<inertial>".to_owned(),
            format!("{indent}  <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"0 0 0\"/>"),
            format!("{indent}  <mass value=\"{mass:?}\"/>"),
            format!(
                "{indent}  <inertia ixx=\"{xx:?}\" ixy=\"{xy:?}\" ixz=\"{xz:?}\" iyy=\"{yy:?}\" iyz=\"{yz:?}\" \
                 izz=\"{zz:?}\"/>"
            ),
            format!("{indent}</inertial>"),
        ]
        .join(newline)
    }
}
