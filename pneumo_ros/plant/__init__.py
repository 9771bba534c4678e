"""The rig's physics: gas flow, air spring, quarter and half car. Knows nothing of ROS, files or ports."""
