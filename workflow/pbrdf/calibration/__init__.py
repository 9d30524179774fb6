"""What a session's targets say of the rig: camera, sphere, lights, polarimeter, radiometry.

Each kind is one small JSON document. Its `source` says where the values come from: ``measured``, or
``file`` (given by the user).
"""
