"""Launch files (XML, YAML, Python) and parameter files of ROS 2, as far as they are static; nothing is executed."""
