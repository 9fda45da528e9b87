"""Kinematics of serial robots: model, forward, inverse and differential kinematics, following. numpy only."""
