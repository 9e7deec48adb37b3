"""Descriptions of ROS 2 systems as problem files: CARET's architecture files, and the callback-isolated executor's."""
