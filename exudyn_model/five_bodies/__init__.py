"""Five bodies with joints in implicit steps: the formulations "full" and "native".

Steps are short in contacts and long in flight (``step_choice``), but equal with Exudyn's own contact object,
or where no joint has clearance.

"full" has the contacts of ``exudyn_model.contact`` as user functions, "native" Exudyn's own contact object at
the slider's corners (``native_contact``).
"""
