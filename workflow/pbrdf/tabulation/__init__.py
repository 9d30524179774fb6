"""From slices of single lights to the table over wavelength and half/difference angles."""
