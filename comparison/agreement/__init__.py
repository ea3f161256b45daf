"""Agreement of two results: verdict, confirmation, and attribution of differences.

`cross_check` is the main job; `compare` judges one pair by `verdict` and `scene_verdict`; `confirmation`
tests a difference against ensembles; `results` defines the outcome; `attribution` locates the source and
onset of a difference.
"""
