# SPDX-License-Identifier: Apache-2.0
"""Layouts of the dashboard's panels for Foxglove and PlotJuggler, made from the same table.

Both plot what is recorded, so signals that the dashboard derives (tyre forces, heave from the LVDTs) are replaced by
the recorded ones; both show SI units. Foxglove addresses a JointState's values by their place in the message (the order
of the table of topics, which the recorder keeps), PlotJuggler by name.
"""

from __future__ import annotations

import json
from typing import Any
from xml.etree import ElementTree

from pneumo_ros.dashboard.panels import FRONT, PANELS, REAR, Line, Panel
from pneumo_ros.log import topics

TAB = "half-car rig"
RESIDUAL = "residual"
RUNS = {"measured": "#999999", "nominal": "#1f77b4", "refit": "#9467bd", "corrected": "#2ca02c", RESIDUAL: "#d62728"}
_RAW = (
    Panel("tyre force (N), simulation only", (
        Line("front", topics.TRUTH.name, "front_tyre_force", 1.0, FRONT),
        Line("rear", topics.TRUTH.name, "rear_tyre_force", 1.0, REAR),
    )),
    Panel("displacement (m)", tuple(
        Line(name, topics.DISPLACEMENT.name, name, 1.0, colour, dash)
        for name, colour, dash in zip(
            topics.DISPLACEMENT.names, (FRONT, REAR, FRONT, REAR), ("solid", "solid", "dashed", "dashed"), strict=True
        )
    )),
    Panel("road (m)", tuple(
        Line(name, topics.ROAD.name, name, 1.0, colour) for name, colour in zip(("front", "rear"), (FRONT, REAR),
                                                                               strict=True)
    )),
)  # fmt: skip


def recorded_panels() -> tuple[Panel, ...]:
    """Panels whose every line is recorded, titles in SI."""
    kept = []
    for panel in PANELS:
        lines = tuple(line for line in panel.lines if line.source in topics.BY_NAME)
        if lines:
            kept.append(Panel(f"{panel.title.split(' (')[0]} ({unit(lines[0])})", lines))
    return (*kept, *_RAW)


def residual_panels() -> tuple[Panel, ...]:
    """What a diagnosis leaves (residual.mcap): each channel's runs over each other, then what is left."""
    channels = [(topics.DISPLACEMENT, name) for name in topics.DISPLACEMENT.names]
    channels += [(topic, topic.names[0]) for topic in (topics.FRONT_PRESSURE, topics.REAR_PRESSURE)]
    panels = [
        Panel(f"{_title(topic, name)} ({dict(topic.fields)[name]})", tuple(
            Line(run, f"/{run}{topic.name}", name, 1.0, RUNS[run]) for run in RUNS if run != RESIDUAL
        ))
        for topic, name in channels
    ]  # fmt: skip
    colours = (FRONT, REAR, "#2ca02c", "#9467bd", FRONT, REAR)
    left = [Line(_title(topic, name), f"/{RESIDUAL}{topic.name}", name, 1.0, colour)
            for (topic, name), colour in zip(channels, colours, strict=True)]  # fmt: skip
    return (*panels, Panel("what is left (m)", tuple(left[:4])), Panel("what is left (Pa)", tuple(left[4:])))


def _title(topic: topics.Topic, name: str) -> str:
    plain = topic.name.removeprefix("/rig/").replace("/", " ")
    return name.replace("_", " ") if topic is topics.DISPLACEMENT else plain


def recorded(line: Line) -> topics.Topic:
    """The topic of a session that a line shows, or shows a run of."""
    return topics.BY_NAME[next(name for name in topics.BY_NAME if line.source.endswith(name))]


def unit(line: Line) -> str:
    """SI unit of a line's channel."""
    return dict(recorded(line).fields)[line.channel]


def foxglove_layout(panels: tuple[Panel, ...] | None = None) -> str:
    """A layout file, as Foxglove's "Import from file" takes it."""
    panels = recorded_panels() if panels is None else panels
    plots = {f"Plot!pneumo{i}": _foxglove_plot(panel) for i, panel in enumerate(panels)}
    names = list(plots)
    half = (len(names) + 1) // 2
    columns = {
        "first": _stacked(names[:half]), "second": _stacked(names[half:]), "direction": "row", "splitPercentage": 50,
    }  # fmt: skip
    document = {
        "configById": plots,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": columns,
    }
    return json.dumps(document, indent=2) + "\n"


def foxglove_3d_layout() -> str:
    """A layout for the scenes of ``pneumo log scene``: the rig in 3D above its joints."""
    scene = {
        "cameraState": {"perspective": True, "distance": 1.2, "phi": 75, "thetaOffset": 35,
                        "target": [0, 0, 0], "targetOffset": [0, 0, 0.05], "targetOrientation": [0, 0, 0, 1],
                        "fovy": 45, "near": 0.01, "far": 100},
        "followMode": "follow-none",
        "followTf": "ground",
        "scene": {},
        "transforms": {},
        "topics": {topics.ROBOT_DESCRIPTION.name: {"visible": True}},
        "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "visible": True, "frameLocked": True,
                            "label": "Grid", "size": 2, "divisions": 20, "frameId": "ground"}},
    }  # fmt: skip
    joints = Panel("joints (m, rad)", tuple(
        Line(name, topics.JOINT_STATES.name, name, 1.0, colour)
        for name, colour in zip(topics.JOINT_STATES.names, ("#222222", "#7f7f7f", FRONT, REAR), strict=True)
    ))  # fmt: skip
    document = {
        "configById": {"3D!pneumo": scene, "Plot!pneumo": _foxglove_plot(joints)},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": {"first": "3D!pneumo", "second": "Plot!pneumo", "direction": "column", "splitPercentage": 70},
    }
    return json.dumps(document, indent=2) + "\n"


def _foxglove_plot(panel: Panel) -> dict[str, Any]:
    paths = [
        {
            "value": foxglove_path(line),
            "label": line.label,
            "color": line.colour,
            "enabled": True,
            "timestampMethod": "headerStamp",
        }
        for line in panel.lines
    ]
    return {
        "title": panel.title,
        "paths": paths,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
        "foxglovePanelTitle": panel.title,
    }


def foxglove_path(line: Line) -> str:
    """Message path of a line: ``/valve/command.position[0]``."""
    topic = recorded(line)
    if topic.type != topics.JOINT:
        return f"{line.source}.{line.channel}"
    return f"{line.source}.position[{topic.names.index(line.channel)}]"


def _stacked(names: list[str]) -> Any:
    """A column of panels of equal height."""
    if len(names) == 1:
        return names[0]
    share = round(100.0 / len(names), 2)
    return {"first": names[0], "second": _stacked(names[1:]), "direction": "column", "splitPercentage": share}


def plotjuggler_layout(panels: tuple[Panel, ...] | None = None) -> str:
    """A layout file for PlotJuggler 3."""
    root = ElementTree.Element("root")
    tabs = ElementTree.SubElement(root, "tabbed_widget", {"name": "Main Window", "parent": "main_window"})
    tab = ElementTree.SubElement(tabs, "Tab", tab_name=TAB, containers="1")
    panels = recorded_panels() if panels is None else panels
    half = (len(panels) + 1) // 2
    both = _splitter(ElementTree.SubElement(tab, "Container"), "|", 2)
    for column in (panels[:half], panels[half:]):
        splitter = _splitter(both, "-", len(column))
        for panel in column:
            _plotjuggler_plot(splitter, panel)
    ElementTree.SubElement(tabs, "currentTabIndex", index="0")
    ElementTree.indent(root, " ")
    return "<?xml version='1.0' encoding='UTF-8'?>\n" + ElementTree.tostring(root, encoding="unicode") + "\n"


def _splitter(parent: ElementTree.Element, orientation: str, count: int) -> ElementTree.Element:
    sizes = ";".join([f"{1.0 / count:.6f}"] * count)
    return ElementTree.SubElement(parent, "DockSplitter", orientation=orientation, count=str(count), sizes=sizes)


def _plotjuggler_plot(parent: ElementTree.Element, panel: Panel) -> None:
    area = ElementTree.SubElement(parent, "DockArea", name=panel.title)
    plot = ElementTree.SubElement(area, "plot", mode="TimeSeries", style="Lines", flip_x="false", flip_y="false")
    ElementTree.SubElement(plot, "range", left="0.0", right="20.0", bottom="-1.0", top="1.0")
    ElementTree.SubElement(plot, "limitY")
    for line in panel.lines:
        ElementTree.SubElement(plot, "curve", name=plotjuggler_curve(line), color=line.colour)


def plotjuggler_curve(line: Line) -> str:
    """Curve name of a line: ``/valve/command/front_inlet/position``."""
    suffix = "/position" if recorded(line).type == topics.JOINT else ""
    return f"{line.source}/{line.channel}{suffix}"


LAYOUTS = {
    "foxglove.json": foxglove_layout, "foxglove_3d.json": foxglove_3d_layout, "plotjuggler.xml": plotjuggler_layout,
    "foxglove_residual.json": lambda: foxglove_layout(residual_panels()),
    "plotjuggler_residual.xml": lambda: plotjuggler_layout(residual_panels()),
}  # fmt: skip
"""File name below config/layouts/ -> what makes it."""
