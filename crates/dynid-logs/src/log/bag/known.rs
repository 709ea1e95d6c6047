//! Fields of the messages that robots are logged with, for bags that do not say them: those in SQLite of ROS 2 up to Humble.

const HEADER: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const POINT: &str = "MSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n\
    ===\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n";
const VECTOR: &str = "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";
const LAYOUT: &str = "MSG: std_msgs/MultiArrayLayout\nstd_msgs/MultiArrayDimension[] dim\nuint32 data_offset\n===\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n";

/// The definition of a type.
pub(super) fn definition(kind: &str) -> Option<String> {
    let (fields, others): (&str, &[&str]) = match kind {
        "sensor_msgs/msg/JointState" => (
            "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",
            &[HEADER],
        ),
        "sensor_msgs/msg/Temperature" => {
            ("std_msgs/Header header\nfloat64 temperature\nfloat64 variance\n", &[HEADER])
        }
        "sensor_msgs/msg/Imu" => (
            "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n\
             geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n\
             geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n",
            &[HEADER, VECTOR, "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"],
        ),
        "geometry_msgs/msg/WrenchStamped" => (
            "std_msgs/Header header\ngeometry_msgs/Wrench wrench\n",
            &[
                HEADER,
                VECTOR,
                "MSG: geometry_msgs/Wrench\ngeometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque\n",
            ],
        ),
        "std_msgs/msg/Float64MultiArray" => ("std_msgs/MultiArrayLayout layout\nfloat64[] data\n", &[LAYOUT]),
        "std_msgs/msg/Float32MultiArray" => ("std_msgs/MultiArrayLayout layout\nfloat32[] data\n", &[LAYOUT]),
        "std_msgs/msg/Float64" => ("float64 data\n", &[]),
        "std_msgs/msg/Float32" => ("float32 data\n", &[]),
        "trajectory_msgs/msg/JointTrajectory" => (
            "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n",
            &[HEADER, POINT],
        ),
        "control_msgs/msg/DynamicJointState" => (
            "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values\n",
            &[HEADER, "MSG: control_msgs/InterfaceValue\nstring[] interface_names\nfloat64[] values\n"],
        ),
        _ => return None,
    };
    let mut text = fields.to_owned();
    for other in others {
        text.push_str("===\n");
        text.push_str(other);
    }
    Some(text)
}

#[cfg(test)]
mod tests {
    use super::super::definition::Definition;

    #[test]
    fn every_definition_is_whole() {
        let kinds = [
            "sensor_msgs/msg/JointState",
            "sensor_msgs/msg/Temperature",
            "sensor_msgs/msg/Imu",
            "geometry_msgs/msg/WrenchStamped",
            "std_msgs/msg/Float64MultiArray",
            "std_msgs/msg/Float32MultiArray",
            "std_msgs/msg/Float64",
            "std_msgs/msg/Float32",
            "trajectory_msgs/msg/JointTrajectory",
            "control_msgs/msg/DynamicJointState",
        ];
        for kind in kinds {
            let text = super::definition(kind).unwrap();
            Definition::parse(kind, &text).unwrap_or_else(|e| panic!("{kind}: {e}"));
        }
        assert!(super::definition("a/msg/B").is_none());
    }
}
