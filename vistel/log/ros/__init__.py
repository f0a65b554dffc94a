"""Bags of ROS 2 as sensors, a voice and films: what `vistel log import` takes of a folder that `ros2 bag record` wrote."""
