"""Session logs: MCAP and bags read, checked, repaired, converted, compared and written; knows no ROS graph."""
