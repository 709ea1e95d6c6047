"""Closed mechanisms in Pinocchio: makes pinocchio_{fourbar,stewart,delta}.json.

Needs numpy and Pinocchio 4 (`pip install pin numpy`). Arguments: the folder to write to (default: that of this file),
then, on request, a folder with reference data mech_<robot>.json, with which Pinocchio is compared first (nothing of them
is written).

Robots are read from robots/*.toml. Accelerations and forces come from Pinocchio's `constraintDynamics`:

- fourbar: the pin as a 3D point. Its row along z is zero and its force 0: proximal iterations deal with it.
- stewart: six 3D points.
- delta: Pinocchio has no universal joint to cut. The platform is split in three alike, each behind the two axes of a
  wrist, and two 6D welds join them: another tree and other constraints than in the robot file. The wrists' forces are
  reactions of joints there.

Every state is then put to the test in the tree of the robot file: closures, their rates and accelerations; all
equations of motion with the forces of the closures; and virtual power of bodies, whose wrenches are formed here from
first principles.
"""

import json
import math
import sys
import tomllib
from pathlib import Path

import numpy as np
import pinocchio as pin

HERE = Path(__file__).resolve().parent
ROBOTS = HERE.parents[3] / "robots"
# Largest deviation of driven positions from home, rates and efforts.
RANGES = {"fourbar": (1.5, 3.0, 5.0), "stewart": (0.06, 0.3, 100.0), "delta": (0.35, 2.0, 4.0)}
STATES = 100
KINDS = {"spherical": 3, "planar_revolute": 2, "universal": 4}


def angle(x):
    return float(x.removesuffix("deg")) * (math.pi / 180.0) if isinstance(x, str) else float(x)


def placement(table, xyz, rpy):
    turned = pin.rpy.rpyToMatrix(*(angle(x) for x in table.get(rpy, [0, 0, 0])))
    return pin.SE3(turned, np.array(table.get(xyz, [0, 0, 0]), dtype=float))


def inertia(phi, share=1.0):
    m, h, (xx, xy, xz, yy, yz, zz) = phi[0], np.array(phi[1:4]), phi[4:]
    if m == 0.0:
        return pin.Inertia.Zero()
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shift = (h @ h * np.eye(3) - np.outer(h, h)) / m
    return pin.Inertia(share * m, h / m, share * (about_origin - shift))


def needed_wrench(phi, omega, alpha, a):
    """Force and moment about the origin that a body needs."""
    m, h, (xx, xy, xz, yy, yz, zz) = phi[0], np.array(phi[1:4]), phi[4:]
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    force = m * a + np.cross(alpha, h) + np.cross(omega, np.cross(omega, h))
    return np.hstack([force, matrix @ alpha + np.cross(omega, matrix @ omega) + np.cross(h, a)])


JOINTS = {
    "revolute": lambda axis: pin.JointModelRevoluteUnaligned(axis),
    "prismatic": lambda axis: pin.JointModelPrismaticUnaligned(axis),
    "floating": lambda axis: pin.JointModelFreeFlyer(),
}


class Tree:
    """The tree of a robot file and its closures."""

    def __init__(self, name):
        with open(ROBOTS / f"{name}.toml", "rb") as file:
            self.robot = tomllib.load(file)
        self.model = pin.Model()
        self.model.gravity.linear = np.array(self.robot["gravity"], dtype=float)
        self.ids, self.phi = {"ground": 0}, {}
        for body in self.robot["body"]:
            joint = body["joint"]
            kind = JOINTS[joint["kind"]](np.array(joint.get("axis", [1, 0, 0]), dtype=float))
            parent = self.ids[body["parent"]]
            k = self.model.addJoint(parent, kind, placement(joint, "xyz", "rpy"), body["name"])
            self.model.appendBodyToJoint(k, inertia(body["phi"]), pin.SE3.Identity())
            self.ids[body["name"]], self.phi[k] = k, body["phi"]
        self.loops = [
            (c, placement(c, "a_xyz", "a_rpy"), placement(c, "b_xyz", "b_rpy")) for c in self.robot["loop"]
        ]
        self.data = self.model.createData()
        own = [self.model.joints[self.ids[name]] for name in self.robot["actuated"]]
        self.driven = [j.idx_v for j in own]
        self.passive = [k for k in range(self.model.nv) if k not in self.driven]

    def home(self):
        values = (self.robot["home"][name] for name in self.model.names[1:])
        return np.array([x for v in values for x in (v if isinstance(v, list) else [v])], dtype=float)

    def frames(self, loop):
        closure, in_a, in_b = loop
        a, b = self.ids[closure["a"]], self.ids[closure["b"]]
        return a, b, self.data.oMi[a] * in_a, self.data.oMi[b] * in_b

    def closures(self, q):
        """Residuals and their Jacobian, which holds where the residuals are zero."""
        pin.computeJointJacobians(self.model, self.data, q)
        gamma, rows = [], []
        for loop in self.loops:
            a, b, at_a, at_b = self.frames(loop)
            kind, axes = loop[0]["kind"], at_a.rotation
            count = min(KINDS[kind], 3)
            move = [np.zeros((6, self.model.nv)) for _ in "ab"]
            for out, k in zip(move, (a, b)):
                if k:
                    body = pin.getJointJacobian(self.model, self.data, k, pin.LOCAL_WORLD_ALIGNED)
                    arm = at_b.translation - self.data.oMi[k].translation
                    out[:3], out[3:] = body[:3] - pin.skew(arm) @ body[3:], body[3:]
            relative = move[1] - move[0]
            gamma.append((axes.T @ (at_b.translation - at_a.translation))[:count])
            rows.append((axes.T @ relative[:3])[:count])
            if kind == "universal":
                x, y = axes[:, 0], at_b.rotation[:, 1]
                gamma.append([x @ y])
                rows.append((np.cross(y, x) @ relative[3:])[None])
        return np.hstack(gamma), np.vstack(rows)

    def close(self, q):
        """Newton in the passive coordinates."""
        for _ in range(30):
            gamma, jacobian = self.closures(q)
            if np.max(np.abs(gamma)) < 1e-15:
                break
            step = np.zeros(self.model.nv)
            step[self.passive] = -np.linalg.lstsq(jacobian[:, self.passive], gamma, rcond=None)[0]
            q = pin.integrate(self.model, q, step)
        gamma, jacobian = self.closures(q)
        assert np.max(np.abs(gamma)) < 1e-13, gamma
        return q, jacobian

    def reach(self, driven):
        """Closed position at driven coordinates, by small steps from home: the same assembly mode."""
        q = self.close(self.home())[0]
        start = np.array([q[self.model.joints[self.ids[n]].idx_q] for n in self.robot["actuated"]])
        for share in np.linspace(0.0, 1.0, 9)[1:]:
            for name, x in zip(self.robot["actuated"], start + share * (driven - start)):
                q[self.model.joints[self.ids[name]].idx_q] = x
            q, jacobian = self.close(q)
        return q, jacobian

    def rates(self, jacobian):
        """Columns: rates at unit rates of the driven joints."""
        out = np.zeros((self.model.nv, len(self.driven)))
        out[self.driven] = np.eye(len(self.driven))
        solved = np.linalg.lstsq(jacobian[:, self.passive], jacobian[:, self.driven], rcond=None)[0]
        out[self.passive] = -solved
        return out

    def check(self, q, dq, effort, ddq, forces):
        """Largest faults of a state: closures, rates, accelerations, equations of motion, virtual power."""
        gamma, jacobian = self.closures(q)
        # Of forces and moments at Q on b, and against them on a, world axes.
        by_closures = np.zeros(self.model.nv)
        for loop, wrench in zip(self.loops, forces):
            a, b, at_a, at_b = self.frames(loop)
            for sign, k in ((1.0, b), (-1.0, a)):
                if not k:
                    continue
                body = pin.getJointJacobian(self.model, self.data, k, pin.LOCAL_WORLD_ALIGNED)
                arm = at_b.translation - self.data.oMi[k].translation
                force = np.array(wrench["force"])
                moment = np.array(wrench.get("moment", [0, 0, 0])) + np.cross(arm, force)
                by_closures += sign * body.T @ np.hstack([force, moment])
        tree = pin.rnea(self.model, self.data, q, dq, ddq).copy()
        given = np.zeros(self.model.nv)
        given[self.driven] = effort
        size = np.max(np.abs(tree)) + np.max(np.abs(given))
        equations = np.max(np.abs(tree - given - by_closures)) / size

        pin.forwardKinematics(self.model, self.data, q, dq, ddq)
        accelerations = []
        for loop in self.loops:
            a, b, at_a, at_b = self.frames(loop)
            (acc_a, alpha_a, om_a), (acc_b, alpha_b, om_b) = self.point(a, loop[1]), self.point(b, loop[2])
            accelerations.append((at_a.rotation.T @ (acc_b - acc_a))[: min(KINDS[loop[0]["kind"]], 3)])
            if loop[0]["kind"] == "universal":
                e, f, rel = at_a.rotation[:, 0], at_b.rotation[:, 1], om_b - om_a
                turn = np.cross(np.cross(om_b, f), e) + np.cross(f, np.cross(om_a, e))
                accelerations.append([np.cross(f, e) @ (alpha_b - alpha_a) + rel @ turn])

        power = np.zeros(len(self.driven))
        terms = np.zeros(len(self.driven))
        unit = self.rates(jacobian)
        for k, phi in self.phi.items():
            velocity, acceleration = self.data.v[k], self.data.a[k]
            gravity = self.data.oMi[k].rotation.T @ self.model.gravity.linear
            a = acceleration.linear + np.cross(velocity.angular, velocity.linear) - gravity
            wrench = needed_wrench(phi, velocity.angular, acceleration.angular, a)
            one = (pin.getJointJacobian(self.model, self.data, k, pin.LOCAL) @ unit).T @ wrench
            power, terms = power + one, terms + np.abs(one)
        virtual = np.max(np.abs(power - effort)) / (np.max(terms) + np.max(np.abs(effort)))
        closed = [np.max(np.abs(x)) for x in (gamma, jacobian @ dq, np.hstack(accelerations))]
        return np.array([*closed, equations, virtual])

    def point(self, k, inside):
        """Acceleration of a frame's origin, angular acceleration and velocity, world axes."""
        at, velocity, acceleration = self.data.oMi[k], self.data.v[k], self.data.a[k]
        r, omega, alpha = inside.translation, velocity.angular, acceleration.angular
        origin = acceleration.linear + np.cross(omega, velocity.linear)
        moved = origin + np.cross(alpha, r) + np.cross(omega, np.cross(omega, r))
        return at.rotation @ moved, at.rotation @ alpha, at.rotation @ omega


def solve(model, constraints, q, dq, effort):
    data = model.createData()
    models = pin.StdVec_RigidConstraintModel()
    datas = pin.StdVec_RigidConstraintData()
    for c in constraints:
        models.append(c)
        datas.append(c.createData())
    pin.initConstraintDynamics(model, data, models, datas)
    # Proximal iterations: exact for rows that depend on others, a fixed point otherwise.
    settings = pin.ProximalSettings(1e-14, 1e-14, 1e-9, 20)
    ddq = pin.constraintDynamics(model, data, q, dq, effort, models, datas, settings).copy()
    return ddq, [c.contact_force.copy() for c in datas], data


class Points:
    """Closures at points: the tree of the robot file itself."""

    def __init__(self, name):
        self.tree = Tree(name)
        model = self.tree.model
        self.constraints = [
            pin.RigidConstraintModel(
                pin.ContactType.CONTACT_3D, model, self.tree.ids[c["a"]], in_a, self.tree.ids[c["b"]], in_b, pin.LOCAL
            )
            for c, in_a, in_b in self.tree.loops
        ]

    def solve(self, q, dq, effort):
        tree = self.tree
        given = np.zeros(tree.model.nv)
        given[tree.driven] = effort
        ddq, found, data = solve(tree.model, self.constraints, q, dq, given)
        pin.forwardKinematics(tree.model, tree.data, q)
        forces = []
        for loop, force in zip(tree.loops, found):
            _, _, at_a, _ = tree.frames(loop)
            # Pinocchio's acts on the first body, ours on the second.
            forces.append({"force": -(at_a.rotation @ force.linear)})
        return ddq, forces


class Split:
    """The delta robot with its platform in three parts, each behind a wrist."""

    def __init__(self, name):
        self.tree = Tree(name)
        order, model = [], pin.Model()
        model.gravity.linear = self.tree.model.gravity.linear.copy()
        phi = next(b["phi"] for b in self.tree.robot["body"] if b["name"] == "platform")
        self.wrists, ids = [], {"ground": 0}
        # Depth first: a wrist right behind its rod.
        for body in self.tree.robot["body"]:
            if body["name"] == "platform":
                continue
            joint = body["joint"]
            k = model.addJoint(
                ids[body["parent"]],
                JOINTS[joint["kind"]](np.array(joint["axis"], dtype=float)),
                placement(joint, "xyz", "rpy"),
                body["name"],
            )
            model.appendBodyToJoint(k, inertia(body["phi"]), pin.SE3.Identity())
            ids[body["name"]] = k
            order.append(body["name"])
            for c, in_a, in_b in self.tree.loops:
                if c["a"] == body["name"]:
                    first = model.addJoint(k, pin.JointModelRX(), in_a, c["name"] + "_x")
                    second = model.addJoint(first, pin.JointModelRY(), pin.SE3.Identity(), c["name"] + "_y")
                    inside = in_b.inverse()
                    model.appendBodyToJoint(second, inertia(phi, 1.0 / len(self.tree.loops)), inside)
                    self.wrists.append((first, second, inside, k, in_a, in_b))
        self.model, self.ids, self.order = model, ids, order
        _, one, at_one, *_ = self.wrists[0]
        self.constraints = [
            pin.RigidConstraintModel(pin.ContactType.CONTACT_6D, model, one, at_one, other, at_other, pin.LOCAL)
            for _, other, at_other, *_ in self.wrists[1:]
        ]

    def solve(self, q, dq, effort):
        tree, model = self.tree, self.model
        pin.forwardKinematics(tree.model, tree.data, q, dq)
        here, rate = pin.neutral(model), np.zeros(model.nv)
        for name in self.order:
            j, own = model.joints[self.ids[name]], tree.model.joints[tree.ids[name]]
            here[j.idx_q], rate[j.idx_v] = q[own.idx_q], dq[own.idx_v]
        platform = tree.ids["platform"]
        for (first, second, _, _, in_a, in_b), loop in zip(self.wrists, tree.loops):
            rod = tree.ids[loop[0]["a"]]
            at_a, at_b = tree.data.oMi[rod] * in_a, tree.data.oMi[platform] * in_b
            r = at_a.rotation.T @ at_b.rotation
            x, y = math.atan2(r[2, 1], r[1, 1]), math.atan2(r[0, 2], r[0, 0])
            omega = tree.data.oMi[platform].rotation @ tree.data.v[platform].angular
            omega = omega - tree.data.oMi[rod].rotation @ tree.data.v[rod].angular
            axes = np.column_stack([at_a.rotation[:, 0], at_b.rotation[:, 1]])
            turning = np.linalg.lstsq(axes, omega, rcond=None)[0]
            for k, position, speed in ((first, x, turning[0]), (second, y, turning[1])):
                here[model.joints[k].idx_q], rate[model.joints[k].idx_v] = position, speed
        given = np.zeros(model.nv)
        for name, x in zip(tree.robot["actuated"], effort):
            given[model.joints[self.ids[name]].idx_v] = x
        acc, found, data = solve(model, self.constraints, here, rate, given)

        outside = pin.StdVec_Force()
        for _ in range(model.njoints):
            outside.append(pin.Force.Zero())
        for weld, c in zip(found, self.constraints):
            outside[c.joint1_id] = outside[c.joint1_id] + c.joint1_placement.act(weld)
            in_second = (data.oMi[c.joint2_id] * c.joint2_placement).actInv(data.oMi[c.joint1_id] * c.joint1_placement)
            outside[c.joint2_id] = outside[c.joint2_id] - c.joint2_placement.act(in_second.act(weld))
        free = pin.rnea(model, data, here, rate, acc, outside).copy()
        assert np.max(np.abs(free - given)) < 1e-9, "forces of the welds"
        forces = []
        for _, second, *_ in self.wrists:
            turned, wrench = data.oMi[second].rotation, data.f[second]
            forces.append({"force": turned @ wrench.linear, "moment": turned @ wrench.angular})

        ddq = np.zeros(tree.model.nv)
        for name in self.order:
            ddq[tree.model.joints[tree.ids[name]].idx_v] = acc[model.joints[self.ids[name]].idx_v]
        pin.forwardKinematics(model, data, here, rate, acc)
        _, one, inside, *_ = self.wrists[0]
        at = tree.model.joints[platform].idx_v
        ddq[at : at + 6] = inside.actInv(data.a[one]).vector
        return ddq, forces


MECHANISMS = {"fourbar": Points, "stewart": Points, "delta": Split}


def compare(name, folder):
    """Differences from reference data, relative to the largest number of a state."""
    mechanism = MECHANISMS[name](name)
    golden = json.loads((Path(folder) / f"mech_{name}.json").read_text())
    worst = np.zeros(2)
    for state in golden["states"]:
        q, dq = np.array(state["q"], dtype=float), np.array(state["qd"], dtype=float)
        ddq, forces = mechanism.solve(q, dq, np.array(state["effort"], dtype=float))
        found = multipliers(mechanism.tree, q, forces)
        for k, (x, key) in enumerate(((ddq, "qdd"), (found, "multipliers"))):
            y = np.array(state[key])
            worst[k] = max(worst[k], np.max(np.abs(x - y)) / max(1.0, np.max(np.abs(y))))
    print(f"{name}: {len(golden['states'])} reference states: accelerations {worst[0]:.1e}, multipliers {worst[1]:.1e}")
    assert np.max(worst) < 1e-8


def multipliers(tree, q, forces):
    """Forces as components along the axes of frames a, and the couple of a universal joint."""
    pin.forwardKinematics(tree.model, tree.data, q)
    out = []
    for loop, wrench in zip(tree.loops, forces):
        _, _, at_a, at_b = tree.frames(loop)
        out.extend((at_a.rotation.T @ wrench["force"])[: min(KINDS[loop[0]["kind"]], 3)])
        if loop[0]["kind"] == "universal":
            out.append(np.cross(at_b.rotation[:, 1], at_a.rotation[:, 0]) @ wrench["moment"])
    return np.array(out)


def make(name, seed, folder):
    mechanism = MECHANISMS[name](name)
    tree = mechanism.tree
    rng = np.random.default_rng(seed)
    reach, speed, strength = RANGES[name]
    home = np.array([tree.robot["home"][j] for j in tree.robot["actuated"]], dtype=float)
    states, worst = [], np.zeros(5)
    for _ in range(STATES):
        driven = home + rng.uniform(-reach, reach, len(home))
        q, jacobian = tree.reach(driven)
        dq = tree.rates(jacobian) @ rng.uniform(-speed, speed, len(home))
        effort = rng.uniform(-strength, strength, len(home))
        ddq, forces = mechanism.solve(q, dq, effort)
        worst = np.maximum(worst, tree.check(q, dq, effort, ddq, forces))
        # Adding 0 takes the sign off zeros.
        plain = {k: (x + 0.0).tolist() for k, x in (("q", q), ("dq", dq), ("effort", effort), ("ddq", ddq))}
        states.append(plain | {"closures": [{k: (x + 0.0).tolist() for k, x in f.items()} for f in forces]})
    told = ("closure", "rate", "acceleration", "equations of motion", "virtual power")
    print(f"{name}: {STATES} states: " + ", ".join(f"{t} {x:.1e}" for t, x in zip(told, worst)))
    # m or -; the second derivative in their unit over s2; relative.
    assert worst[0] < 1e-13 and worst[1] < 1e-12 and np.max(worst[2:]) < 1e-9
    header = {
        "robot": f"robots/{name}.toml",
        "library": f"pinocchio {pin.__version__}",
        "made_by": Path(__file__).name,
        "seed": seed,
        "method": {
            "fourbar": "constraintDynamics, CONTACT_3D at the pin, proximal",
            "stewart": "constraintDynamics, six CONTACT_3D",
            "delta": "constraintDynamics, platform in three parts behind wrist joints, two CONTACT_6D welds",
        }[name],
        "convention": "SI, rad; q and rates in file order of joints; floating joint: q = x y z qx qy qz qw, rates = "
        "velocity of the origin then angular velocity in body axes, ddq their plain time derivatives; effort of the "
        "actuated joints in their order; closures in file order: force (N) and moment (N m) on body b at the closure's "
        "point, world axes; tree effort = S effort + J^T lambda",
    }
    if name == "fourbar":
        header["note"] = "the force along z is of no row in the robot file: 0"
    lines = ",\n".join(json.dumps(s, separators=(",", ":")) for s in states)
    joints = json.dumps({"joints": list(tree.model.names[1:]), "actuated": tree.robot["actuated"]})
    closures = json.dumps([c["name"] for c, *_ in tree.loops])
    text = f'{{"header":{json.dumps(header)},\n{joints[1:-1]},"closures":{closures},\n"states":[\n{lines}\n]}}\n'
    json.loads(text)
    path = Path(folder) / f"pinocchio_{name}.json"
    path.write_text(text)
    print(f"{path.name}: {len(text) / 1000:.0f} kB")


folder = sys.argv[1] if len(sys.argv) > 1 else HERE
for seed, name in enumerate(MECHANISMS, start=1):
    if len(sys.argv) > 2:
        compare(name, sys.argv[2])
    make(name, seed, folder)
