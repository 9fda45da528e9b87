"""A path q(s) as fast as its limits allow: time-optimal parametrisation by reachability. numpy only.

Source: H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis (IEEE Transactions on Robotics 34(3), 2018).
"""
