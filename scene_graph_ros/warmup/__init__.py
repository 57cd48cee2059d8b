"""Compiling kernels before they are needed: in groups, in processes of their own.

Compiled kernels are kept on disk (``geometry.compiled.cache``): later processes load them.
"""
