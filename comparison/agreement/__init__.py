"""Whether two results agree: verdict, its confirmation, and the attribution of what differs.

`cross_check` is the main job; `compare` judges one pair, by `verdict`; `confirmation` holds a difference
against ensembles; `results` is what comes of it, and `attribution` says where and when it begins.
"""
