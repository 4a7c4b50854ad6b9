"""A robot as its file describes it: joints, tool, gripper, collision spheres, and the URDF that they are read from."""
