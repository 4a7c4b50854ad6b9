"""The world: arms, cable, sockets, cameras and their noise, faults, ground truth."""
