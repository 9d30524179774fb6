"""What the user wrote: config, materials and rig, checked before anything starts."""
