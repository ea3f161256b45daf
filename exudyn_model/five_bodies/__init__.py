"""Five bodies with joints in fixed implicit steps: the formulations "full" and "native".

"full" has the contacts of ``exudyn_model.contact`` as user functions, "native" Exudyn's own contact object at
the slider's corners (``native_contact``).
"""
