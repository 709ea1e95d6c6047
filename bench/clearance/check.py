"""Floor and own links of designed motions, checked with Pinocchio and coal.

    python check.py DESIGN_DIR ROBOT [--packages DIR]... [--instants N] [--name NAME]

DESIGN_DIR holds `design.json` of `dynid design ROBOT`. Nothing of dynid takes part in the check but the coefficients of the
motion and the list of pairs that it says it does not keep apart. Kinematics are Pinocchio's, distances are coal's.

Geometry: the collision meshes and primitives of the URDF, where all of them are there; else capsules of coal along the chain of
joints, built here from the joint placements. Prints one row of a Markdown table; exit code 1 if a distance or a height is
less than the margin.
"""

import argparse
import itertools
import json
import math
import pathlib
import sys
import tomllib

import coal
import numpy as np
import pinocchio as pin

SLENDERNESS = 0.055
ROUNDING = 1e-6


def from_dh(path):
    """A model from rows of modified Denavit-Hartenberg parameters."""
    robot = tomllib.loads(path.read_text())
    assert robot["dh"] == "modified"

    def angle(x):
        return math.radians(float(x[:-3])) if isinstance(x, str) else float(x)

    model = pin.Model()
    parent = 0
    for k, row in enumerate(robot["joint"]):
        alpha, theta = angle(row["alpha"]), angle(row["offset"])
        turn = pin.SE3(pin.utils.rotate("x", alpha), np.zeros(3))
        shift = pin.SE3(np.eye(3), np.array([float(row["a"]), 0.0, 0.0]))
        screw = pin.SE3(pin.utils.rotate("z", theta), np.array([0.0, 0.0, float(row["d"])]))
        parent = model.addJoint(parent, pin.JointModelRZ(), turn * shift * screw, row["name"])
        frame = pin.Frame(f"link{k + 1}", parent, 0, pin.SE3.Identity(), pin.FrameType.BODY)
        model.addFrame(frame)
    return model


def read_model(path):
    if path.suffix == ".toml":
        return from_dh(path), None
    return pin.buildModelFromUrdf(str(path)), path


def link_of(model, joint):
    """The link that a joint moves: the first body frame on it."""
    if joint == 0:
        return "base"
    frames = [f for f in model.frames if f.parentJoint == joint and f.type == pin.FrameType.BODY]
    return frames[0].name


class Body:
    """Convex parts of one moving body in the frame of its joint, with the exact parts they stand for."""

    def __init__(self, joint):
        self.joint = joint
        self.parts = []  # (placement, convex shape, exact shape or None)
        self.spheres = []  # (point, radius): all that lies within a radius of these points, for heights
        self.links = set()


def bodies_of_urdf(model, urdf, packages):
    """Bodies from the collision shapes of a URDF; None if a mesh is not there."""
    try:
        geometry = pin.buildGeomFromUrdf(model, str(urdf), pin.GeometryType.COLLISION, packages)
    except ValueError as fault:
        print(f"{urdf}: {fault}", file=sys.stderr)
        return None
    if not geometry.geometryObjects:
        return None
    bodies = {}
    for item in geometry.geometryObjects:
        body = bodies.setdefault(item.parentJoint, Body(item.parentJoint))
        body.links.add(model.frames[item.parentFrame].name)
        shape = item.geometry
        if isinstance(shape, coal.BVHModelBase):
            vertices = np.asarray(shape.vertices()) * item.meshScale
            assert np.allclose(item.meshScale, 1.0)
            shape.buildConvexHull(True, "Qt")
            body.parts.append((item.placement, shape.convex, shape))
            at = vertices @ item.placement.rotation.T + item.placement.translation
            body.spheres += [(point, 0.0) for point in hull_points(at)]
        else:
            body.parts.append((item.placement, shape, None))
            body.spheres += extremes(shape, item.placement)
    return bodies


def hull_points(points):
    """Points that are extreme in some of many directions: heights of the others lie between."""
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(4000, 3))
    return points[np.unique(np.argmax(points @ directions.T, axis=0))]


def extremes(shape, placement):
    """Points with radii whose hull holds a primitive."""
    if isinstance(shape, coal.Sphere):
        return [(placement.translation, shape.radius)]
    if isinstance(shape, coal.Capsule):
        ends = [np.array([0.0, 0.0, s * shape.halfLength]) for s in (-1, 1)]
        return [(placement.act(end), shape.radius) for end in ends]
    if isinstance(shape, coal.Cylinder):
        turns = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
        rim = [np.array([shape.radius * np.cos(a), shape.radius * np.sin(a), s * shape.halfLength]) for a in turns for s in (-1, 1)]
        return [(placement.act(point), 0.0) for point in rim]
    if isinstance(shape, coal.Box):
        corners = itertools.product(*[(-h, h) for h in shape.halfSide])
        return [(placement.act(np.array(corner)), 0.0) for corner in corners]
    raise TypeError(shape)


def bodies_of_chain(model):
    """Bodies as capsules from joint to joint, of a radius that follows from the length of the longest chain."""
    length = [0.0] * model.njoints
    for joint in range(1, model.njoints):
        if model.parents[joint] != 0:
            length[joint] = length[model.parents[joint]] + np.linalg.norm(model.jointPlacements[joint].translation)
    radius = SLENDERNESS * max(length)
    bodies = {}
    for joint in range(model.njoints):
        ends = [model.jointPlacements[c].translation for c in range(1, model.njoints) if model.parents[c] == joint]
        if not ends and joint > 0:
            fixed = [f.placement.translation for f in model.frames if f.parentJoint == joint]
            ends = [max(fixed, key=np.linalg.norm)]
        for end in ends:
            length = np.linalg.norm(end)
            if length < 1e-6:
                continue
            body = bodies.setdefault(joint, Body(joint))
            body.links.add(link_of(model, joint))
            rotation = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), end).toRotationMatrix()
            body.parts.append((pin.SE3(rotation, 0.5 * end), coal.Capsule(radius, length), None))
            body.spheres += [(np.zeros(3), radius), (end, radius)]
    return bodies, radius


def positions(design, instants):
    """Positions of all joints, one row per instant of a period, from the Fourier coefficients."""
    form = design["trajectory"]
    omega, harmonics = 2.0 * np.pi / form["period_s"], form["harmonics"]
    time = form["period_s"] * np.arange(instants) / instants
    angle = np.outer(time, omega * np.arange(1, harmonics + 1))
    rows = np.array(form["coefficients"])
    return rows[:, 0] + np.sin(angle) @ rows[:, 1 : 1 + harmonics].T + np.cos(angle) @ rows[:, 1 + harmonics :].T


def distance(first, second, request):
    result = coal.DistanceResult()
    (a, at), (b, bt) = first, second
    return coal.distance(a, coal.Transform3s(at.rotation, at.translation), b, coal.Transform3s(bt.rotation, bt.translation), request, result)


def body_distance(first, second, places, enough, request):
    """Distance of two bodies; beyond `enough` that of their convex hulls."""
    least = math.inf
    for (p, hull, exact), (q, other_hull, other_exact) in itertools.product(first.parts, second.parts):
        at, bt = places[first.joint] * p, places[second.joint] * q
        found = distance((hull, at), (other_hull, bt), request)
        if found < enough and (exact or other_exact):
            found = distance((exact or hull, at), (other_exact or other_hull, bt), request)
        least = min(least, found)
    return least


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("design", type=pathlib.Path)
    parser.add_argument("robot", type=pathlib.Path)
    parser.add_argument("--packages", action="append", default=[])
    parser.add_argument("--instants", type=int, default=10_000)
    parser.add_argument("--name")
    args = parser.parse_args()
    design = json.loads((args.design / "design.json").read_text())
    safety = design["safety"]
    margin = safety["margin_m"]
    model, urdf = read_model(args.robot)
    bodies = bodies_of_urdf(model, urdf, args.packages) if urdf else None
    geometry = "collision shapes of the URDF"
    if bodies is None:
        bodies, radius = bodies_of_chain(model)
        geometry = f"capsules of {1e3 * radius:.0f} mm along the chain"

    body_of = {}
    for body in bodies.values():
        for link in body.links:
            body_of[link] = body.joint
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY:
            body_of.setdefault(frame.name, frame.parentJoint)
    # Frames of a robot in TOML have names that dynid gave them: the base and one per joint.
    names = {}
    for capsule in safety["capsules"]:
        names.setdefault(capsule["link"], body_of.get(capsule["link"], 0))
    exempt = {frozenset(names[link] for link in pair["links"]) for pair in safety["exempt"]}

    pairs = []
    for a, b in itertools.combinations(sorted(bodies), 2):
        if model.parents[b] != a and model.parents[a] != b:
            pairs.append((a, b))
    kept = [pair for pair in pairs if frozenset(pair) not in exempt]
    spared = [pair for pair in pairs if frozenset(pair) in exempt]

    order = [model.joints[model.getJointId(name)].idx_q for name in design["joints"]]
    data = model.createData()
    request = coal.DistanceRequest(True, True)
    least = {pair: math.inf for pair in pairs}
    height = {joint: math.inf for joint in bodies if joint > 0}
    up = np.array(safety["planes"][0]["normal"]) if safety["planes"] else np.array([0.0, 0.0, 1.0])
    clouds = {j: (np.array([p for p, _ in bodies[j].spheres]), np.array([r for _, r in bodies[j].spheres])) for j in height}
    for row in positions(design, args.instants):
        q = pin.neutral(model)
        for place, x in zip(order, row):
            q[place] = x
        pin.forwardKinematics(model, data, q)
        for pair in pairs:
            found = body_distance(bodies[pair[0]], bodies[pair[1]], data.oMi, margin + 0.05, request)
            least[pair] = min(least[pair], found)
        for joint, (points, radii) in clouds.items():
            at = data.oMi[joint]
            heights = points @ (at.rotation.T @ up) + up @ at.translation - radii
            height[joint] = min(height[joint], heights.min())

    low = {names[link] for plane in safety["planes"] for link in plane["always_low"]}
    free = {joint: h for joint, h in height.items() if joint not in low}
    worst = min(kept, key=lambda pair: least[pair]) if kept else None
    lowest = min(free, key=free.get)
    label = lambda pair: " and ".join(link_of(model, j) for j in pair)
    for pair in pairs:
        print(f"{label(pair)}: {1e3 * least[pair]:.1f} mm{' (exempt)' if pair in spared else ''}", file=sys.stderr)
    for joint, h in height.items():
        print(f"height of {link_of(model, joint)}: {1e3 * h:.1f} mm{' (always low)' if joint in low else ''}", file=sys.stderr)
    nearest = f"{1e3 * least[worst]:.1f} ({label(worst)})" if worst else "none kept apart"
    spared_text = f"{len(spared)}" + (f", least {1e3 * min(least[p] for p in spared):.1f}" if spared else "")
    name = args.name or args.robot.stem
    print(f"| {name} | {geometry} | {len(kept)} | {nearest} | {spared_text} | {1e3 * free[lowest]:.1f} ({link_of(model, lowest)}) |")
    is_broken = (worst and least[worst] < margin - ROUNDING) or free[lowest] < margin - ROUNDING
    return 1 if is_broken else 0


if __name__ == "__main__":
    sys.exit(main())
