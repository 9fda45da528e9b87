"""A reader of URDF that knows nothing of DH tables: poses of links by products of origins and motions."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation


class ReadBack:
    """What a reader of URDF that knows nothing of DH tables makes of a text."""

    def __init__(self, text: str) -> None:
        self.root = ET.fromstring(text)
        self.by_child = {joint.find("child").get("link"): joint for joint in self.root.iter("joint")}
        self.links = [link.get("name") for link in self.root.iter("link")]
        self.moving = {j.get("name"): j for j in self.root.iter("joint") if j.get("type") != "fixed"}

    def pose(self, element: ET.Element) -> np.ndarray:
        matrix = np.eye(4)
        origin = element.find("origin")
        if origin is None:
            return matrix
        matrix[:3, 3] = [float(value) for value in origin.get("xyz", "0 0 0").split()]
        r, p, y = (float(value) for value in origin.get("rpy", "0 0 0").split())
        matrix[:3, :3] = Rotation.from_euler("xyz", [r, p, y]).as_matrix()  # lower case: about fixed axes
        return matrix

    def forward(self, values: dict[str, float], link: str = "tool0") -> np.ndarray:
        if link not in self.by_child:
            return np.eye(4)
        joint = self.by_child[link]
        moved = np.eye(4)
        if joint.get("type") != "fixed":
            axis = np.array([float(value) for value in joint.find("axis").get("xyz").split()])
            axis = axis / np.linalg.norm(axis)
            value = values[joint.get("name")]
            if joint.get("type") == "prismatic":
                moved[:3, 3] = axis * value
            else:
                moved[:3, :3] = Rotation.from_rotvec(axis * value).as_matrix()
        return self.forward(values, joint.find("parent").get("link")) @ self.pose(joint) @ moved
