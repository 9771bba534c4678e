"""Session logs and the table of topics. Knows nothing of rclpy."""
