//! Laws under names of their own: elements that stand for an [`AtJoint`](super::AtJoint).

/// Makes a type with a function `at_joint(&self)`, that says which law at which joint it is, an element. The element is a type without
/// parameters, so that the law's loops are compiled with it, and not once more with everyone who puts it into a list.
macro_rules! stands_for_a_law {
    ($name:ty) => {
        impl $crate::element::JointElement for $name {
            fn rates(&self) -> Vec<usize> {
                self.at_joint().rates()
            }
            fn parameters(&self, joints: &[$crate::element::JointInfo]) -> Vec<$crate::Parameter> {
                self.at_joint().parameters(joints)
            }
            fn shape(&self, joints: &[$crate::element::JointInfo]) -> Vec<$crate::ShapeParameter> {
                self.at_joint().shape(joints)
            }
            fn is_friction(&self) -> bool {
                self.at_joint().is_friction()
            }
            fn channels(&self, joints: &[$crate::element::JointInfo]) -> Vec<String> {
                self.at_joint().channels(joints)
            }
            fn entries(&self) -> Vec<(usize, usize)> {
                self.at_joint().entries()
            }
            fn fill(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::MotionBlock<'_>,
                shape: &[f64],
                out: &mut $crate::element::ElementColumns<'_>,
            ) {
                self.at_joint().fill(joints, motion, shape, out);
            }
            fn jets(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::element::JetMotion<'_>,
                shape: &[f64],
                out: &mut [$crate::scalar::Jet],
            ) -> bool {
                self.at_joint().jets(joints, motion, shape, out)
            }
            fn shape_entries(&self) -> Vec<(usize, usize)> {
                self.at_joint().shape_entries()
            }
            fn shape_derivatives(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::MotionBlock<'_>,
                shape: &[f64],
                out: &mut $crate::element::ElementColumns<'_>,
            ) {
                self.at_joint().shape_derivatives(joints, motion, shape, out);
            }
            fn fill_with_derivatives(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::MotionBlock<'_>,
                shape: &[f64],
                values: &mut $crate::element::ElementColumns<'_>,
                derivatives: &mut $crate::element::ElementColumns<'_>,
            ) {
                self.at_joint().fill_with_derivatives(joints, motion, shape, values, derivatives);
            }
            fn shape_adjoint(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::MotionBlock<'_>,
                shape: &[f64],
                weights: &$crate::element::ElementWeights<'_>,
                out: &mut $crate::dynamics::MotionAdjoint,
            ) {
                self.at_joint().shape_adjoint(joints, motion, shape, weights, out);
            }
            fn adjoint(
                &self,
                joints: &[$crate::element::JointInfo],
                motion: &$crate::MotionBlock<'_>,
                shape: &[f64],
                weights: &$crate::element::ElementWeights<'_>,
                out: &mut $crate::dynamics::MotionAdjoint,
            ) {
                self.at_joint().adjoint(joints, motion, shape, weights, out);
            }
        }
    };
}

pub(in crate::element) use stands_for_a_law;
