"""What images cost and how exact depths are, ours and other renderers', without a GPU.

``scenes`` has what is seen, ``engines`` those who see it, ``truths`` what is there to see.
"""
