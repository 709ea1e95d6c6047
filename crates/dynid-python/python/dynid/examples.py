"""Robots for examples and tests."""

TWO_LINKS = """
schema = 1
name = "two links"

[[body]]
name = "upper"
parent = "ground"
joint = { name = "shoulder", axis = [0, 1, 0], limits = { position = [-2, 2], velocity = 3, effort = 200 } }
mass = 4
com = [0.02, 0, 0.2]
inertia_com = [0.06, 0, 0, 0.06, 0, 0.01]

[[body]]
name = "fore"
parent = "upper"
joint = { name = "elbow", xyz = [0, 0, 0.4], axis = [0, 1, 0], limits = { position = [-2, 2], velocity = 3, effort = 80 } }
mass = 2
com = [0, 0.01, 0.15]
inertia_com = [0.02, 0, 0, 0.02, 0, 0.004]

[element.shoulder]
elements = ["viscous", "coulomb"]
viscous = { coefficient = 2 }
coulomb = { effort = 3 }
[element.elbow]
elements = ["viscous", "coulomb"]
viscous = { coefficient = 1 }
coulomb = { effort = 1 }
"""
