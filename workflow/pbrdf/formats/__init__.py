"""Files: what lies on the disk, read with suspicion and written beside, then renamed."""
