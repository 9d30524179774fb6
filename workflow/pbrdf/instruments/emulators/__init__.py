"""Instruments that speak their wire protocols from this program, with a clock that need not wait."""
