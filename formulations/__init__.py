"""The problems of the paper, each a short declaration over symbols that are handed to it.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021.
"""
