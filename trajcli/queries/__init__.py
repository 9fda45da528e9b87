"""Questions about an arm: forward and inverse kinematics, Jacobian, poses, robot card."""
