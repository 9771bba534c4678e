# SPDX-License-Identifier: Apache-2.0
"""Build description: an ament_python package that pip installs as well."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "pneumo_ros"

# Every node is an executable of its own: `ros2 run pneumo_ros <name>`, and a console script under pip.
NODES = ["road_profile", "plant", "daq", "estimator", "controller", "session_recorder", "joint_states"]

# `colcon test` looks for pytest in the extra of this name.
TESTING = [
    "pytest>=7.4",
    "hypothesis>=6.98",
    "mcap-ros2-support>=0.5",
    "cobs>=1.2",
    "catkin_pkg>=1",
    "pandas>=2.1",
    "selenium>=4.18",
]

# One list of wheels for those who have no ROS 2 installed; a sourced ROS keeps its own.
ROS_WHEELS = [
    "ros-jazzy-rclpy>=7.1,<8",
    "ros-rmw-fastrtps-cpp>=8.4,<9",
    "ros-jazzy-std-msgs>=5.3,<6",
    "ros-jazzy-sensor-msgs>=5.3,<6",
    "ros-jazzy-diagnostic-msgs>=5.3,<6",
    "ros-jazzy-std-srvs>=5.3,<6",
]


def share(pattern: str) -> list[str]:
    """Files that are installed below share/."""
    return [str(path) for path in sorted(Path().glob(pattern)) if path.is_file()]


setup(
    name=NAME,
    version="0.3.0",
    description="Active pneumatic half-car rig: simulate, drive, log, replay, and diagnose the sim-to-real gap",
    license="Apache-2.0",
    author="pneumo_ros authors",
    maintainer="no public maintainer yet",
    maintainer_email="nobody@pneumo-ros.invalid",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={f"{NAME}.diagnosis.report": ["*.j2"], f"{NAME}.session.report": ["*.j2"], f"{NAME}.fleet": ["*.j2"]},
    python_requires=">=3.10,<3.14",
    install_requires=[
        "setuptools",
        "numpy>=1.26,<3",
        "scipy>=1.11,<2",
        "numba>=0.59,<1",
        "PyYAML>=6,<7",
        "mcap>=1.2,<2",
        "lz4>=4,<5",
        "zstandard>=0.22,<1",
        "rosbags>=0.10,<0.12",
        "typer>=0.9,<1",
        "rich>=13,<16",
        "matplotlib>=3.6,<4",
        "Jinja2>=3.1,<4",
        "MarkupSafe>=2.1,<4",
        "pyserial>=3.5,<4",
    ],
    extras_require={
        "ros": ROS_WHEELS,
        "cluster": ["distributed>=2024.1"],
        "fmu": ["fmpy>=0.3.32,<0.4"],
        "parquet": ["pyarrow>=15"],
        "view": ["bokeh>=3.4,<4"],
        "test": TESTING,
        "mutants": ["cosmic-ray>=8.4"],
        "dev": [*TESTING, "pytest-xdist>=3.7", "ruff>=0.6", "mypy>=1.11", "types-PyYAML>=6"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", share("launch/*.py")),
        (f"share/{NAME}/config", share("config/*")),
        (f"share/{NAME}/config/tables", share("config/tables/*")),
        (f"share/{NAME}/config/calibration", share("config/calibration/*")),
        (f"share/{NAME}/config/layouts", share("config/layouts/*")),
        (f"share/{NAME}/urdf", share("urdf/*")),
    ],
    zip_safe=False,
    entry_points={
        "console_scripts": ["pneumo = pneumo_ros.cli.main:main"]
        + [f"{node} = pneumo_ros.nodes.{node}:main" for node in NODES],
    },
)
