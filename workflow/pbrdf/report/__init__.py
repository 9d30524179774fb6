"""Pages that show how good a table and its fit are: self-contained, offline, reproducible to the byte."""
