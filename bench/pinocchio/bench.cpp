// Time of inverse dynamics and of the joint torque regressor in Pinocchio, one thread.
//
//     bench NAME=ROBOT.urdf ...
//
// prints one line per robot and function: `NAME inverse_dynamics plain NANOSECONDS`, the least of many repetitions.
// Models are built here, with the joint types that Pinocchio's own URDF reader picks, so that everything is compiled
// with the same flags: its prebuilt reader was compiled for another register width and lays memory out differently.
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <urdf_parser/urdf_parser.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace pin = pinocchio;
using Eigen::VectorXd;

static pin::SE3 placement(const urdf::Pose &pose) {
    Eigen::Quaterniond q(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
    return pin::SE3(q.normalized().toRotationMatrix(),
                    pin::SE3::Vector3(pose.position.x, pose.position.y, pose.position.z));
}

static pin::Inertia inertia(const urdf::Inertial &i) {
    pin::SE3::Matrix3 tensor;
    tensor << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
    const pin::SE3 at = placement(i.origin);
    return pin::Inertia(i.mass, at.translation(), at.rotation() * tensor * at.rotation().transpose());
}

static pin::JointIndex add_joint(pin::Model &model, pin::JointIndex parent, const urdf::Joint &joint,
                                 const pin::SE3 &at) {
    const pin::SE3::Vector3 axis = pin::SE3::Vector3(joint.axis.x, joint.axis.y, joint.axis.z).normalized();
    const bool turns = joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS;
    if (!turns && joint.type != urdf::Joint::PRISMATIC) throw std::runtime_error("joint type of " + joint.name);
    const auto X = pin::SE3::Vector3::UnitX(), Y = pin::SE3::Vector3::UnitY(), Z = pin::SE3::Vector3::UnitZ();
    if (turns) {
        if (axis == X) return model.addJoint(parent, pin::JointModelRX(), at, joint.name);
        if (axis == Y) return model.addJoint(parent, pin::JointModelRY(), at, joint.name);
        if (axis == Z) return model.addJoint(parent, pin::JointModelRZ(), at, joint.name);
        return model.addJoint(parent, pin::JointModelRevoluteUnaligned(axis), at, joint.name);
    }
    if (axis == X) return model.addJoint(parent, pin::JointModelPX(), at, joint.name);
    if (axis == Y) return model.addJoint(parent, pin::JointModelPY(), at, joint.name);
    if (axis == Z) return model.addJoint(parent, pin::JointModelPZ(), at, joint.name);
    return model.addJoint(parent, pin::JointModelPrismaticUnaligned(axis), at, joint.name);
}

// Adds everything that hangs on `link`, which sits at `at` on the body of joint `body`.
static void add_children(pin::Model &model, const urdf::Link &link, pin::JointIndex body, const pin::SE3 &at) {
    for (const auto &joint : link.child_joints) {
        const urdf::Link *child = nullptr;
        for (const auto &candidate : link.child_links)
            if (candidate->name == joint->child_link_name) child = candidate.get();
        const pin::SE3 joint_at = at * placement(joint->parent_to_joint_origin_transform);
        const bool fixed = joint->type == urdf::Joint::FIXED;
        const pin::JointIndex owner = fixed ? body : add_joint(model, body, *joint, joint_at);
        const pin::SE3 child_at = fixed ? joint_at : pin::SE3::Identity();
        if (child->inertial) model.appendBodyToJoint(owner, inertia(*child->inertial), child_at);
        add_children(model, *child, owner, child_at);
    }
}

template <typename Work> static double least_time(std::size_t samples, Work work) {
    using Clock = std::chrono::steady_clock;
    double least = 1e300;
    const auto end = Clock::now() + std::chrono::milliseconds(300);
    while (Clock::now() < end) {
        const auto start = Clock::now();
        for (int pass = 0; pass < 4; ++pass)
            for (std::size_t k = 0; k < samples; ++k) work(k);
        const std::chrono::duration<double, std::nano> spent = Clock::now() - start;
        least = std::min(least, spent.count() / (4.0 * static_cast<double>(samples)));
    }
    return least;
}

int main(int argc, char **argv) {
    for (int k = 1; k < argc; ++k) {
        const char *equals = std::strchr(argv[k], '=');
        if (!equals) {
            std::fprintf(stderr, "expected NAME=ROBOT.urdf, found %s\n", argv[k]);
            return 2;
        }
        const std::string name(argv[k], static_cast<std::size_t>(equals - argv[k]));
        const auto tree = urdf::parseURDFFile(equals + 1);
        if (!tree) return 2;
        pin::Model model;
        add_children(model, *tree->getRoot(), 0, pin::SE3::Identity());
        pin::Data data(model);
        const std::size_t samples = 64;
        std::vector<VectorXd> q, v, a;
        model.lowerPositionLimit.setConstant(-3.0);
        model.upperPositionLimit.setConstant(3.0);
        for (std::size_t s = 0; s < samples; ++s) {
            q.push_back(pin::randomConfiguration(model));
            v.push_back(VectorXd::Random(model.nv));
            a.push_back(VectorXd::Random(model.nv));
        }
        const double rnea = least_time(samples, [&](std::size_t s) { pin::rnea(model, data, q[s], v[s], a[s]); });
        std::printf("%s inverse_dynamics plain %.2f\n", name.c_str(), rnea);
        const double regressor = least_time(
            samples, [&](std::size_t s) { pin::computeJointTorqueRegressor(model, data, q[s], v[s], a[s]); });
        std::printf("%s regressor plain %.2f\n", name.c_str(), regressor);
        const VectorXd effort = pin::rnea(model, data, q[0], v[0], a[0]);
        pin::computeJointTorqueRegressor(model, data, q[0], v[0], a[0]);
        VectorXd phi(10 * (model.njoints - 1));
        for (int j = 1; j < model.njoints; ++j) phi.segment<10>(10 * (j - 1)) = model.inertias[j].toDynamicParameters();
        const double error = (data.jointTorqueRegressor * phi - effort).norm();
        if (!(error <= 1e-9 * effort.norm())) {
            std::fprintf(stderr, "%s: regressor and inverse dynamics differ by %g\n", name.c_str(), error);
            return 1;
        }
    }
}
